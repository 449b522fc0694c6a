"use strict";
// Curves of ten seconds, and which feet stood: the newest, or of the last two minutes those that
// are chosen.

(() => {
  const SPAN = 10; // seconds that are shown
  const KEPT = 120; // seconds that can be scrolled back to
  const ROWS = 12288;
  const JOINTS = ["coxa", "femur", "tibia"];
  const LEFT = 44; // pixels for the numbers beside a plot
  const RIGHT = 4;
  const BOTTOM = 16;
  const { made } = Phasmid;
  const { prepared, line, roundStep, text, colour } = Phasmid.plotting;

  Phasmid.plots = (host, frames) => {
    const byId = (id) => document.getElementById(id);
    const reading = made("div", { className: "reading", hidden: true });
    let scene = null;
    let legs = 0;
    let at = {}; // places of numbers in a row
    let width = 0;
    let ring = new Float32Array(0); // frames as they came
    let head = 0; // rows ever written
    let colours = {};
    let joint = "worst";
    let end = null; // time at the right edge; null: the newest
    let pointed = null; // the plot under the pointer, and where the pointer is in it
    const plots = [];

    // ---------------------------------------------------------------- what is kept

    function begin(newScene) {
      const same = scene && scene.number === newScene.number;
      scene = newScene;
      if (same) return;
      legs = scene.legs.length;
      at = frames.at;
      width = scene.layout.reduce((sum, [, count]) => sum + count, 0);
      ring = new Float32Array(ROWS * width);
      head = 0;
      end = null;
    }

    function forget() {
      scene = null;
    }

    function take() {
      const frame = frames.latest;
      if (!scene || !frame) return;
      const time = frame[at.time];
      if (head > 0) {
        const last = timeOf(head - 1);
        if (time < last) [head, end] = [0, null];
        else if (time - last < (1.05 * KEPT) / ROWS) return;
      }
      ring.set(frame, row(head));
      head += 1;
    }

    const row = (index) => (index % ROWS) * width;
    const timeOf = (index) => ring[row(index) + at.time];
    const oldest = () => Math.max(head - ROWS, 0);

    // The first row that is not before a time.
    function indexOf(time) {
      let [low, high] = [oldest(), head];
      while (low < high) {
        const middle = (low + high) >> 1;
        if (timeOf(middle) < time) low = middle + 1;
        else high = middle;
      }
      return low;
    }

    // ---------------------------------------------------------------- what is seen of it

    const limit = (leg, which) => Math.abs(scene.torque_limit?.[leg]?.[which] ?? NaN);

    function torque(k, leg) {
      const i = k + at.joint_torque + 3 * leg;
      if (joint !== "worst") return ring[i + JOINTS.indexOf(joint)];
      let most = 0;
      for (let j = 0; j < 3; j++) {
        const own = limit(leg, j);
        const share = own > 0 ? (100 * Math.abs(ring[i + j])) / own : Math.abs(ring[i + j]);
        if (share > most) most = share;
      }
      return most;
    }

    const limited = () => Number.isFinite(limit(0, 0));
    const eachLeg = (read) => () => scene.legs.map((colour, leg) => ({ colour, label: String(leg + 1), read: (k) => read(k, leg) }));
    const scaled = (name, scale) => (k) => scale * ring[k + at[name]];
    const speed = (name) => (k) => 1000 * Math.hypot(ring[k + at[name]], ring[k + at[name] + 1]);

    // A legend names what the colours of the legs do not show: kinds of lines, by the style sheet.
    const PLOTS = [
      { id: "normal", title: "Normal forces", unit: () => "N", curves: eachLeg((k, leg) => ring[k + at.foot_force + 3 * leg + 2]) },
      {
        id: "torque", title: "Torques", legend: { limit: "servo limit" },
        unit: () => (joint === "worst" && limited() ? "%" : "N·m"),
        curves: eachLeg(torque),
        limits: () => {
          if (!limited()) return [];
          if (joint === "worst") return [100];
          const most = limit(0, JOINTS.indexOf(joint));
          return [most, -most];
        },
      },
      { id: "gait", title: "Gait", legend: { thin: "planned stance", thick: "contact" } },
      { id: "tilt", title: "Body tilt", unit: () => "°", curves: () => [{ colour: colours.ink, read: scaled("tilt", 180 / Math.PI) }] },
      {
        id: "margin", title: "Support margin", legend: { limit: "tips" }, unit: () => "mm", limits: () => [0],
        curves: () => [{ colour: colours.ink, read: scaled("margin", 1000) }],
      },
      {
        id: "speed", title: "Speed", legend: { wide: "commanded", line: "measured" }, unit: () => "mm/s",
        curves: () => [
          { colour: colours.line, label: "commanded", read: speed("velocity_command"), wide: 3 },
          { colour: colours.ink, label: "measured", read: speed("velocity") },
        ],
      },
    ];

    function build() {
      for (const plot of PLOTS) {
        const caption = made("figcaption", {}, made("span", { textContent: plot.title }));
        const canvas = made("canvas", { role: "img", ariaLabel: `${plot.title} over ${SPAN} seconds` });
        if (plot.id === "torque") caption.append(chooser());
        for (const [kind, words] of Object.entries(plot.legend || {}))
          caption.append(made("span", { className: `key key-${kind}`, textContent: words }));
        const unit = made("span", { className: "unit" });
        caption.append(unit);
        host.append(made("figure", {}, caption, canvas));
        const own = { ...plot, canvas, unitLabel: unit, top: 0, bottom: 0 };
        plots.push(own);
        listen(own);
      }
      document.body.append(reading);
      readColours();
    }

    // The pointer reads values, and drags the time.
    function listen(plot) {
      let grip = null;
      plot.canvas.addEventListener("pointerdown", (event) => {
        if (head) grip = { x: event.clientX, right: right() };
        plot.canvas.setPointerCapture(event.pointerId);
      });
      plot.canvas.addEventListener("pointermove", (event) => {
        if (grip) show(grip.right - ((event.clientX - grip.x) / (plot.canvas.clientWidth - LEFT - RIGHT)) * SPAN);
        pointed = { plot, x: event.offsetX, place: [event.clientX, event.clientY] };
        repaint();
      });
      for (const name of ["pointerup", "pointercancel"]) plot.canvas.addEventListener(name, () => (grip = null));
      plot.canvas.addEventListener("pointerleave", () => {
        pointed = null;
        repaint();
      });
    }

    function chooser() {
      const select = made("select", { ariaLabel: "Joints in the plot of torques" });
      for (const [value, words] of [["worst", "worst joint"], ...JOINTS.map((name) => [name, name])])
        select.append(new Option(words, value));
      select.addEventListener("change", () => {
        joint = select.value;
        paint();
      });
      return select;
    }

    function readColours() {
      colours = { ink: colour("--ink"), faint: colour("--faint"), grid: colour("--line"), line: colour("--accent-faint"), bad: colour("--bad") };
    }

    // ---------------------------------------------------------------- the time that is shown

    const [hold, since] = [byId("hold"), byId("since")];
    const right = () => end ?? timeOf(head - 1);
    hold.addEventListener("click", () => show(end === null ? right() : null));
    since.addEventListener("input", () => show(Number(since.value)));

    // The plots end at a time; null, or the newest: they go on.
    function show(time) {
      if (!head) return;
      const [first, last] = [timeOf(oldest()), timeOf(head - 1)];
      end = time === null ? null : Math.min(Math.max(time, Math.min(first + SPAN, last)), last);
      repaint();
    }

    function showTime() {
      const [first, last] = [timeOf(oldest()), timeOf(head - 1)];
      since.min = String(Math.min(first + SPAN, last));
      since.max = String(last);
      since.value = String(right());
      since.setAttribute("aria-valuetext", end === null ? "now" : `${end.toFixed(1)} s`);
      since.disabled = last - first <= SPAN;
      hold.textContent = end === null ? "Hold plots" : "Go on";
      hold.setAttribute("aria-pressed", String(end !== null));
    }

    // ---------------------------------------------------------------- painting

    let due = false;
    function repaint() {
      if (due) return;
      due = true;
      requestAnimationFrame(() => {
        due = false;
        paint();
      });
    }

    function paint() {
      reading.hidden = true;
      if (!scene || !head || host.hidden || !host.clientWidth) return;
      showTime();
      const until = right();
      const rows = [indexOf(until - SPAN), Math.min(indexOf(until) + 1, head)];
      const index = read(until);
      for (const plot of plots) {
        const { context, wide, high } = prepared(plot.canvas, "11px");
        const X = (time) => LEFT + ((time - until + SPAN) / SPAN) * (wide - LEFT - RIGHT);
        seconds(context, X, until, high);
        if (plot.curves) curves(plot, context, X, rows, wide, high);
        else gait(context, X, rows, until, high);
        if (index === null) continue;
        context.strokeStyle = colours.faint;
        line(context, X(timeOf(index)), 4, X(timeOf(index)), high - BOTTOM);
      }
    }

    // The row under the pointer, whose values are shown beside it; null where there is none.
    function read(until) {
      if (!pointed) return null;
      const { plot, x, place } = pointed;
      const time = until - SPAN + ((x - LEFT) / (plot.canvas.clientWidth - LEFT - RIGHT)) * SPAN;
      const index = Math.min(indexOf(time), head - 1);
      if (x < LEFT || time < timeOf(oldest()) || time > timeOf(head - 1) + 0.1) return null;
      const lines = [made("p", { className: "time", textContent: `${timeOf(index).toFixed(2)} s` })];
      if (plot.curves)
        for (const { colour, label = "", read: value } of plot.curves()) {
          const chip = made("span", { className: "chip" });
          chip.style.background = colour;
          lines.push(made("p", {}, chip, `${label} `, made("b", { textContent: `${text(value(row(index)))} ${plot.unit()}` })));
        }
      else
        for (const [words, from] of [["planned stance", at.stance], ["contact", at.contact]]) {
          const down = scene.legs.map((_, leg) => leg + 1).filter((leg) => ring[row(index) + from + leg - 1] > 0.5);
          lines.push(made("p", {}, `${words}: `, made("b", { textContent: down.join(" ") || "none" })));
        }
      reading.replaceChildren(...lines);
      reading.hidden = false;
      // Within the window, beside the pointer.
      const left = place[0] + 14 + reading.offsetWidth > innerWidth ? place[0] - 14 - reading.offsetWidth : place[0] + 14;
      reading.style.left = `${left}px`;
      reading.style.top = `${Math.max(Math.min(place[1] - 20, innerHeight - reading.offsetHeight - 6), 6)}px`;
      return index;
    }

    function seconds(context, X, until, high) {
      context.strokeStyle = colours.grid;
      context.fillStyle = colours.faint;
      context.lineWidth = 1;
      context.textBaseline = "bottom";
      for (let ago = SPAN; ago >= 0; ago -= 2) {
        const x = Math.round(X(until - ago)) + 0.5;
        line(context, x, 4, x, high - BOTTOM);
        context.textAlign = ago ? "center" : "right";
        context.fillText(ago ? `−${ago} s` : end === null ? "now" : `${until.toFixed(1)} s`, x, high);
      }
    }

    function scale(plot, drawn, limits, [first, last]) {
      let [low, high] = [0, 0];
      for (const { read: value } of drawn)
        for (let k = first; k < last; k++) {
          const own = value(row(k));
          if (own < low) low = own;
          if (own > high) high = own;
        }
      for (const value of limits) {
        if (1.05 * value < low) low = 1.05 * value;
        if (1.05 * value > high) high = 1.05 * value;
      }
      const step = roundStep(Math.max(high - low, 1e-3) / 4);
      plot.bottom = Math.floor(low / step + 1e-9) * step;
      plot.top = Math.max(Math.ceil(high / step - 1e-9), plot.bottom / step + 1) * step;
      return step;
    }

    function curves(plot, context, X, rows, wide, high) {
      const [first, last] = rows;
      const drawn = plot.curves();
      const limits = plot.limits ? plot.limits() : [];
      const step = scale(plot, drawn, limits, rows);
      const Y = (value) => high - BOTTOM - ((value - plot.bottom) / (plot.top - plot.bottom)) * (high - BOTTOM - 6);
      const unit = plot.unit();
      if (plot.unitLabel.textContent !== unit) plot.unitLabel.textContent = unit;
      context.textAlign = "right";
      context.textBaseline = "middle";
      const lines = Math.round((plot.top - plot.bottom) / step);
      const apart = Math.max(1, Math.ceil((lines * 14) / (high - BOTTOM)));
      for (let k = 0; k <= lines; k += apart) {
        const y = Math.round(Y(plot.bottom + k * step)) + 0.5;
        line(context, LEFT, y, wide - RIGHT, y);
        context.fillText(text(plot.bottom + k * step), LEFT - 5, y);
      }
      context.strokeStyle = colours.bad;
      context.setLineDash([5, 4]);
      for (const value of limits) line(context, LEFT, Y(value), wide - RIGHT, Y(value));
      context.setLineDash([]);
      const stride = Math.max(1, Math.floor((last - first) / (wide - LEFT)));
      context.lineJoin = "round";
      for (const { colour, read: value, wide: thick = 1.4 } of drawn) {
        context.strokeStyle = colour;
        context.lineWidth = thick;
        context.beginPath();
        let down = false;
        for (let k = first; k < last; k += stride) {
          const own = value(row(k));
          if (!Number.isFinite(own)) {
            down = false;
            continue;
          }
          const x = Math.max(X(timeOf(k)), LEFT);
          if (down) context.lineTo(x, Y(own));
          else context.moveTo(x, Y(own));
          down = true;
        }
        context.stroke();
      }
      context.lineWidth = 1;
    }

    function gait(context, X, [first, last], until, high) {
      const room = (high - BOTTOM - 6) / legs;
      context.textAlign = "right";
      context.textBaseline = "middle";
      for (let leg = 0; leg < legs; leg++) {
        const y = 4 + leg * room;
        context.fillStyle = colours.faint;
        context.fillText(String(leg + 1), LEFT - 6, y + room / 2);
        context.fillStyle = scene.legs[leg];
        bars(at.contact + leg, y + 0.34 * room, 0.56 * room);
        context.fillStyle = colours.faint;
        bars(at.stance + leg, y + 0.1 * room, Math.max(0.16 * room, 1.5));
      }

      function bars(which, y, thick) {
        let from = NaN;
        for (let k = first; k <= last; k++) {
          const stands = k < last && ring[row(k) + which] > 0.5;
          if (stands && Number.isNaN(from)) from = timeOf(k);
          if (stands || Number.isNaN(from)) continue;
          const x = Math.max(X(from), LEFT);
          context.fillRect(x, y, Math.max(X(k < last ? timeOf(k) : until) - x, 1), thick);
          from = NaN;
        }
      }
    }

    build();
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
      readColours();
      paint();
    });
    new ResizeObserver(repaint).observe(host);
    return { begin, forget, take, paint };
  };
})();
