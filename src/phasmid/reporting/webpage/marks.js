"use strict";
// A robot on its ground, and what is shown of its forces, feet and balance.

(() => {
  const { unpacked, add, less, times, size, unit, along, hull, rgb, IDENTITY } = Phasmid.algebra;
  const { coarse, merged } = Phasmid.meshes;
  const WHITE = [1, 1, 1, 1];
  // Detail, in shares of the robot's span: of shadows, and of both where the processor draws.
  const SHADE = 1 / 40;
  const ROUGH = 1 / 60;
  const ROUGH_SHADE = 1 / 20;

  // A scene's solids in a drawing, to be painted at poses that change.
  Phasmid.marks = (drawing, scene, { rough = false } = {}) => {
    const { gl, shapes } = drawing;
    const span = scene.span || 0.2;
    const weight = scene.weight;
    const mesh = ({ vertices, faces }) => ({ vertices: unpacked(vertices), faces: unpacked(faces) });
    const exact = scene.meshes.map(mesh);
    const shown = rough ? exact.map((one) => coarse(one, ROUGH * span)) : exact;
    const shades = exact.map((one) => coarse(one, (rough ? ROUGH_SHADE : SHADE) * span));
    // What moves together is one solid, so that there are few to draw; the trunk is link -1.
    const pieces = [...new Set(scene.pieces.map(({ link }) => link))].map((link) => {
      const own = scene.pieces.filter((piece) => piece.link === link);
      const one = (meshes) => drawing.solid(merged(own.map(({ mesh, colour }) => ({ ...meshes[mesh], colour }))));
      return { link, solid: one(shown), shade: one(shades) };
    });
    const uneven = scene.ground && drawing.solid(mesh(scene.ground));
    const legColours = scene.legs.map(rgb);
    const forceColour = rgb(scene.force_colour);
    // Metres of an arrow for a newton.
    const perNewton = (scene.force_length * span) / weight;

    function forget() {
      for (const { solid, shade } of pieces) [solid, shade].forEach(drawing.forget);
      if (uneven) drawing.forget(uneven);
    }

    // What is in the way does not hide what is drawn meanwhile.
    function over(act) {
      gl.disable(gl.DEPTH_TEST);
      act();
      gl.enable(gl.DEPTH_TEST);
    }

    function ground(seen, colours, grid = true) {
      const paint = [...colours.floor, grid ? 1 : 0];
      drawing.lay(Boolean(uneven));
      if (uneven) {
        drawing.draw(uneven, IDENTITY, paint, "ground");
        return;
      }
      const model = Float32Array.from(IDENTITY);
      model[0] = model[5] = 1.05 * 2.4 * seen.distance;
      [model[12], model[13], model[14]] = [seen.target[0], seen.target[1], scene.level];
      over(() => drawing.draw(shapes.flat, model, paint, "ground"));
    }

    // The poses of the trunk and of all links, in the world.
    function shadow(X_body, X_links, colours) {
      if (uneven) return;
      const paint = [0, 0, 0, colours.dark ? 0.42 : 0.2]; // black, whatever the piece's colour is
      drawing.shadows(scene.level, () => {
        for (const { link, shade } of pieces) drawing.draw(shade, link < 0 ? X_body : X_links[link], paint, "plain");
      });
    }

    function machine(X_body, X_links) {
      gl.disable(gl.BLEND);
      for (const { link, solid } of pieces) drawing.draw(solid, link < 0 ? X_body : X_links[link], WHITE, "lit");
    }

    function support(standing, safe, seen, colours) {
      const corners = hull(standing);
      if (corners.length < 3) return;
      const colour = safe ? colours.good : colours.bad;
      gl.enable(gl.BLEND);
      over(() => {
        drawing.fan(corners, colour, 0.22);
        corners.forEach((corner, k) =>
          drawing.ribbon([...corner, ...corners[(k + 1) % corners.length]], 0.012 * span, colour, seen.eye, 0.9));
      });
    }

    // The way of a foot, its end in full colour.
    function trail(points, leg, seen) {
      gl.enable(gl.BLEND);
      gl.depthMask(false);
      drawing.ribbon(points, 0.022 * span, legColours[leg], seen.eye, 0.15, 0.95);
      gl.depthMask(true);
    }

    // A force on a foot [N]; as in the still picture it lies over everything, and only its own
    // far sides are hidden.
    function arrow(foot, newtons, colour = forceColour, thickness = 1) {
      if (!(size(newtons) >= 0.01 * weight)) return;
      const arrow = times(newtons, perNewton);
      const length = size(arrow);
      const head = Math.min(0.13 * span * Math.sqrt(thickness), 0.6 * length);
      const neck = add(foot, times(arrow, (length - head) / length));
      const paint = [...colour, 1];
      gl.disable(gl.BLEND);
      gl.enable(gl.CULL_FACE);
      over(() => {
        drawing.draw(shapes.shaft, along(foot, arrow, 0.018 * span * thickness, length - head), paint, "lit");
        drawing.draw(shapes.cone, along(neck, arrow, 0.05 * span * thickness, head), paint, "lit");
      });
      gl.disable(gl.CULL_FACE);
    }

    // Within it a force may lean from the ground's normal without slip.
    function frictionCone(foot, normal, friction, leg, seen) {
      const height = 0.5 * scene.force_length * span;
      const radius = Math.min(friction, 3) * height;
      const model = along(foot, normal, radius, height);
      gl.enable(gl.BLEND);
      gl.depthMask(false);
      drawing.draw(shapes.funnel, model, [...legColours[leg], 0.16], "plain");
      const rim = [];
      for (let k = 0; k <= 32; k++) {
        const [c, s] = [Math.cos((Math.PI * k) / 16), Math.sin((Math.PI * k) / 16)];
        for (let i = 0; i < 3; i++) rim.push(model[i] * c + model[4 + i] * s + model[8 + i] + model[12 + i]);
      }
      drawing.ribbon(rim, 0.008 * span, legColours[leg], seen.eye, 0.8);
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
        drawing.ribbon([...ground, ...place], 0.01 * span, colour, seen.eye);
        drawing.draw(shapes.ball, upright(place, 0.035 * span), paint, "plain");
      });
    }

    return { span, legColours, forget, ground, shadow, machine, support, trail, arrow, frictionCone, centre };
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
