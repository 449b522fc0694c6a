"use strict";
// Curves of the last ten seconds, and which feet stood.

(() => {
  const SPAN = 10; // seconds
  const ROWS = 1024;
  const JOINTS = ["coxa", "femur", "tibia"];
  const LEFT = 44; // pixels for the numbers beside a plot
  const BOTTOM = 16;

  // A number of steps that people count in, not below a value.
  function round(value) {
    const ten = 10 ** Math.floor(Math.log10(Math.max(value, 1e-9)));
    return [1, 2, 5, 10].map((k) => k * ten).find((k) => k >= value - 1e-12);
  }

  function text(value) {
    return String(Number(value.toPrecision(3))).replace("-", "−");
  }

  Phasmid.plots = (host, frames) => {
    let scene = null;
    let legs = 0;
    let names = [];
    let columns = {};
    let width = 0;
    let ring = new Float32Array(0);
    let head = 0; // rows ever written
    let colours = {};
    let joint = "worst";
    const plots = [];

    // ---------------------------------------------------------------- what is kept

    function begin(told) {
      const same = scene && scene.number === told.number;
      scene = told;
      if (same) return;
      legs = scene.legs.length;
      names = scene.names;
      columns = { time: 0, normal: 1, torque: 1 + legs, tilt: 1 + 4 * legs, margin: 2 + 4 * legs, asked: 3 + 4 * legs, got: 4 + 4 * legs, planned: 5 + 4 * legs, seen: 5 + 5 * legs };
      width = 5 + 6 * legs;
      ring = new Float32Array(ROWS * width);
      head = 0;
    }

    function forget() {
      scene = null;
    }

    function take() {
      const row = frames.latest;
      const at = frames.at;
      if (!scene || !row) return;
      const time = row[at.time];
      if (head > 0) {
        const last = ring[((head - 1) % ROWS) * width];
        if (time < last) head = 0;
        else if (time - last < (1.05 * SPAN) / ROWS) return;
      }
      const k = (head % ROWS) * width;
      ring[k] = time;
      for (let leg = 0; leg < legs; leg++) {
        ring[k + columns.normal + leg] = row[at.foot_force + 3 * leg + 2];
        ring[k + columns.planned + leg] = row[at.stance + leg];
        ring[k + columns.seen + leg] = row[at.contact + leg];
      }
      for (let i = 0; i < 3 * legs; i++) ring[k + columns.torque + i] = row[at.joint_torque + i];
      ring[k + columns.tilt] = (row[at.tilt] * 180) / Math.PI;
      ring[k + columns.margin] = 1000 * row[at.margin];
      ring[k + columns.asked] = 1000 * Math.hypot(row[at.velocity_asked], row[at.velocity_asked + 1]);
      ring[k + columns.got] = 1000 * Math.hypot(row[at.velocity], row[at.velocity + 1]);
      head += 1;
    }

    // ---------------------------------------------------------------- what is seen of it

    const limit = (leg, which) => Math.abs(scene.torque_limit?.[leg]?.[which] ?? NaN);

    function torque(k, leg) {
      const i = k + columns.torque + 3 * leg;
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
    const eachLeg = (read) => () => scene.legs.map((colour, leg) => ({ colour, read: (k) => read(k, leg) }));
    const column = (name) => (k) => ring[k + columns[name]];

    const PLOTS = [
      { id: "normal", title: "Normal forces", unit: () => "N", curves: eachLeg((k, leg) => ring[k + columns.normal + leg]) },
      {
        id: "torque", title: "Torques",
        unit: () => (joint === "worst" && limited() ? "% of limit" : "N·m"),
        curves: eachLeg(torque),
        limits: () => {
          if (!limited()) return [];
          if (joint === "worst") return [100];
          const most = limit(0, JOINTS.indexOf(joint));
          return [most, -most];
        },
      },
      { id: "gait", title: "Gait: planned thin, seen thick" },
      { id: "tilt", title: "Body tilt", unit: () => "°", curves: () => [{ colour: colours.ink, read: column("tilt") }] },
      {
        id: "margin", title: "Support margin", unit: () => "mm", limits: () => [0],
        curves: () => [{ colour: colours.ink, read: column("margin") }],
      },
      {
        id: "speed", title: "Speed: asked faint, got dark", unit: () => "mm/s",
        curves: () => [{ colour: colours.line, read: column("asked"), wide: 3 }, { colour: colours.ink, read: column("got") }],
      },
    ];

    function build() {
      for (const plot of PLOTS) {
        const figure = document.createElement("figure");
        const caption = document.createElement("figcaption");
        const canvas = document.createElement("canvas");
        const title = document.createElement("span");
        title.textContent = plot.title;
        caption.append(title);
        if (plot.id === "torque") caption.append(chooser());
        const unit = document.createElement("span");
        unit.className = "unit";
        caption.append(unit);
        canvas.setAttribute("role", "img");
        canvas.setAttribute("aria-label", `${plot.title} over the last ${SPAN} seconds`);
        figure.append(caption, canvas);
        host.append(figure);
        plots.push({ ...plot, canvas, context: canvas.getContext("2d"), unitTold: unit, top: 0, bottom: 0 });
      }
      readColours();
    }

    function chooser() {
      const select = document.createElement("select");
      select.setAttribute("aria-label", "Joints in the plot of torques");
      for (const [value, words] of [["worst", "worst of each leg"], ...JOINTS.map((name) => [name, name])])
        select.append(new Option(words, value));
      select.addEventListener("change", () => {
        joint = select.value;
        const plot = plots.find(({ id }) => id === "torque");
        plot.top = plot.bottom = 0;
        paint();
      });
      return select;
    }

    function readColours() {
      const style = getComputedStyle(document.documentElement);
      const read = (name) => style.getPropertyValue(name).trim();
      colours = { ink: read("--ink"), faint: read("--faint"), grid: read("--line"), line: read("--accent-faint"), bad: read("--bad") };
    }

    const row = (index) => (index % ROWS) * width;

    function paint() {
      if (!scene || !head || host.hidden || !host.clientWidth) return;
      const end = ring[row(head - 1)];
      let first = Math.max(head - ROWS, 0);
      while (first < head - 1 && ring[row(first)] < end - SPAN) first += 1;
      for (const plot of plots) {
        const { canvas, context } = plot;
        const ratio = Math.min(window.devicePixelRatio || 1, 2);
        const [wide, high] = [canvas.clientWidth, canvas.clientHeight];
        if (canvas.width !== Math.round(wide * ratio) || canvas.height !== Math.round(high * ratio))
          [canvas.width, canvas.height] = [Math.round(wide * ratio), Math.round(high * ratio)];
        context.setTransform(ratio, 0, 0, ratio, 0, 0);
        context.clearRect(0, 0, wide, high);
        context.font = "11px system-ui, sans-serif";
        const X = (time) => LEFT + ((time - end + SPAN) / SPAN) * (wide - LEFT - 4);
        seconds(context, X, end, high);
        if (plot.curves) curves(plot, X, first, wide, high);
        else gait(context, X, first, end, high);
      }
    }

    function seconds(context, X, end, high) {
      context.strokeStyle = colours.grid;
      context.fillStyle = colours.faint;
      context.lineWidth = 1;
      context.textBaseline = "bottom";
      for (let ago = SPAN; ago >= 0; ago -= 2) {
        const x = Math.round(X(end - ago)) + 0.5;
        context.beginPath();
        context.moveTo(x, 4);
        context.lineTo(x, high - BOTTOM);
        context.stroke();
        context.textAlign = ago ? "center" : "right";
        context.fillText(ago ? `−${ago} s` : "now", x, high);
      }
    }

    function scale(plot, drawn, limits, first) {
      let [low, high] = [0, 0];
      for (const { read } of drawn)
        for (let k = first; k < head; k++) {
          const value = read(row(k));
          if (value < low) low = value;
          if (value > high) high = value;
        }
      for (const value of limits) {
        if (1.05 * value < low) low = 1.05 * value;
        if (1.05 * value > high) high = 1.05 * value;
      }
      const step = round(Math.max(high - low, 1e-3) / 4);
      plot.bottom = Math.floor(low / step + 1e-9) * step;
      plot.top = Math.max(Math.ceil(high / step - 1e-9), plot.bottom / step + 1) * step;
      return step;
    }

    function curves(plot, X, first, wide, high) {
      const { context } = plot;
      const drawn = plot.curves();
      const limits = plot.limits ? plot.limits() : [];
      const step = scale(plot, drawn, limits, first);
      const Y = (value) => high - BOTTOM - ((value - plot.bottom) / (plot.top - plot.bottom)) * (high - BOTTOM - 6);
      const unit = plot.unit();
      if (plot.unitTold.textContent !== unit) plot.unitTold.textContent = unit;
      context.textAlign = "right";
      context.textBaseline = "middle";
      const lines = Math.round((plot.top - plot.bottom) / step);
      const apart = Math.max(1, Math.ceil((lines * 14) / (high - BOTTOM)));
      for (let k = 0; k <= lines; k += apart) {
        const y = Math.round(Y(plot.bottom + k * step)) + 0.5;
        context.beginPath();
        context.moveTo(LEFT, y);
        context.lineTo(wide - 4, y);
        context.stroke();
        context.fillText(text(plot.bottom + k * step), LEFT - 5, y);
      }
      context.strokeStyle = colours.bad;
      context.setLineDash([5, 4]);
      for (const value of limits) {
        context.beginPath();
        context.moveTo(LEFT, Y(value));
        context.lineTo(wide - 4, Y(value));
        context.stroke();
      }
      context.setLineDash([]);
      const stride = Math.max(1, Math.floor((head - first) / (wide - LEFT)));
      context.lineJoin = "round";
      for (const { colour, read, wide: thick = 1.4 } of drawn) {
        context.strokeStyle = colour;
        context.lineWidth = thick;
        context.beginPath();
        let down = false;
        for (let k = first; k < head; k += stride) {
          const value = read(row(k));
          if (!Number.isFinite(value)) {
            down = false;
            continue;
          }
          const x = Math.max(X(ring[row(k)]), LEFT);
          if (down) context.lineTo(x, Y(value));
          else context.moveTo(x, Y(value));
          down = true;
        }
        context.stroke();
      }
    }

    function gait(context, X, first, end, high) {
      const room = (high - BOTTOM - 6) / legs;
      context.textAlign = "right";
      context.textBaseline = "middle";
      for (let leg = 0; leg < legs; leg++) {
        const y = 4 + leg * room;
        context.fillStyle = colours.faint;
        context.fillText(String(leg + 1), LEFT - 6, y + room / 2);
        context.fillStyle = scene.legs[leg];
        bars(columns.seen + leg, y + 0.34 * room, 0.56 * room);
        context.fillStyle = colours.faint;
        bars(columns.planned + leg, y + 0.1 * room, Math.max(0.16 * room, 1.5));
      }

      function bars(column, y, thick) {
        let since = NaN;
        for (let k = first; k <= head; k++) {
          const stands = k < head && ring[row(k) + column] > 0.5;
          if (stands && Number.isNaN(since)) since = ring[row(k)];
          if (stands || Number.isNaN(since)) continue;
          const until = k < head ? ring[row(k)] : end;
          const x = Math.max(X(since), LEFT);
          context.fillRect(x, y, Math.max(X(until) - x, 1), thick);
          since = NaN;
        }
      }
    }

    build();
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
      readColours();
      paint();
    });
    return { begin, forget, take, paint };
  };
})();
