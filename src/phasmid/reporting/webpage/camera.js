"use strict";
// The camera, and its control by pointer.

(() => {
  const { add, times, dot, cross, product } = Phasmid.algebra;
  const FIELD = (30 * Math.PI) / 180;
  const VIEWS = {
    corner: [-56, 27], side: [-90, 8], front: [0, 10], behind: [180, 24], above: [-90, 89],
  };

  // A camera about a target. `largest` is the size that is to be seen [m]; `changed` is called
  // after each turn by hand.
  Phasmid.camera = (canvas, changed) => {
    const camera = { azimuth: 0, elevation: 0, zoom: 1, largest: 0.3, choose, nearer, sight };
    const fingers = new Map();

    function choose(name, yaw) {
      const [azimuth, elevation] = VIEWS[name];
      camera.azimuth = yaw + (azimuth * Math.PI) / 180;
      camera.elevation = (elevation * Math.PI) / 180;
      camera.zoom = 1;
    }

    function nearer(factor) {
      camera.zoom = Math.min(Math.max(camera.zoom / factor, 0.2), 5);
      changed();
    }

    function sight(target) {
      const aspect = canvas.width / canvas.height;
      const distance =
        (0.84 * camera.largest * camera.zoom) / Math.tan(FIELD / 2) / Math.min(1, aspect / 1.25);
      const [a, e] = [camera.azimuth, camera.elevation];
      const out = [Math.cos(a) * Math.cos(e), Math.sin(a) * Math.cos(e), Math.sin(e)];
      const eye = add(target, times(out, distance));
      const right = [-Math.sin(a), Math.cos(a), 0];
      const up = cross(out, right);
      const near = distance / 40;
      const far = distance * 12;
      const f = 1 / Math.tan(FIELD / 2);
      const lens = new Float32Array([
        f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, (2 * far * near) / (near - far), 0,
      ]);
      const place = new Float32Array([
        right[0], up[0], out[0], 0, right[1], up[1], out[1], 0, right[2], up[2], out[2], 0,
        -dot(right, eye), -dot(up, eye), -dot(out, eye), 1,
      ]);
      return { eye, target, matrix: product(lens, place), distance };
    }

    canvas.addEventListener("pointerdown", (event) => {
      fingers.set(event.pointerId, [event.clientX, event.clientY]);
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      const old = fingers.get(event.pointerId);
      if (!old) return;
      const others = [...fingers].filter(([id]) => id !== event.pointerId).map(([, place]) => place);
      if (others.length) {
        const apart = (p) => Math.hypot(p[0] - others[0][0], p[1] - others[0][1]);
        const ratio = Math.max(apart([event.clientX, event.clientY]), 1) / Math.max(apart(old), 1);
        fingers.set(event.pointerId, [event.clientX, event.clientY]);
        nearer(ratio);
        return;
      }
      camera.azimuth -= (event.clientX - old[0]) * 0.008;
      camera.elevation = Math.min(Math.max(camera.elevation + (event.clientY - old[1]) * 0.008, -0.1), 1.555);
      fingers.set(event.pointerId, [event.clientX, event.clientY]);
      changed();
    });
    for (const name of ["pointerup", "pointercancel"])
      canvas.addEventListener(name, (event) => fingers.delete(event.pointerId));
    canvas.addEventListener("wheel", (event) => {
      // Only a picture that was chosen takes the wheel, so that the page still scrolls over it.
      if (document.activeElement !== canvas) return;
      event.preventDefault();
      nearer(Math.exp(-event.deltaY * 0.001));
    }, { passive: false });
    return camera;
  };
})();
