"use strict";
// Plots of a study: every run as a point and as a line, main effects, and the best runs.

(() => {
  const { unpacked } = Phasmid.algebra;
  const { prepared, line, roundStep, text: short, colour: style } = Phasmid.plotting;
  const ROWS = 12; // of the table of best runs
  const PALETTE = ["#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377", "#bbbbbb"];
  const byId = (id) => document.getElementById(id);
  const scene = JSON.parse(byId("scene").textContent);

  const column = (one, isMetric) => ({ ...one, values: unpacked(one.data), isMetric });
  const columns = [
    ...scene.axes.map((one) => column(one, false)),
    ...scene.metrics.map((one) => column(one, true)),
  ];
  const named = (name) => columns.find((one) => one.name === name);
  const numbers = unpacked(scene.number);
  const endings = column(scene.endings, false);
  const best = new Set(scene.best);
  const metrics = columns.filter((one) => one.isMetric);
  const text = (one, row) => (one.texts ? one.texts[one.values[row]] : short(one.values[row], 4));
  const label = (name) => name.replaceAll("_", " ");
  let chosen = null;

  for (const one of columns) {
    one.low = one.texts ? -0.5 : Infinity;
    one.high = one.texts ? one.texts.length - 0.5 : -Infinity;
    if (!one.texts)
      for (const value of one.values) {
        one.low = Math.min(one.low, value);
        one.high = Math.max(one.high, value);
      }
    if (!(one.high > one.low)) [one.low, one.high] = [one.low - 0.5, one.high + 0.5];
  }
  const share = (one, row) => (one.values[row] - one.low) / (one.high - one.low);

  // ---------------------------------------------------------------- choices

  function fill(id, options, value) {
    for (const one of options) byId(id).append(new Option(label(one.name), one.name));
    byId(id).value = value;
    byId(id).addEventListener("change", paint);
  }
  const objectives = scene.objectives.length > 1 ? scene.objectives : [];
  fill("scatter-x", columns, objectives[0] || (metrics[1] ? metrics[0] : columns[0]).name);
  fill("scatter-y", columns, objectives[1] || (metrics[1] || metrics[0]).name);
  fill("scatter-colour", columns, columns[0].name);
  fill("effects-metric", metrics, metrics[0].name);
  fill("best-metric", metrics, scene.objectives[0] || metrics[0].name);
  for (const id of ["best-largest", "best-only"]) byId(id).addEventListener("change", paint);
  byId("best-only").parentElement.hidden = best.size === 0;

  // Viridis at six shares; between them the colour is blended.
  const SCALE = [[68, 1, 84], [65, 68, 135], [42, 120, 142], [34, 168, 132], [122, 209, 81], [253, 231, 37]];
  function colour(one, row, alpha = 1) {
    if (one.texts) return PALETTE[one.values[row] % PALETTE.length] + (alpha < 1 ? Math.round(255 * alpha).toString(16).padStart(2, "0") : "");
    const place = Math.min(Math.max(share(one, row), 0), 0.9999) * (SCALE.length - 1);
    const [k, part] = [Math.floor(place), place % 1];
    const mixed = SCALE[k].map((value, i) => Math.round(value + part * (SCALE[k + 1][i] - value)));
    return `rgb(${mixed.join(" ")} / ${alpha})`;
  }

  // ---------------------------------------------------------------- drawing

  function begun(canvas) {
    const drawn = prepared(canvas, "12px");
    Object.assign(drawn.context, { fillStyle: style("--faint"), strokeStyle: style("--line"), lineWidth: 1 });
    return drawn;
  }

  function steps(one) {
    if (one.texts) return one.texts.map((words, k) => [k, words]);
    const step = roundStep((one.high - one.low) / 6);
    const found = [];
    for (let k = Math.ceil(one.low / step); k * step <= one.high; k++) found.push([k * step, short(k * step, 4)]);
    return found;
  }

  const LEFT = 64;
  const BELOW = 44;
  const scatterPlace = (x, y, row, wide, high) => [
    LEFT + 8 + share(x, row) * (wide - LEFT - 24),
    high - BELOW - 8 - share(y, row) * (high - BELOW - 24),
  ];

  function paintScatter() {
    const [x, y, by] = ["x", "y", "colour"].map((name) => named(byId(`scatter-${name}`).value));
    const { context, wide, high } = begun(byId("scatter"));
    const X = (value) => LEFT + 8 + ((value - x.low) / (x.high - x.low)) * (wide - LEFT - 24);
    const Y = (value) => high - BELOW - 8 - ((value - y.low) / (y.high - y.low)) * (high - BELOW - 24);
    context.textAlign = "center";
    for (const [value, words] of steps(x)) {
      line(context, X(value), 8, X(value), high - BELOW);
      context.fillText(words, X(value), high - BELOW + 16);
    }
    context.fillText(label(x.name), LEFT + (wide - LEFT) / 2, high - 8);
    context.textAlign = "right";
    for (const [value, words] of steps(y)) {
      line(context, LEFT, Y(value), wide - 8, Y(value));
      context.fillText(words, LEFT - 6, Y(value) + 4);
    }
    context.save();
    context.translate(14, (high - BELOW) / 2);
    context.rotate(-Math.PI / 2);
    context.textAlign = "center";
    context.fillText(label(y.name), 0, 0);
    context.restore();
    const size = scene.count > 3000 ? 1.6 : scene.count > 400 ? 2.6 : 4;
    for (let row = 0; row < scene.count; row++) {
      const [px, py] = scatterPlace(x, y, row, wide, high);
      context.fillStyle = colour(by, row, 0.85);
      disc(context, px, py, size);
    }
    context.strokeStyle = style("--ink");
    context.lineWidth = 1.5;
    for (let row = 0; row < scene.count; row++)
      if (best.has(numbers[row])) ring(context, ...scatterPlace(x, y, row, wide, high), size + 2);
    if (chosen !== null) {
      context.strokeStyle = style("--bad");
      context.lineWidth = 3;
      ring(context, ...scatterPlace(x, y, chosen, wide, high), size + 5);
    }
    byId("scatter-note").replaceChildren(`${label(by.name)}: `, ...legend(by),
      `${best.size ? " Rings: best points." : ""} A click chooses a run.`);
  }

  function legend(by) {
    if (!by.texts) return [`${short(by.low, 4)} (dark) to ${short(by.high, 4)} (bright).`];
    return by.texts.flatMap((words, k) => {
      const chip = document.createElement("span");
      chip.className = "chip";
      chip.style.background = PALETTE[k % PALETTE.length];
      return [chip, ` ${words} `];
    });
  }

  function disc(context, x, y, size) {
    context.beginPath();
    context.arc(x, y, size, 0, 7);
    context.fill();
  }
  function ring(context, x, y, size) {
    context.beginPath();
    context.arc(x, y, size, 0, 7);
    context.stroke();
  }

  const parallelX = (k, wide) => 50 + (k * (wide - 100)) / Math.max(columns.length - 1, 1);
  const parallelY = (one, row, high) => high - 26 - share(one, row) * (high - 80);

  function paintParallel() {
    const by = named(byId("scatter-colour").value);
    const { context, wide, high } = begun(byId("parallel"));
    const path = (row) => {
      context.beginPath();
      columns.forEach((one, k) => context.lineTo(parallelX(k, wide), parallelY(one, row, high)));
      context.stroke();
    };
    const alpha = Math.min(0.8, Math.max(0.06, 60 / scene.count));
    for (let row = 0; row < scene.count; row++) {
      context.strokeStyle = colour(by, row, alpha);
      path(row);
    }
    if (chosen !== null) {
      context.strokeStyle = style("--bad");
      context.lineWidth = 3;
      path(chosen);
    }
    context.lineWidth = 1;
    context.textAlign = "center";
    columns.forEach((one, k) => {
      const x = parallelX(k, wide);
      context.strokeStyle = style("--faint");
      line(context, x, 52, x, high - 24);
      context.fillStyle = style("--ink");
      const name = label(one.name).split(".").slice(-2).join(" ").slice(0, 28);
      const half = context.measureText(name).width / 2;
      context.fillText(name, Math.min(Math.max(x, half), wide - half), k % 2 ? 26 : 12);
      context.fillStyle = style("--faint");
      if (one.texts) {
        const apart = (high - 80) / one.texts.length;
        if (apart < 14) return;
        context.textAlign = "left";
        context.strokeStyle = style("--paper");
        context.lineWidth = 4;
        one.texts.forEach((words, n) => {
          const place = [words.slice(0, 16), x + 7, high - 22 - (n + 0.5) * apart];
          context.strokeText(...place);
          context.fillText(...place);
        });
        context.lineWidth = 1;
        context.textAlign = "center";
      } else {
        context.fillText(short(one.high, 4), x, 44);
        context.fillText(short(one.low, 4), x, high - 8);
      }
    });
  }

  function paintEffects() {
    const metric = byId("effects-metric").value;
    const host = byId("effects");
    const spans = Object.values(scene.effects).flatMap((effect) => effect[metric].flatMap(([mean, half]) => [mean - (half || 0), mean + (half || 0)]));
    const range = { low: Math.min(...spans), high: Math.max(...spans) };
    if (!(range.high > range.low)) [range.low, range.high] = [range.low - 0.5, range.high + 0.5];
    for (const [axis, effect] of Object.entries(scene.effects)) {
      let canvas = host.querySelector(`[data-axis="${CSS.escape(axis)}"]`);
      if (!canvas) {
        const title = document.createElement("h3");
        title.textContent = label(axis);
        canvas = document.createElement("canvas");
        canvas.dataset.axis = axis;
        canvas.setAttribute("role", "img");
        canvas.setAttribute("aria-label", `Mean of the metric by ${label(axis)}`);
        const part = document.createElement("div");
        part.append(title, canvas);
        host.append(part);
      }
      const { context, wide, high } = begun(canvas);
      const count = effect.labels.length;
      const X = (k) => 60 + ((k + 0.5) * (wide - 70)) / count;
      const Y = (value) => high - 28 - ((value - range.low) / (range.high - range.low)) * (high - 44);
      context.textAlign = "right";
      for (const [value, words] of steps(range)) {
        line(context, 54, Y(value), wide, Y(value));
        context.fillText(words, 50, Y(value) + 4);
      }
      context.textAlign = "center";
      context.strokeStyle = style("--accent");
      context.lineWidth = 2;
      context.beginPath();
      effect[metric].forEach(([mean], k) => context.lineTo(X(k), Y(mean)));
      if (typeof effect.labels[0] === "number") context.stroke();
      effect[metric].forEach(([mean, half], k) => {
        context.fillStyle = style("--accent");
        disc(context, X(k), Y(mean), 4);
        if (half) line(context, X(k), Y(mean - half), X(k), Y(mean + half));
        context.fillStyle = style("--faint");
        const words = effect.labels[k];
        const every = Math.ceil((count * 46) / wide);
        if (k % every === 0) context.fillText(typeof words === "number" ? short(words) : words.slice(0, 10), X(k), high - 10);
      });
    }
  }

  // ---------------------------------------------------------------- best and chosen runs

  function paintBest() {
    const one = named(byId("best-metric").value);
    const sign = byId("best-largest").checked ? -1 : 1;
    const only = best.size > 0 && byId("best-only").checked;
    const shown = [...numbers.keys()].filter((row) => !only || best.has(numbers[row]));
    const rows = shown.sort((a, b) => sign * (one.values[a] - one.values[b])).slice(0, ROWS);
    const table = byId("best");
    table.replaceChildren();
    const head = table.createTHead().insertRow();
    for (const name of ["run", ...columns.map(({ name }) => label(name))]) {
      const cell = document.createElement("th");
      cell.textContent = name;
      head.append(cell);
    }
    const body = table.createTBody();
    for (const row of rows) {
      const cells = body.insertRow();
      for (const words of [String(numbers[row]), ...columns.map((each) => text(each, row))]) cells.insertCell().textContent = words;
      cells.addEventListener("click", () => choose(row));
    }
  }

  function choose(row) {
    chosen = row;
    const list = document.createElement("dl");
    list.className = "facts";
    const add = (name, words) => {
      const [term, fact] = [document.createElement("dt"), document.createElement("dd")];
      term.textContent = name;
      fact.textContent = words;
      list.append(term, fact);
    };
    add("run", `${numbers[row]}${best.has(numbers[row]) ? ", one of the best points" : ""}`);
    for (const one of columns) add(label(one.name), text(one, row));
    add("ended", text(endings, row));
    const command = document.createElement("pre");
    command.textContent = `${scene.command} --only ${numbers[row]}`;
    const kept = scene.recordings[numbers[row]];
    if (kept) command.textContent += `\nphasmid report recordings/${kept}`;
    const note = document.createElement("p");
    note.className = "note";
    note.textContent = "The command makes this run again, compares it with its row, and writes its report with a replay.";
    byId("chosen").replaceChildren(list, command, note);
    byId("chosen").hidden = false;
    paintScatter();
    paintParallel();
  }

  const nearest = (distance) => {
    let [found, least] = [null, Infinity];
    for (let row = 0; row < scene.count; row++) {
      const own = distance(row);
      if (own < least) [found, least] = [row, own];
    }
    return found;
  };

  byId("scatter").addEventListener("click", (event) => {
    const { clientWidth: wide, clientHeight: high } = event.target;
    const [x, y] = ["x", "y"].map((name) => named(byId(`scatter-${name}`).value));
    const row = nearest((k) => {
      const [px, py] = scatterPlace(x, y, k, wide, high);
      return Math.hypot(px - event.offsetX, py - event.offsetY);
    });
    if (row !== null) choose(row);
  });
  byId("parallel").addEventListener("click", (event) => {
    const { clientWidth: wide, clientHeight: high } = event.target;
    const k = Math.round(((event.offsetX - 50) * (columns.length - 1)) / (wide - 100));
    const one = columns[Math.min(Math.max(k, 0), columns.length - 1)];
    const row = nearest((each) => Math.abs(parallelY(one, each, high) - event.offsetY));
    if (row !== null) choose(row);
  });

  function paint() {
    paintScatter();
    paintParallel();
    paintEffects();
    paintBest();
  }
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", paint);
  new ResizeObserver(paint).observe(document.body);
})();
