"use strict";
// The replay of a run.

(() => {
  const { unpacked, add, size, vector, product, pose, heading } = Phasmid.algebra;
  const scene = JSON.parse(document.getElementById("scene").textContent);
  const canvas = document.getElementById("view");
  const drawing = scene && Phasmid.drawing(canvas);
  if (!drawing) return;

  // ------------------------------------------------------------------ the run

  const time = unpacked(scene.time);
  const bodyPosition = unpacked(scene.body_position);
  const bodyOrientation = unpacked(scene.body_orientation);
  const linkPosition = unpacked(scene.link_position);
  const linkOrientation = unpacked(scene.link_orientation);
  const feetRelative = unpacked(scene.feet);
  const forces = unpacked(scene.forces);
  const down = unpacked(scene.down);
  const centre = unpacked(scene.centre);
  const below = unpacked(scene.below);
  const margin = unpacked(scene.margin);
  const count = time.length;
  const links = scene.link_position.shape[1];
  const legs = scene.legs.length;
  const first = time[0];
  const last = time[count - 1];

  // Feet in the world, since they are kept from the body's place.
  let feet = null;
  if (feetRelative) {
    feet = new Float32Array(feetRelative.length);
    for (let i = 0; i < feet.length; i++)
      feet[i] = feetRelative[i] + bodyPosition[3 * Math.floor(i / (3 * legs)) + (i % 3)];
  }

  function between(array, width, columns, column, at) {
    const out = new Array(width);
    const a = (at.frame * columns + column) * width;
    const b = (at.next * columns + column) * width;
    for (let k = 0; k < width; k++) out[k] = array[a + k] + at.part * (array[b + k] - array[a + k]);
    return out;
  }

  function turn(array, columns, column, at) {
    const a = (at.frame * columns + column) * 4;
    const b = (at.next * columns + column) * 4;
    let sign = 0;
    for (let k = 0; k < 4; k++) sign += array[a + k] * array[b + k];
    sign = sign < 0 ? -1 : 1;
    const q = [0, 1, 2, 3].map((k) => array[a + k] + at.part * (sign * array[b + k] - array[a + k]));
    const length = Math.hypot(...q);
    return q.map((v) => v / length);
  }

  function moment(t) {
    let low = 0;
    let high = count - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (time[middle] <= t) low = middle;
      else high = middle;
    }
    const next = Math.min(low + 1, count - 1);
    const step = time[next] - time[low];
    const part = step > 0 ? Math.min(Math.max((t - time[low]) / step, 0), 1) : 0;
    return { frame: low, next, part, near: part < 0.5 ? low : next };
  }

  // ------------------------------------------------------------------ one picture

  const byId = (id) => document.getElementById(id);
  const shown = (name) => { const box = byId(`show-${name}`); return box && box.checked; };
  const marks = Phasmid.marks(drawing, scene);
  const numbers = Phasmid.legNumbers(canvas, scene);
  const camera = Phasmid.camera(canvas, () => requestPaint());
  let now = time[scene.start];
  let colours = Phasmid.drawing.look();

  camera.largest = 1.6 * marks.span;
  if (feet)
    for (let k = 0; k < legs; k++)
      camera.largest = Math.max(camera.largest, size(vector(feetRelative, scene.start * legs + k)));
  const startYaw = heading(turn(bodyOrientation, 1, 0, { frame: scene.start, next: scene.start, part: 0 }));
  const usual = scene.level === null ? "behind" : "corner";
  camera.choose(usual, startYaw);

  function paintAll() {
    drawing.fit(Math.min(window.devicePixelRatio || 1, 2));
    const here = moment(now);
    const body = between(bodyPosition, 3, 1, 0, here);
    const X_body = pose(body, turn(bodyOrientation, 1, 0, here));
    const X_links = [];
    for (let k = 0; k < links; k++)
      X_links.push(product(X_body, pose(between(linkPosition, 3, links, k, here), turn(linkOrientation, links, k, here))));
    const where = shown("follow") ? body : vector(bodyPosition, scene.start);
    const places = [];
    if (feet) for (let leg = 0; leg < legs; leg++) places.push(between(feet, 3, legs, leg, here));
    const lowest = feet ? Math.min(...places.map((foot) => foot[2])) : body[2] - marks.span;
    const seen = camera.sight([where[0], where[1], where[2] - 0.35 * Math.max(body[2] - lowest, 0)]);
    const safe = !margin || margin[here.near] >= 0;

    drawing.begin(seen, colours);
    marks.ground(X_body, X_links, seen, colours, true);
    if (shown("support") && down)
      marks.support(places.filter((_, leg) => down[here.near * legs + leg]), safe, seen, colours);
    marks.machine(X_body, X_links);
    if (shown("trails") && feet) paintTrails(here, places, seen);
    if (shown("forces") && forces && feet)
      marks.arrows(places, places.map((_, leg) => between(forces, 3, legs, leg, here)));
    if (shown("centre") && centre)
      marks.centre(
        add(between(centre, 3, 1, 0, here), body), body[2] + between(below, 1, 1, 0, here)[0], safe, seen, colours);
    numbers.paint(shown("names"), seen, X_links);
    showValues(here);
  }

  function paintTrails(here, places, seen) {
    const begin = moment(Math.max(now - scene.trail, first)).frame;
    const stride = Math.max(1, Math.ceil((here.frame - begin) / 160));
    const ways = places.map((place, leg) => {
      const points = [];
      for (let k = begin; k <= here.frame; k += stride) points.push(...vector(feet, k * legs + leg));
      return [...points, ...place];
    });
    marks.trails(ways, seen);
  }

  // ------------------------------------------------------------------ words beside it

  const slider = byId("seek");
  const clock = byId("clock");
  const loads = [...document.querySelectorAll("[data-load]")];

  function showValues(here) {
    const text = `${now.toFixed(2)} s`;
    clock.textContent = `${text} of ${last.toFixed(2)} s`;
    slider.value = String(now);
    slider.setAttribute("aria-valuetext", text);
    const output = byId("margin");
    if (output && margin) {
      const value = margin[here.near];
      const none = value < -1e8;
      output.textContent = none ? "fewer than three feet" : `${(1000 * value).toFixed(1)} mm`;
      output.className = value < 0 ? "beyond" : "";
    }
    if (!forces) return;
    let sum = 0;
    loads.forEach((cell, leg) => {
      const newtons = between(forces, 3, legs, leg, here);
      sum += newtons[2];
      cell.textContent = `${Math.max(size(newtons), 0).toFixed(1)} N`;
      cell.parentElement.classList.toggle("swings", Boolean(down) && !down[here.near * legs + leg]);
    });
    const total = byId("load-sum");
    if (total) total.textContent = `${sum.toFixed(1)} N of ${scene.weight.toFixed(1)} N`;
  }

  // ------------------------------------------------------------------ controls

  const button = byId("play");
  let plays = false;
  let requested = false;
  let before = 0;

  function requestPaint() {
    if (requested) return;
    requested = true;
    requestAnimationFrame((stamp) => {
      requested = false;
      if (plays) {
        now += (Math.min((stamp - before) / 1000, 0.25)) * Number(byId("speed").value);
        before = stamp;
        if (now >= last) [now, plays] = [last, false];
        show();
      }
      paintAll();
      if (plays) requestPaint();
    });
  }

  function show() {
    button.textContent = plays ? "Pause" : "Play";
    button.setAttribute("aria-pressed", String(plays));
  }

  function toggle() {
    plays = !plays;
    if (plays && now >= last - 1e-6) now = first;
    before = performance.now();
    show();
    requestPaint();
  }

  function go(t) {
    now = Math.min(Math.max(t, first), last);
    requestPaint();
  }

  function step(frames) {
    plays = false;
    show();
    go(time[Math.min(Math.max(moment(now).near + frames, 0), count - 1)]);
  }

  button.addEventListener("click", toggle);
  byId("back").addEventListener("click", () => step(-1));
  byId("on").addEventListener("click", () => step(1));
  slider.addEventListener("input", () => { plays = false; show(); go(Number(slider.value)); });
  slider.min = String(first);
  slider.max = String(last);
  slider.step = "any";
  byId("view-from").addEventListener("change", (event) => { camera.choose(event.target.value, startYaw); requestPaint(); });
  byId("view-from").value = usual;
  for (const box of document.querySelectorAll("#replay input[type=checkbox]")) box.addEventListener("change", requestPaint);

  const HANDS = {
    " ": toggle,
    ArrowLeft: (event) => (event.shiftKey ? go(now - 1) : step(-1)),
    ArrowRight: (event) => (event.shiftKey ? go(now + 1) : step(1)),
    Home: () => go(first),
    End: () => go(last),
    "+": () => camera.nearer(1.15),
    "-": () => camera.nearer(1 / 1.15),
  };
  byId("replay").addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const kind = event.target.tagName;
    // What a control does with a key of its own stays as it is, but for the slider's.
    if (kind === "SELECT" || kind === "SUMMARY" || kind === "A") return;
    if (event.key === " " && (kind === "BUTTON" || event.target.type === "checkbox")) return;
    const act = HANDS[event.key];
    if (!act) return;
    event.preventDefault();
    act(event);
  });

  canvas.addEventListener("webglcontextlost", (event) => {
    event.preventDefault();
    document.documentElement.classList.remove("plays");
  });

  document.documentElement.classList.add("plays");
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    colours = Phasmid.drawing.look();
    requestPaint();
  });
  new ResizeObserver(requestPaint).observe(canvas);
  show();
  requestPaint();
})();
