"use strict";
// The strip of numbers over the picture.

(() => {
  const degrees = (radians) => (radians * 180) / Math.PI;

  function number(value, digits, unit) {
    if (!Number.isFinite(value)) return "–";
    const text = value.toFixed(digits);
    return `${Number(text) === 0 ? (0).toFixed(digits) : text.replace("-", "−")}${unit}`;
  }

  // What a velocity is: its speed, and its turn where it turns.
  function velocity(frames, name) {
    const speed = Math.hypot(frames.value(name, 0), frames.value(name, 1));
    const turn = degrees(frames.value(name, 2));
    const turns = Math.abs(turn) >= 0.5 ? ` ${number(turn, 0, " °/s")}` : "";
    return `${number(1000 * speed, 0, " mm/s")}${turns}`;
  }

  const TILES = [
    ["commanded", "Speed commanded", "What the stick or the plan commands, in the body's axes"],
    ["got", "Speed measured", "What the body does, averaged over a cycle of the gait"],
    ["power", "Power", "Power that the servos draw, or with other drives the mechanical power of all joints, averaged"],
    ["transport", "Cost of transport", "Energy for a metre and a newton of weight: electrical with the drive servo, else mechanical"],
    ["servo", "Worst servo", "The servo that is nearest to its greatest torque"],
    ["margin", "Support margin", "From the centre of mass to the nearest edge of the support polygon"],
    ["tilt", "Tilt", "Between the body's vertical and the world's"],
    ["real", "Real time", "Simulated seconds in a second"],
    ["rate", "Frames", "Pictures drawn in a second"],
  ];

  Phasmid.strip = (host, frames, view) => {
    const cells = {};
    for (const [name, label, help] of TILES) {
      const tile = document.createElement("div");
      const [dt, dd] = [document.createElement("dt"), document.createElement("dd")];
      dt.textContent = label;
      tile.title = help;
      dd.id = `now-${name}`;
      dd.textContent = "–";
      tile.append(dt, dd);
      host.append(tile);
      cells[name] = dd;
    }

    function show(name, text, bad = false) {
      const cell = cells[name];
      if (cell.textContent !== text) cell.textContent = text;
      cell.classList.toggle("beyond", bad);
    }

    function worst() {
      const [index, share] = [frames.value("worst_servo", 0), frames.value("worst_servo", 1)];
      if (!Number.isFinite(share)) return "–";
      const leg = Math.floor(index / 3);
      return `${leg + 1} ${["coxa", "femur", "tibia"][index % 3]} ${number(100 * share, 0, " %")}`;
    }

    function update() {
      if (!frames.latest) return;
      const margin = frames.value("margin");
      show("commanded", velocity(frames, "velocity_command"));
      show("got", velocity(frames, "velocity"));
      show("power", number(frames.value("power"), 1, " W"));
      show("transport", number(frames.value("cost_of_transport"), 2, ""));
      show("servo", worst(), frames.value("worst_servo", 1) >= 0.995);
      show("margin", Number.isFinite(margin) ? number(1000 * margin, 0, " mm") : "under 3 feet", !(margin >= 0));
      show("tilt", number(degrees(frames.value("tilt")), 1, "°"));
      show("real", number(frames.value("pace_got"), 2, "×"));
      show("rate", `${view.perSecond}/s`);
    }

    return { update };
  };
})();
