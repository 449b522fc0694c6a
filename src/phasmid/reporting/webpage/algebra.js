"use strict";
// Vectors, matrices and packed arrays: what every moving picture of a robot is made of.

globalThis.Phasmid = globalThis.Phasmid || {};

(() => {
  const KINDS = { i16: Int16Array, f32: Float32Array, u8: Uint8Array, u16: Uint16Array, u32: Uint32Array };

  function unpacked(packed) {
    if (!packed) return null;
    const bytes = Uint8Array.from(atob(packed.data), (letter) => letter.charCodeAt(0));
    const numbers = new KINDS[packed.kind](bytes.buffer);
    return packed.kind === "i16" ? Float32Array.from(numbers, (n) => n * packed.step) : numbers;
  }

  const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
  const less = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
  const times = (a, k) => [a[0] * k, a[1] * k, a[2] * k];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [
    a[1] * b[2] - a[2] * b[1],
    a[2] * b[0] - a[0] * b[2],
    a[0] * b[1] - a[1] * b[0],
  ];
  const size = (a) => Math.hypot(a[0], a[1], a[2]);
  const unit = (a) => times(a, 1 / Math.max(size(a), 1e-12));
  const vector = (array, index) => [array[3 * index], array[3 * index + 1], array[3 * index + 2]];

  // Matrices of 4 by 4, column by column, as WebGL takes them.
  function product(a, b, c = new Float32Array(16)) {
    for (let j = 0; j < 16; j += 4)
      for (let i = 0; i < 4; i++)
        c[j + i] = a[i] * b[j] + a[4 + i] * b[j + 1] + a[8 + i] * b[j + 2] + a[12 + i] * b[j + 3];
    return c;
  }

  function pose([px, py, pz], [w, x, y, z], c = new Float32Array(16)) {
    c[0] = 1 - 2 * (y * y + z * z);
    c[1] = 2 * (x * y + w * z);
    c[2] = 2 * (x * z - w * y);
    c[4] = 2 * (x * y - w * z);
    c[5] = 1 - 2 * (x * x + z * z);
    c[6] = 2 * (y * z + w * x);
    c[8] = 2 * (x * z + w * y);
    c[9] = 2 * (y * z - w * x);
    c[10] = 1 - 2 * (x * x + y * y);
    c[3] = c[7] = c[11] = 0;
    c[12] = px;
    c[13] = py;
    c[14] = pz;
    c[15] = 1;
    return c;
  }

  // A matrix that carries the z axis to a direction, with widths and length.
  function along(place, direction, width, length) {
    const z = unit(direction);
    const x = unit(cross(Math.abs(z[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0], z));
    const y = cross(z, x);
    return new Float32Array([
      ...times(x, width), 0, ...times(y, width), 0, ...times(z, length), 0, ...place, 1,
    ]);
  }

  // Corners of the convex hull seen from above, against the clock.
  function hull(points) {
    const ordered = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
    const chain = (row) => {
      const kept = [];
      for (const point of row) {
        while (kept.length > 1) {
          const a = less(kept[kept.length - 1], kept[kept.length - 2]);
          const b = less(point, kept[kept.length - 2]);
          if (a[0] * b[1] - a[1] * b[0] > 1e-9) break;
          kept.pop();
        }
        kept.push(point);
      }
      return kept.slice(0, -1);
    };
    return points.length < 3 ? [] : [...chain(ordered), ...chain([...ordered].reverse())];
  }

  function rgb(text) {
    const hex = text.trim();
    return [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16) / 255);
  }

  // Heading of a body's turn about the vertical [rad].
  const heading = ([w, x, y, z]) => Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));

  Phasmid.algebra = {
    unpacked, add, less, times, dot, cross, size, unit, vector, product, pose, along, hull, rgb, heading,
    IDENTITY: pose([0, 0, 0], [1, 0, 0, 0]),
  };
})();
