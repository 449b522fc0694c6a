"use strict";
// Frames as they come, the picture between the last two, and the way that feet have gone.

(() => {
  const TRAIL_POINTS = 160;

  Phasmid.frames = () => {
    let at = {};
    let scene = null;
    let width = 0;
    let quaternions = [];
    let last = null;
    let before = null;
    let row = null;
    let arrived = 0;
    let between = 1000 / 30;
    let trails = [];
    const self = { begin, forget, take, now, value, get at() { return at; }, get latest() { return last; }, get trails() { return trails; } };

    function begin(newScene) {
      const same = scene && scene.number === newScene.number;
      scene = newScene;
      if (same) return;
      at = {};
      width = 0;
      for (const [name, count] of scene.layout) {
        at[name] = width;
        width += count;
      }
      quaternions = [];
      for (const [name, count] of [["body_orientation", 4], ["link_orientation", 4 * scene.links]])
        if (name in at) for (let k = 0; k < count; k += 4) quaternions.push(at[name] + k);
      last = before = null;
      row = new Float32Array(width);
      trails = scene.legs.map(() => []);
    }

    function forget() {
      scene = last = before = null;
    }

    // Whether a frame is one of this scene, and has a robot in it; it is kept then.
    function take(frame) {
      if (!scene || frame.length !== width || frame[at.scene] !== scene.number) return false;
      if (!Number.isFinite(frame[at.body_position])) return false;
      const stamp = performance.now();
      const step = last ? frame[at.time] - last[at.time] : 0;
      if (last && step >= 0 && step < 0.5) {
        // Of the two quaternions of a turn the one that is nearer to the last.
        for (const k of quaternions) {
          let sum = 0;
          for (let i = k; i < k + 4; i++) sum += frame[i] * last[i];
          if (sum < 0) for (let i = k; i < k + 4; i++) frame[i] = -frame[i];
        }
        between += 0.1 * (Math.min(stamp - arrived, 200) - between);
        before = last;
      } else {
        before = null;
        trails.forEach((trail) => (trail.length = 0));
      }
      last = frame;
      arrived = stamp;
      remember(frame);
      return true;
    }

    function remember(frame) {
      const time = frame[at.time];
      trails.forEach((trail, leg) => {
        const end = trail[trail.length - 1];
        if (end && time - end[3] < scene.trail / TRAIL_POINTS) return;
        const k = at.foot_position + 3 * leg;
        if (Number.isFinite(frame[k])) trail.push([frame[k], frame[k + 1], frame[k + 2], time]);
        while (trail.length && time - trail[0][3] > scene.trail) trail.shift();
      });
    }

    // Numbers of a moment, between the last two frames or of the last, and whether later ones differ.
    function now(stamp) {
      const part = before ? Math.min((stamp - arrived) / between, 1) : 1;
      if (part >= 1) row.set(last);
      else for (let i = 0; i < width; i++) row[i] = before[i] + part * (last[i] - before[i]);
      if (part < 1)
        for (const k of quaternions) {
          const length = Math.hypot(row[k], row[k + 1], row[k + 2], row[k + 3]) || 1;
          for (let i = k; i < k + 4; i++) row[i] /= length;
        }
      return { row, moves: part < 1 };
    }

    function value(name, index = 0) {
      return last && name in at ? last[at[name] + index] : NaN;
    }

    return self;
  };
})();
