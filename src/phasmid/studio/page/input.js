"use strict";
// The stick and the keys: the velocity command, sent again while they are held.

(() => {
  const AGAIN = 100; // milliseconds; the server drops a stick after 500 without a message
  const KEYS = {
    w: [1, 0, 0], s: [-1, 0, 0], a: [0, 1, 0], d: [0, -1, 0], q: [0, 0, 1], e: [0, 0, -1],
    arrowup: [1, 0, 0], arrowdown: [-1, 0, 0], arrowleft: [0, 1, 0], arrowright: [0, -1, 0],
  };
  const byId = (id) => document.getElementById(id);
  const within = (value) => Math.min(Math.max(value, -1), 1);

  Phasmid.input = (notify, { halt, pause, reset }) => {
    const stick = byId("stick");
    const knob = stick.querySelector(".knob");
    const turn = byId("turn");
    const held = new Map();
    let pad = [0, 0];
    let turning = 0;
    let sent = [0, 0, 0];
    let timer = 0;

    function wanted() {
      const sum = [pad[0], pad[1], turning];
      for (const key of held.values()) for (let k = 0; k < 3; k++) sum[k] += key[k];
      const length = Math.hypot(sum[0], sum[1]);
      if (length > 1) [sum[0], sum[1]] = [sum[0] / length, sum[1] / length];
      return [sum[0], sum[1], within(sum[2])].map((value) => Math.round(1000 * value) / 1000 || 0);
    }

    function steer() {
      const now = wanted();
      show(now);
      const rests = now.every((value) => value === 0);
      if (!rests || sent.some((value) => value !== 0)) send(now);
      if (rests) {
        clearInterval(timer);
        timer = 0;
      } else if (!timer) timer = setInterval(() => send(wanted()), AGAIN);
    }

    function send(now) {
      sent = now;
      notify({ do: "stick", at: now });
    }

    function show([ahead, left, yaw]) {
      knob.style.transform = `translate(${(-38 * left).toFixed(1)}px, ${(-38 * ahead).toFixed(1)}px)`;
      const share = (value, one, other) => (value ? `${Math.round(100 * Math.abs(value))} % ${value > 0 ? one : other}` : "");
      const words = [share(ahead, "ahead", "back"), share(left, "to the left", "to the right")].filter(Boolean);
      stick.setAttribute("aria-valuenow", String(Math.round(100 * ahead)));
      stick.setAttribute("aria-valuetext", words.join(", ") || "at rest");
      stick.classList.toggle("held", words.length > 0);
      // A slider to the right is a turn to the right.
      if (document.activeElement !== turn || !turning) turn.value = String(-yaw || 0);
      turn.setAttribute("aria-valuetext", share(yaw, "to the left", "to the right") || "straight");
    }

    function rest() {
      held.clear();
      pad = [0, 0];
      turning = 0;
    }

    function stop() {
      rest();
      steer();
      halt();
    }

    // ---------------------------------------------------------------- the pad

    let finger = null;
    function lean(event) {
      const box = stick.getBoundingClientRect();
      const reach = 0.38 * box.width;
      let x = (event.clientX - box.left - box.width / 2) / reach;
      let y = (event.clientY - box.top - box.height / 2) / reach;
      const length = Math.hypot(x, y);
      if (length > 1) [x, y] = [x / length, y / length];
      pad = length < 0.06 ? [0, 0] : [-y, -x];
      steer();
    }
    stick.addEventListener("pointerdown", (event) => {
      if (finger !== null) return;
      finger = event.pointerId;
      stick.setPointerCapture(finger);
      lean(event);
    });
    stick.addEventListener("pointermove", (event) => event.pointerId === finger && lean(event));
    for (const name of ["pointerup", "pointercancel", "lostpointercapture"])
      stick.addEventListener(name, (event) => {
        if (event.pointerId !== finger) return;
        finger = null;
        pad = [0, 0];
        steer();
      });

    turn.addEventListener("input", () => {
      turning = -Number(turn.value);
      steer();
    });
    for (const name of ["change", "pointerup", "pointercancel", "keyup", "blur"])
      turn.addEventListener(name, () => {
        turning = 0;
        turn.value = "0";
        steer();
      });

    // ---------------------------------------------------------------- the keys

    function typing(target) {
      return target.matches("select, textarea, [type=text], [type=number], [type=file]");
    }

    let byPointer = false;
    document.addEventListener("pointerdown", () => (byPointer = true));
    document.addEventListener("change", ({ target }) => {
      // A choice would take the next letter for itself; who chose by hand goes on driving.
      if (byPointer && target.matches("select")) byId("view").focus({ preventScroll: true });
    });

    document.addEventListener("keydown", (event) => {
      byPointer = false;
      if (event.ctrlKey || event.altKey || event.metaKey || typing(event.target)) return;
      const key = event.key.toLowerCase();
      // Arrows belong to what has the focus, unless that is the stick or the slider beside it.
      const turns = event.target === turn && /arrow(left|right)/.test(key);
      if (key.startsWith("arrow") && event.target !== stick && !turns) return;
      if (key in KEYS) {
        held.set(event.code, turns ? [0, 0, KEYS[key][1]] : KEYS[key]);
        if (!event.repeat) steer();
      } else if (key === " ") {
        if (event.target.matches("button, summary, a, [type=checkbox]")) return;
        stop();
      } else if (key === "p" && !event.repeat) pause();
      else if (key === "r" && !event.repeat) reset();
      else return;
      event.preventDefault();
    });
    document.addEventListener("keyup", (event) => {
      if (held.delete(event.code)) steer();
    });
    // No event comes for a key that is released elsewhere.
    const leave = () => {
      rest();
      steer();
    };
    window.addEventListener("blur", leave);
    window.addEventListener("pagehide", leave);
    document.addEventListener("visibilitychange", () => document.hidden && leave());
    byId("stop").addEventListener("click", stop);
    show([0, 0, 0]);
  };
})();
