"use strict";
// A robot on its ground, and what is shown of its forces, feet and balance.

(() => {
  const { unpacked, vector, add, less, times, size, unit, along, hull, rgb, IDENTITY } = Phasmid.algebra;
  const { coarse, merged, SHAPES } = Phasmid.meshes;
  const WHITE = [1, 1, 1, 1];
  // Detail, in shares of the robot's span: of shadows, and of both where the processor draws, whose
  // cost is that of the number of triangles.
  const SHADE = 1 / 40;
  const ROUGH = 1 / 20;
  const ROUGH_SHADE = 1 / 10;

  // A scene's solids in a drawing, to be painted at poses that change.
  Phasmid.marks = (drawing, scene, { rough = false } = {}) => {
    const { gl, shapes } = drawing;
    const span = scene.span || 0.2;
    const weight = scene.weight;
    const mesh = ({ vertices, faces }) => ({ vertices: unpacked(vertices), faces: unpacked(faces) });
    const exact = scene.meshes.map(mesh);
    // The trunk is link -1.
    const links = [...new Set(scene.pieces.map(({ link }) => link))];
    const whole = (meshes) => (link) =>
      scene.pieces.filter((piece) => piece.link === link).map(({ mesh, colour }) => ({ ...meshes[mesh], colour }));
    const detail = (cell) => flock(links.map(whole(cell ? exact.map((one) => coarse(one, cell * span)) : exact)));
    // Solids and shadows, coarse where the processor draws a robot that moves.
    const sets = {};
    const flocks = (still) =>
      (sets[rough && !still] ??= (rough && !still ? [ROUGH, ROUGH_SHADE] : [0, SHADE]).map(detail));
    const floor = Phasmid.floor(drawing, scene);
    const legColours = scene.legs.map(rgb);
    const forceColour = rgb(scene.force_colour);
    // Metres of an arrow for a newton.
    const perNewton = (scene.force_length * span) / weight;

    const legs = scene.legs.length;
    // The shafts of all legs, then their heads.
    const lances = flock([SHAPES.shaft, SHAPES.cone].flatMap((shape) => scene.legs.map(() => [shape])));
    const funnels = flock(legColours.map((colour) => [{ ...SHAPES.funnel, colour }]));

    // Things that each move for themselves are one solid, as far as there is room for their poses:
    // to draw few large ones costs less than many small ones.
    function flock(things) {
      const made = [];
      for (let first = 0; first < things.length; first += drawing.POSES) {
        const own = things.slice(first, first + drawing.POSES);
        const meshes = own.flatMap((thing, part) => thing.map((one) => ({ ...one, part })));
        made.push({ first, poses: new Float32Array(16 * own.length), solid: drawing.solid(merged(meshes)) });
      }
      return made;
    }

    // Each of the things at its pose; one that has none is left out, as a point.
    function paint(flock, pose, colour, kind) {
      for (const { first, poses, solid } of flock) {
        poses.fill(0);
        let some = false;
        for (let k = 0; k < poses.length / 16; k++) {
          const X = pose(first + k);
          if (!X) continue;
          poses.set(X, 16 * k);
          some = true;
        }
        if (some) drawing.draw(solid, poses, colour, kind);
      }
    }

    function forget() {
      for (const { solid } of [...Object.values(sets), lances, funnels].flat(2)) drawing.forget(solid);
      floor.forget();
    }

    // What is in the way does not hide what is drawn meanwhile.
    function over(act) {
      gl.disable(gl.DEPTH_TEST);
      act();
      gl.enable(gl.DEPTH_TEST);
    }

    // The poses of the trunk and of all links, in the world.
    const poseOf = (X_body, X_links) => (k) => (links[k] < 0 ? X_body : X_links[links[k]]);

    // The ground in the robot's shadow.
    function ground(X_body, X_links, seen, colours, grid, still = false) {
      const place = vector(X_body, 4);
      const far = X_links.reduce((most, X) => Math.max(most, size(less(vector(X, 4), place))), span);
      drawing.shadows(place, 2 * far, colours.dark ? 0.5 : 0.32,
        () => paint(flocks(still)[1], poseOf(X_body, X_links), WHITE, "depth"));
      floor.paint(seen, colours, grid);
    }

    function machine(X_body, X_links, still = false) {
      gl.disable(gl.BLEND);
      paint(flocks(still)[0], poseOf(X_body, X_links), WHITE, "lit");
    }

    function support(standing, safe, seen, colours) {
      const corners = hull(standing);
      if (corners.length < 3) return;
      const colour = safe ? colours.good : colours.bad;
      const edge = (corner, k) => [...corner, ...corners[(k + 1) % corners.length]];
      gl.enable(gl.BLEND);
      over(() => {
        drawing.fan(corners, colour, 0.22);
        drawing.ribbons(
          corners.map((corner, k) => ({ points: edge(corner, k), width: 0.012 * span, colour, from: 0.9 })), seen.eye);
      });
    }

    // The ways of the feet, their ends in full colour.
    function trails(ways, seen) {
      gl.enable(gl.BLEND);
      gl.depthMask(false);
      const look = { width: 0.022 * span, from: 0.15, to: 0.95 };
      drawing.ribbons(ways.map((points, leg) => ({ ...look, points, colour: legColours[leg] })), seen.eye);
      gl.depthMask(true);
    }

    // Forces on the feet [N]; as in the still picture they lie over everything, and only their own
    // far sides are hidden.
    function arrows(feet, forces, colour = forceColour, thickness = 1) {
      const made = feet.map((foot, leg) => {
        if (!(size(forces[leg]) >= 0.01 * weight)) return null;
        const arrow = times(forces[leg], perNewton);
        const length = size(arrow);
        const head = Math.min(0.13 * span * Math.sqrt(thickness), 0.6 * length);
        const neck = add(foot, times(arrow, (length - head) / length));
        return {
          shaft: along(foot, arrow, 0.018 * span * thickness, length - head),
          head: along(neck, arrow, 0.05 * span * thickness, head),
        };
      });
      gl.disable(gl.BLEND);
      gl.enable(gl.CULL_FACE);
      const pose = (k) => (k < legs ? made[k]?.shaft : made[k - legs]?.head);
      over(() => paint(lances, pose, [...colour, 1], "lit"));
      gl.disable(gl.CULL_FACE);
    }

    // Within them forces may lean from the ground's normals without slip; where a foot has none,
    // there is no cone.
    function frictionCones(feet, normals, friction, seen) {
      const height = 0.5 * scene.force_length * span;
      const radius = Math.min(friction, 3) * height;
      const made = feet.map((foot, leg) => normals[leg] && along(foot, normals[leg], radius, height));
      gl.enable(gl.BLEND);
      gl.depthMask(false);
      paint(funnels, (leg) => made[leg], [1, 1, 1, 0.16], "plain");
      const rims = [];
      made.forEach((X, leg) => {
        if (!X) return;
        const points = [];
        for (let k = 0; k <= 32; k++) {
          const [c, s] = [Math.cos((Math.PI * k) / 16), Math.sin((Math.PI * k) / 16)];
          for (let i = 0; i < 3; i++) points.push(X[i] * c + X[4 + i] * s + X[8 + i] + X[12 + i]);
        }
        rims.push({ points, width: 0.008 * span, colour: legColours[leg], from: 0.8 });
      });
      drawing.ribbons(rims, seen.eye);
      gl.depthMask(true);
    }

    // The centre of mass and the point of the ground below it. It lies within the body, so that it
    // is drawn over everything.
    function centre(place, height, safe, seen, colours) {
      const ground = [place[0], place[1], height + 0.002 * span];
      const colour = safe ? colours.mark : colours.bad;
      const paint = [...colour, 1];
      const upright = (p, r) => along(p, [0, 0, 1], r, r);
      gl.disable(gl.BLEND);
      over(() => {
        drawing.draw(shapes.disc, upright(ground, 0.055 * span), [...colours.back, 1], "plain");
        drawing.draw(shapes.disc, upright(ground, 0.04 * span), paint, "plain");
        drawing.ribbons([{ points: [...ground, ...place], width: 0.01 * span, colour }], seen.eye);
        drawing.draw(shapes.ball, upright(place, 0.035 * span), paint, "plain");
      });
    }

    return { span, legColours, forget, ground, machine, support, trails, arrows, frictionCones, centre };
  };

  // Numbers of the legs over a canvas, above their knees.
  Phasmid.legNumbers = (canvas, scene) => {
    const labels = scene.legs.map((colour, leg) => {
      const label = document.createElement("span");
      label.className = "leg-label";
      label.textContent = String(leg + 1);
      label.style.color = colour;
      label.setAttribute("aria-hidden", "true");
      canvas.parentElement.append(label);
      return label;
    });

    function paint(on, seen, X_links) {
      const { clientWidth: wide, clientHeight: high } = canvas;
      labels.forEach((label, leg) => {
        const knee = scene.knees[leg];
        label.hidden = !on || knee < 0;
        if (label.hidden) return;
        const X = X_links[knee];
        const [px, py, pz] = [X[12], X[13], X[14] + 0.13 * (scene.span || 0.2)];
        const m = seen.matrix;
        const row = (k) => m[k] * px + m[4 + k] * py + m[8 + k] * pz + m[12 + k];
        const x = (0.5 + (0.5 * row(0)) / row(3)) * wide;
        const y = (0.5 - (0.5 * row(1)) / row(3)) * high;
        label.hidden = !(x > 8 && y > 8 && x < wide - 8 && y < high - 8);
        label.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px) translate(-50%, -50%)`;
      });
    }

    return { paint, forget: () => labels.forEach((label) => label.remove()) };
  };
})();
