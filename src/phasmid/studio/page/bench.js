"use strict";
// The leg bench: one leg by itself, with sliders and numbers. All of these come from Python.

(() => {
  const JOINTS = ["coxa", "femur", "tibia"];
  const AXES = ["x", "y", "z"];
  const DEG = 180 / Math.PI;
  const { made, written, mm, deg, triple, sides, drawing } = window.phasmidBench;

  function setText(element, text) {
    if (element.textContent !== text) element.textContent = text;
  }

  // A table whose cells are made once and updated.
  function table(parent, caption, head, rows) {
    const scrolls = made(parent, "div", { class: "bench-table", tabindex: 0, role: "region", "aria-label": caption });
    const grid = made(scrolls, "table");
    const top = made(made(grid, "thead"), "tr");
    for (const name of head) made(top, "th", { scope: "col" }, name);
    const body = made(grid, "tbody");
    const cells = rows.map((name) => {
      const row = made(body, "tr");
      made(row, "th", { scope: "row" }, name);
      return head.slice(1).map(() => made(row, "td"));
    });
    return { cells, update: (texts) => texts.forEach((row, i) => row.forEach((text, j) => setText(cells[i][j], text))) };
  }

  // A quantity: its heading, which equation it is, what it means, and what the paper misprints.
  function quantity(parent, name, equation, meaning, misprint) {
    const part = made(parent, "div", { class: "bench-quantity" });
    const heading = made(part, "h3", {}, `${name} `);
    made(heading, "span", { class: "bench-equation" }, equation);
    made(part, "p", { class: "bench-note" }, meaning);
    const body = made(part, "div");
    if (misprint) {
      const note = made(part, "p", { class: "bench-note bench-misprint" });
      made(note, "strong", {}, "Misprint ");
      note.append(misprint);
    }
    return body;
  }

  // ------------------------------------------------------------------ sliders

  function sliders(parent, legend, names, unit, changed) {
    const set = made(parent, "fieldset", { class: "bench-sliders" });
    made(set, "legend", {}, legend);
    let values = [0, 0, 0];
    const inputs = names.map((name, i) => {
      const id = `bench-${name.replace(" ", "-")}`;
      const input = Phasmid.range(id, (value) => {
        values = values.map((old, k) => (k === i ? value : old));
        changed(values);
      });
      const row = made(set, "div", { class: "field" });
      made(row, "label", { for: id }, name);
      row.append(...input.parts);
      return input;
    });
    return {
      bounds: (bounds) => inputs.forEach((input, i) => input.shape({ label: names[i], unit, ...bounds[i] })),
      show(given) {
        values = given;
        inputs.forEach((input, i) => input.held() || input.show(Number(given[i].toFixed(1))));
      },
    };
  }

  // ------------------------------------------------------------------ numbers

  function numbers(parent) {
    const grid = made(parent, "div", { class: "bench-quantities" });
    const q = ["θ₁ (coxa)", "θ₂ (femur)", "θ₃ (tibia)"];

    const chain = table(
      quantity(grid, "Frames", "Table 1, Eq 1",
        "Each frame stands in the one before it, whose α and a count: turned by α about its x, moved by a along it, then turned by θ about its own z and moved by d along that.",
        "Eq 1 has the angle α where the length a belongs, entry (1,4): a chain of it ends at the foot as printed below. Row 3 of Eq 2, the leg's pose in the body, is 0 0 1 z, not zeros."),
      "Denavit-Hartenberg parameters", ["frame", "α [°] before", "a [mm] before", "d [mm]", "θ [°]"],
      ["1 coxa", "2 femur", "3 tibia", "4 foot"]);

    const foot = table(
      quantity(grid, "The foot", "Eqs 1–2",
        "The chain multiplied out: r = Lc + Lf cos θ₂ + Lt cos(θ₂+θ₃) outwards, of which x = r cos θ₁ and y = r sin θ₁; z = Lf sin θ₂ + Lt sin(θ₂+θ₃)."),
      "Foot", ["foot", "x [mm]", "y [mm]", "z [mm]", "r [mm]"],
      ["where it is", "by Eq 1 as printed", "by Eqs 3–9 as printed"]);
    const reach = made(foot.cells[0][0].closest(".bench-quantity"), "p", { class: "bench-remark" });

    const angles = table(
      quantity(grid, "Angles of a foot", "Eqs 3–9",
        "Which angles put the foot where it is, the knee up: in closed form, by the law of cosines.",
        "tan⁻¹ for atan2 (Eqs 3, 5), L1 for the foot's distance from the coxa axis (Eqs 4, 5), roots that do not belong there (Eqs 6, 8), and a body height where the foot's height is meant (Eq 7). As printed, the angles put the foot elsewhere, or there are none."),
      "Angles and limits", ["joint", "angle [°]", "least [°]", "most [°]", "room [°]", "as printed [°]"], q);

    const jacobian = table(
      quantity(grid, "Jacobian", "J of Eq 11",
        "How fast the foot moves for each joint's speed: the slope of the foot over the angles. A column is the way of the foot when one joint turns."),
      "Jacobian", ["[mm/rad]", "coxa", "femur", "tibia"], AXES);
    const turned = made(jacobian.cells[0][0].closest(".bench-quantity"), "p", { class: "bench-remark" });

    const ellipsoids = table(
      quantity(grid, "Ellipsoids", "J = U S Vᵀ",
        "Joint speeds of one size move the foot on the velocity ellipsoid: far where its half axis s is long. Torques of one size hold forces on the other: most where s is short. Where an s is zero, the leg is singular: no joint moves the foot that way, and a force that way takes no torque. The last columns: how fast joints at the servo's speed without load, taken together, move the foot, and what torques of 1 N·m in all hold."),
      "Half axes", ["axis", "u = x, y, z", "s [mm/rad]", "servo's speed [mm/s]", "for 1 N·m [N]"], ["1", "2", "3"]);

    const statics = quantity(grid, "Torques", "Eqs 10–11, at rest",
      "What each servo holds: the links' own weight, G of Eq 10, less what the ground's force F does at the foot, Jᵀ F. The bar shows its share of what the servo gives at most.",
      "Eq 11 has + Jᵀ F; with F the force of the ground on the foot it is − Jᵀ F.");
    const torques = table(statics, "Torques", ["[N·m]", "− Jᵀ F", "G", "sum", "share of the servo", "as printed"], q);
    const bars = torques.cells.map((row) => {
      const bar = made(row[3], "svg", { class: "bench-share", viewBox: "0 0 90 10", "aria-hidden": "true" });
      made(bar, "rect", { width: 90, height: 10, rx: 2, class: "bench-share-room" });
      const filled = made(bar, "rect", { height: 10, rx: 2 });
      made(bar, "path", { d: "M60 0v10" });
      return { filled, text: made(row[3], "span") };
    });
    const most = made(statics.parentNode, "p", { class: "bench-remark" });

    const motion = quantity(made(parent, "div", { class: "bench-motion" }), "Motion", "Eq 10",
      "torque = M θ̈ + B [θ̇₁θ̇₂, θ̇₁θ̇₃, θ̇₂θ̇₃] + C [θ̇₁², θ̇₂², θ̇₃²] + G, all of which depend on the angles alone. Here for links with their masses at mid-length, as Eq 10 assumes; in kg·cm², and in brackets what the paper prints, where it differs.",
      "m11, m22, b11, b12, c21, c23 and c31 are misprinted, and Eq 10 counts θ₃ the other way than Eq 9: docs/errata.md lists each with its cost.");
    const matrices = ["M", "B", "C"].map((name) =>
      table(motion, `Matrix ${name}`, [name, "1", "2", "3"], ["1", "2", "3"]));

    function update(answer) {
      const { printed } = answer;
      angles.update(JOINTS.map((_, i) => [
        deg(answer.angles[i]), deg(answer.limits[i][0]), deg(answer.limits[i][1]), deg(answer.room[i]),
        printed.angles[i] === null ? "none" : deg(printed.angles[i]),
      ]));
      JOINTS.forEach((_, i) => angles.cells[i][3].classList.toggle("bench-bad", answer.room[i] < -1e-9));
      chain.update(answer.dh.map(([alpha, a, d, theta]) => [deg(alpha), mm(a), mm(d), deg(theta)]));
      const place = (p) => [...p.map(mm), mm(p[0] === null ? null : Math.hypot(p[0], p[1]))];
      foot.update([answer.foot, printed.foot, printed.reached].map(place));
      const { distance, nearest, farthest } = answer.reach;
      setText(reach, `From the femur axis it is ${mm(distance)} mm; the leg reaches ${mm(nearest)} to ${mm(farthest)} mm, joint limits aside: ${mm(farthest - distance)} mm to the stretched leg, ${mm(distance - nearest)} mm to the folded one.`);
      jacobian.update(answer.jacobian.map((row) => row.map(mm)));
      setText(turned, `Manipulability |det J| = ${written(1e6 * answer.manipulability, 0)} cm³; smallest over largest half axis ${written(answer.nearness, 2)}: 1 is the same in all directions, 0 singular.`);
      ellipsoids.update(answer.directions.map((direction, i) => [
        triple(direction, (n) => written(n, 2)), mm(answer.singular_values[i]), mm(answer.fastest[i]),
        answer.force_axes[i] === null ? "without bound" : written(answer.force_axes[i]),
      ]));
      JOINTS.forEach((_, i) => {
        const [row, share] = [torques.cells[i], answer.share[i]];
        ["load", "gravity", "sum"].forEach((name, k) => setText(row[k], written(answer.torque[name][i], 3)));
        setText(bars[i].text, `${written(100 * share, 0)} %`);
        bars[i].filled.setAttribute("width", Math.min(60 * share, 90).toFixed(1));
        bars[i].filled.setAttribute("class", share > 1 ? "bench-share-over" : "bench-share-full");
        row[3].classList.toggle("bench-bad", share > 1);
        setText(row[4], written(printed.torque[i], 3));
      });
      const { name, torque, speed } = answer.servo;
      const bears = answer.most === null ? "" : ` Along this force the leg bears up to ${written(answer.most)} N.`;
      setText(most, `The servo of every joint is the ${name}: ${written(torque, 2)} N·m at most, ${written(speed, 2)} rad/s without load.${bears}`);
      ["M", "B", "C"].forEach((matrix, m) => {
        const [right, wrong] = [printed.matrices_right[matrix], printed.matrices[matrix]];
        matrices[m].update(right.map((row, i) => row.map((entry, j) => {
          const [a, b] = [entry, wrong[i][j]].map((n) => written(1e4 * n, 2));
          return a === b ? a : `${a} (${b})`;
        })));
      });
    }
    return { update };
  }

  // ------------------------------------------------------------------ the whole pane

  function choice(parent, name, options, changed) {
    const id = `bench-${name.toLowerCase()}`;
    const pair = made(parent, "span", { class: "bench-choice" });
    made(pair, "label", { for: id }, name);
    const select = made(pair, "select", { id });
    for (const [value, text] of options) made(select, "option", { value }, text);
    select.addEventListener("change", () => changed(select.value));
    return select;
  }

  const mounted = new WeakMap();

  // Puts the bench into a section. request(message) returns a promise of the reply; legs are names.
  // A second time, as when the ground is another, it only requests again unless the legs are others.
  function mount(section, { request, legs }) {
    const names = legs.map((name, i) => `${i + 1} ${name.replaceAll("_", " ")}`);
    const before = mounted.get(section);
    if (before && before.names.join() === names.join()) return before.again();
    mounted.set(section, { names, again: () => wanted({}) });
    section.replaceChildren();
    section.classList.add("bench");
    const waits = made(section, "p", { class: "bench-note", role: "status" }, "Loading the leg …");
    made(section, "p", { class: "bench-note" }, "One leg of this robot by itself, at rest: the paper's Eqs 1–11. The walking robot is not moved by it.");
    const bar = made(section, "div", { class: "bench-bar" });
    const options = { ellipsoid: "velocity", frames: true };
    let message = { do: "bench", leg: 1, force: [0, 0, 0] };
    let answer = null;

    const picker = choice(bar, "Leg", names.map((name, i) => [i + 1, name]), (value) => wanted({ leg: Number(value), foot: undefined, angles: undefined }));
    choice(bar, "Ellipsoid", [["velocity", "velocity"], ["force", "force"], ["none", "none"]], (value) => {
      options.ellipsoid = value;
      show();
    });
    const frames = made(bar, "label", {});
    const box = made(frames, "input", { type: "checkbox" });
    box.checked = true;
    frames.append("Frames");
    box.addEventListener("change", () => {
      options.frames = box.checked;
      show();
    });
    const button = (text, change) =>
      made(bar, "button", { type: "button" }, text).addEventListener("click", () => answer && wanted(change(answer)));
    button("Neutral foot", () => ({ foot: undefined, angles: undefined }));
    button("No force", () => ({ force: [0, 0, 0] }));
    button("A third of the weight", (leg) => ({ force: [0, 0, leg.weight / 3] }));

    const parts = made(section, "div", { class: "bench-parts", hidden: "" });
    const views = sides.map((kind) => drawing(parts, kind));
    const panel = made(parts, "div", { class: "bench-panel" });
    const turn = sliders(panel, "Angles", ["Coxa θ₁", "Femur θ₂", "Tibia θ₃"], "°", (v) => wanted({ angles: v.map((n) => n / DEG) }));
    const foot = sliders(panel, "Foot in the hip frame", ["Foot x", "Foot y", "Foot z"], "mm", (v) => wanted({ foot: v.map((n) => n / 1000) }));
    const force = sliders(panel, "Force of the ground on the foot", ["Force x", "Force y", "Force z"], "N", (v) => wanted({ force: v }));
    const remarks = made(panel, "ul", { class: "bench-remarks", role: "status", "aria-label": "What is not possible so" });
    made(panel, "p", { class: "bench-note" }, "Axes: x red, y green, z blue; a dot comes out of the page, a cross goes into it. The velocity ellipsoid is where the foot gets in 0.2 s at 1 rad/s in all joints together; the force ellipsoid what torques of the servo's size hold, to the scale of the arrow.");
    const rest = made(section, "div", { hidden: "" });
    const figures = numbers(rest);

    // One question is on its way at a time; of those that come meanwhile only the last counts.
    let next = null;
    let busy = false;
    function wanted(change) {
      if ("foot" in change) change = { angles: undefined, ...change };
      if ("angles" in change) change = { foot: undefined, ...change };
      message = { ...message, ...change };
      next = message;
      if (!busy) send();
    }
    async function send() {
      busy = true;
      while (next) {
        const question = Object.fromEntries(Object.entries(next).filter(([, value]) => value !== undefined));
        next = null;
        try {
          const reply = await request(question);
          if (reply.status === 200) take(reply.answer);
          else refused([reply.text, reply.hint && `Try ${reply.hint}`].filter(Boolean).join(" "));
        } catch (error) {
          refused(String(error.message || error));
        }
      }
      busy = false;
    }

    function refused(text) {
      if (answer) showRemarks([text]);
      else waits.textContent = text;
    }

    function showRemarks(sentences) {
      const text = sentences.join("\n");
      if (remarks.dataset.text === text) return;
      remarks.dataset.text = text;
      remarks.replaceChildren();
      for (const sentence of sentences) made(remarks, "li", {}, sentence);
    }

    function take(newAnswer) {
      const first = answer === null;
      answer = newAnswer;
      parts.hidden = rest.hidden = false;
      waits.hidden = true;
      const size = Math.ceil(1000 * newAnswer.lengths.reduce((sum, length) => sum + length) / 10) * 10;
      const most = Math.ceil(newAnswer.weight);
      turn.bounds(newAnswer.limits.map(([low, high]) => ({ least: Math.floor(DEG * low) - 10, most: Math.ceil(DEG * high) + 10, step: 0.5 })));
      foot.bounds(AXES.map(() => ({ least: -size, most: size, step: 0.5 })));
      force.bounds(AXES.map(() => ({ least: -most, most, step: 0.1 })));
      show();
      if (first) wanted({ force: [0, 0, newAnswer.weight / 3] });
    }

    function show() {
      if (!answer) return;
      showRemarks(answer.remarks);
      turn.show(answer.angles.map((n) => DEG * n));
      // A foot out of reach stays the goal, so that the way back equals the way there.
      foot.show((message.foot || answer.foot).map((n) => 1000 * n));
      force.show(answer.force);
      picker.value = answer.leg;
      for (const view of views) view.show(answer, options);
      figures.update(answer);
    }

    wanted({});
  }

  window.phasmidBench.mount = mount;
})();
