"use strict";
// The leg bench's drawings: a leg in its own plane and from above, as SVG.

(() => {
  const SVG = "http://www.w3.org/2000/svg";
  const JOINTS = ["coxa", "femur", "tibia"];
  const AXES = ["x", "y", "z"];
  const DEG = 180 / Math.PI;
  const REACH = 270; // what a stretched leg measures on its drawing
  const ARROW = 55; // a third of the robot's weight
  const SECONDS = 0.2; // of motion, which the velocity ellipsoid shows

  function made(parent, tag, attributes = {}, text = "") {
    const svg = parent.namespaceURI === SVG || tag === "svg";
    const element = svg ? document.createElementNS(SVG, tag) : document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    if (text) element.textContent = text;
    parent.append(element);
    return element;
  }

  // A number as people write it: with a minus sign, and without one before zero.
  function written(value, digits = 1) {
    if (value === null || value === undefined) return "–";
    const text = value.toFixed(digits);
    return (Number(text) === 0 ? text.replace("-", "") : text).replace("-", "−");
  }

  const mm = (value) => written(value === null ? null : 1000 * value);
  const deg = (value) => written(value === null ? null : DEG * value);
  const triple = (values, how) => values.map(how).join(", ");

  // The shadow of an ellipsoid on a plane: half axes and angle of an ellipse.
  function shadow(lengths, directions, onto) {
    let [a, b, c] = [0, 0, 0];
    directions.forEach((direction, i) => {
      const length = Math.min(lengths[i] ?? 1e4, 1e4);
      const [u, v] = onto(direction).map((entry) => length * entry);
      [a, b, c] = [a + u * u, b + u * v, c + v * v];
    });
    const middle = (a + c) / 2;
    const spread = Math.hypot((a - c) / 2, b);
    return {
      rx: Math.sqrt(middle + spread),
      ry: Math.sqrt(Math.max(middle - spread, 0)),
      turn: (DEG * Math.atan2(2 * b, a - c)) / 2,
    };
  }

  // ------------------------------------------------------------------ a drawing of the leg

  // kind: how points of the hip frame come onto the paper.
  function drawing(parent, kind) {
    const figure = made(parent, "figure", { class: "bench-figure" });
    const svg = made(figure, "svg", { class: "bench-view", role: "img", "aria-label": kind.label });
    made(figure, "figcaption", {}, kind.caption);
    const layer = {};
    for (const name of ["region", "ellipse", "leg", "frames", "force"]) {
      layer[name] = made(svg, "g", { class: `bench-${name}` });
    }
    let shown = null;
    let scale = 1;

    const screen = (point) => {
      const [u, v] = kind.onto(point, shown.angles[0]);
      return [scale * u, -scale * v];
    };
    const forceScale = () => (3 * ARROW) / shown.weight;

    // The region is drawn anew only where it has changed.
    let drawn = "";
    function region(answer) {
      const curves = kind.region(answer);
      const path = (curve) => `M${curve.map(([u, v]) => `${(scale * u).toFixed(1)} ${(-scale * v).toFixed(1)}`).join("L")}Z`;
      const text = JSON.stringify(curves);
      if (text === drawn) return;
      drawn = text;
      layer.region.replaceChildren();
      for (const name of ["bench-reachable bench-edge", "bench-reachable"])
        made(layer.region, "path", { class: name, d: curves.map(path).join("") });
      const points = [[0, 0], ...curves.flat()];
      const bounds = [0, 1].map((k) => points.map((p) => p[k])).map((n) => [scale * Math.min(...n), scale * Math.max(...n)]);
      const box = [bounds[0][0] - 48, -bounds[1][1] - 34, bounds[0][1] + 34, -bounds[1][0] + 34];
      svg.setAttribute("viewBox", `${box[0]} ${box[1]} ${box[2] - box[0]} ${box[3] - box[1]}`);
      const [x, y] = [box[0] + 12, box[3] - 14];
      made(layer.region, "path", { class: "bench-scale", d: `M${x} ${y - 4}v4h${0.05 * scale}v-4` });
      made(layer.region, "text", { class: "bench-scale", x: x + 0.05 * scale + 6, y }, "50 mm");
    }

    function frame({ name, origin, axes }, number) {
      const [x, y] = screen(origin);
      const group = made(layer.frames, "g", { class: number ? "" : "bench-hip" });
      AXES.forEach((axis, k) => {
        const ahead = kind.onto(axes[k], shown.angles[0]).map((entry) => entry * (number ? 30 : 42));
        const end = [x + ahead[0], y - ahead[1]];
        const part = made(group, "g", { class: `bench-${axis}` });
        if (Math.hypot(...ahead) < 5) {
          // An axis that stands on the paper: a dot where it comes out of it, a cross where it goes in.
          const out = kind.towards(axes[k], shown.angles[0]) > 0;
          if (number) made(part, "circle", { cx: x, cy: y, r: 6 });
          if (number) made(part, "path", { d: out ? `M${x} ${y}h.01` : `M${x - 4} ${y - 4}l8 8m0 -8l-8 8`, class: out ? "bench-dot" : "" });
          return;
        }
        made(part, "path", { d: `M${x} ${y}L${end[0]} ${end[1]}` });
        if (number) made(part, "text", { x: x + 1.26 * ahead[0] - 3, y: y - 1.26 * ahead[1] + 4 }, axis);
      });
      const aside = number ? [8, -9] : [-14, 16];
      made(group, "text", { class: "bench-name", x: x + aside[0], y: y + aside[1] }, String(number));
      made(group, "title", {}, `Frame ${number}: ${name}`);
    }

    function show(answer, options) {
      shown = answer;
      scale = REACH / answer.lengths.reduce((sum, length) => sum + length);
      region(answer);
      for (const name of ["ellipse", "leg", "frames", "force"]) layer[name].replaceChildren();
      const points = [answer.frames[0], ...answer.frames.slice(2)].map((each) => screen(each.origin));
      const [x, y] = points[3];
      if (options.ellipsoid !== "none") {
        const force = options.ellipsoid === "force";
        const lengths = force ? answer.force_axes : answer.singular_values;
        const per = force ? forceScale() * answer.servo.torque : SECONDS * scale;
        const onto = (direction) => kind.onto(direction, answer.angles[0]);
        const { rx, ry, turn } = shadow(lengths, answer.directions, onto);
        made(layer.ellipse, "ellipse", { rx: per * rx, ry: per * ry, transform: `translate(${x} ${y}) rotate(${-turn})` });
        answer.directions.forEach((direction, i) => {
          const [u, v] = onto(direction).map((entry) => entry * per * Math.min(lengths[i] ?? 1e4, 1e4));
          made(layer.ellipse, "path", { d: `M${x - u} ${y + v}L${x + u} ${y - v}` });
        });
      }
      JOINTS.forEach((joint, i) => {
        made(layer.leg, "path", { class: "bench-link", d: `M${points[i]}L${points[i + 1]}` });
      });
      JOINTS.forEach((joint, i) => {
        const name = answer.share[i] > 1 ? "bench-overloaded" : answer.room[i] < -1e-9 ? "bench-beyond" : "";
        const circle = made(layer.leg, "circle", { class: `bench-joint ${name}`, cx: points[i][0], cy: points[i][1], r: 8 });
        made(circle, "title", {}, `${joint}: ${deg(answer.angles[i])}°, ${written(100 * answer.share[i], 0)} % of its servo`);
      });
      if (options.frames) answer.frames.forEach(frame);
      const [u, v] = kind.onto(answer.force, answer.angles[0]).map((entry) => entry * forceScale());
      const length = Math.hypot(u, v);
      const tip = [x + u, y - v];
      if (length > 2) {
        const [a, b] = [(12 * u) / length, (-12 * v) / length];
        made(layer.force, "path", { d: `M${x} ${y}L${tip}` });
        const size = written(Math.hypot(...answer.force));
        made(layer.force, "text", { x: tip[0] + (u < 0 ? -13 : 13), y: tip[1] + 4, "text-anchor": u < 0 ? "end" : "start" }, `${size} N`);
        made(layer.force, "path", { d: `M${tip}l${-a - b / 2.4} ${-b + a / 2.4}M${tip}l${-a + b / 2.4} ${-b - a / 2.4}` });
      }
    }

    return { show };
  }

  const out = (point, turn) => Math.cos(turn) * point[0] + Math.sin(turn) * point[1];
  const SIDE = {
    label: "The leg in its own plane",
    caption: "In the leg's own plane: outwards to the right, along the coxa axis up. Shaded: where the foot can go within the joint limits.",
    onto: (point, turn) => [out(point, turn), point[2]],
    towards: (axis, turn) => Math.sin(turn) * axis[0] - Math.cos(turn) * axis[1],
    region: (answer) => answer.workspace.side,
  };
  const ABOVE = {
    label: "The leg from above",
    caption: "From above: the neutral direction to the right. Shaded: where the foot can go at some height.",
    onto: (point) => [point[0], point[1]],
    towards: (axis) => axis[2],
    region: (answer) => [answer.workspace.above],
  };

  window.phasmidBench = { made, written, mm, deg, triple, sides: [SIDE, ABOVE], drawing };
})();
