"use strict";
// The robot in its world, painted as frames come.

(() => {
  const { product, pose, heading, size, less, rgb } = Phasmid.algebra;
  const STILL = 600; // milliseconds without another picture, after which the processor draws finely
  const byId = (id) => document.getElementById(id);

  Phasmid.view = (canvas, frames) => {
    const soft = Phasmid.drawing.bySoftware();
    const drawing = Phasmid.drawing(canvas, { antialias: !soft });
    if (!drawing) {
      canvas.hidden = true;
      byId("no-view").hidden = false;
      return { begin() {}, requestPaint() {}, perSecond: 0 };
    }
    const camera = Phasmid.camera(canvas, () => requestPaint());
    const calm = matchMedia("(prefers-reduced-motion: reduce)");
    let colours = look();
    let scene = null;
    let marks = null;
    let numbers = null;
    let requested = false;
    let place = null;
    let previous = 0;
    let rest = 0;
    const shownAt = [];
    const X_body = new Float32Array(16);
    const X_body_link = new Float32Array(16);
    let X_links = [];
    const self = { begin, requestPaint, get perSecond() { return perSecond(); } };

    function look() {
      const style = getComputedStyle(document.documentElement);
      return { ...Phasmid.drawing.look(), model: rgb(style.getPropertyValue("--model")) };
    }

    const shown = (name) => byId(`show-${name}`).checked;

    function begin(newScene) {
      marks?.forget();
      numbers?.forget();
      const first = scene === null || scene.span !== newScene.span;
      if (scene?.number !== newScene.number) place = null;
      scene = newScene;
      marks = Phasmid.marks(drawing, scene, { rough: soft });
      numbers = Phasmid.legNumbers(canvas, scene);
      X_links = Array.from({ length: scene.links }, () => new Float32Array(16));
      if (first) camera.largest = 0;
    }

    function requestPaint() {
      if (requested) return;
      requested = true;
      requestAnimationFrame(paint);
    }

    const vector = (row, name, k = 0) => {
      const i = frames.at[name] + 3 * k;
      return [row[i], row[i + 1], row[i + 2]];
    };
    const turn = (row, name, k = 0) => {
      const i = frames.at[name] + 4 * k;
      return [row[i], row[i + 1], row[i + 2], row[i + 3]];
    };

    function aim(row, body) {
      camera.largest = 1.6 * marks.span;
      for (let leg = 0; leg < scene.legs.length; leg++) {
        const reach = size(less(vector(row, "foot_position", leg), body));
        if (reach > camera.largest) camera.largest = reach;
      }
      camera.choose(byId("view-from").value, heading(turn(row, "body_orientation")));
    }

    // Where the camera looks: it eases after the robot, unless the reader wants no motion of its own.
    function follow(body, lowest, seconds) {
      const wanted = [body[0], body[1], body[2] - 0.35 * Math.max(body[2] - lowest, 0)];
      const far = place && size(less(wanted, place)) > 3 * camera.largest;
      if (!place || far || (calm.matches && shown("follow"))) place = wanted;
      else if (shown("follow")) {
        const part = 1 - Math.exp(-seconds / 0.25);
        for (let k = 0; k < 3; k++) place[k] += part * (wanted[k] - place[k]);
      }
      return size(less(wanted, place)) > 1e-4 * camera.largest && shown("follow");
    }

    function paint(stamp, still = false) {
      requested = false;
      if (!scene || !frames.latest) return;
      const seconds = Math.min((stamp - previous) / 1000, 0.25);
      previous = stamp;
      drawing.fit(!soft ? Math.min(window.devicePixelRatio || 1, 2) : still ? 2 : 0.75);
      const { row, moves } = frames.now(soft ? Infinity : performance.now());
      const body = vector(row, "body_position");
      if (camera.largest === 0) aim(row, body);
      pose(body, turn(row, "body_orientation"), X_body);
      X_links.forEach((X, k) => {
        pose(vector(row, "link_position", k), turn(row, "link_orientation", k), X_body_link);
        product(X_body, X_body_link, X);
      });
      const feet = scene.legs.map((_, leg) => vector(row, "foot_position", leg));
      const lowest = feet.reduce((least, foot) => (foot[2] < least ? foot[2] : least), body[2]);
      const eases = follow(body, lowest, seconds);
      const seen = camera.sight(place);
      const contact = frames.at.contact;
      const down = (leg) => frames.latest[contact + leg] > 0.5;
      const safe = row[frames.at.margin] >= 0;

      drawing.begin(seen, colours);
      marks.ground(X_body, X_links, seen, colours, shown("grid"), still);
      if (shown("support")) marks.support(feet.filter((_, leg) => down(leg)), safe, seen, colours);
      marks.machine(X_body, X_links, still);
      if (shown("trails")) marks.trails(feet.map((foot, leg) => way(foot, leg)), seen);
      if (shown("cones") && scene.friction > 0)
        marks.frictionCones(feet, feet.map((_, leg) => down(leg) && vector(row, "foot_normal", leg)), scene.friction, seen);
      const forces = (name) => feet.map((_, leg) => vector(row, name, leg));
      if (shown("model")) marks.arrows(feet, forces("foot_force_model"), colours.model, 0.5);
      if (shown("forces")) marks.arrows(feet, forces("foot_force"));
      if (shown("centre")) marks.centre(vector(row, "centre"), row[frames.at.below], safe, seen, colours);
      numbers.paint(shown("names"), seen, X_links);
      shownAt.push(stamp);
      while (shownAt[0] < stamp - 1000) shownAt.shift();
      if (!soft && (moves || eases)) requestPaint();
      clearTimeout(rest);
      if (soft && !still) rest = setTimeout(() => requestAnimationFrame((later) => paint(later, true)), STILL);
    }

    // Where a foot has been, and where it is.
    const way = (foot, leg) => [...frames.trails[leg].flatMap(([x, y, z]) => [x, y, z]), ...foot];

    function perSecond() {
      const now = performance.now();
      return shownAt.filter((stamp) => stamp > now - 1000).length;
    }

    byId("view-from").addEventListener("change", (event) => {
      if (frames.latest) camera.choose(event.target.value, heading(turn(frames.latest, "body_orientation")));
      requestPaint();
    });
    for (const box of document.querySelectorAll("#eyes input")) box.addEventListener("change", requestPaint);
    canvas.addEventListener("keydown", (event) => {
      if (event.key === "+" || event.key === "=") camera.nearer(1.15);
      else if (event.key === "-") camera.nearer(1 / 1.15);
      else if (event.key === "ArrowLeft") camera.azimuth -= 0.1;
      else if (event.key === "ArrowRight") camera.azimuth += 0.1;
      else return;
      event.preventDefault();
      requestPaint();
    });
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    // All that was drawn with is gone; the robot itself is kept by the server.
    canvas.addEventListener("webglcontextrestored", () => location.reload());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
      colours = look();
      requestPaint();
    });
    new ResizeObserver(requestPaint).observe(canvas);
    return self;
  };
})();
