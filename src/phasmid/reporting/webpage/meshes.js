"use strict";
// Meshes made fewer and coarser, so that a picture costs little.

(() => {
  const SIDES = 1024; // cells along an axis

  // A mesh whose corners within a cell become one; what is then no triangle is left out.
  // Source: Rossignac and Borrel, Multi-resolution 3D approximations (1993).
  function coarse({ vertices, faces }, cell) {
    const found = new Map();
    const index = new Uint32Array(vertices.length / 3);
    const sums = [];
    for (let k = 0; k < index.length; k++) {
      let key = 0;
      for (let i = 0; i < 3; i++)
        key = SIDES * key + Math.min(Math.max(Math.floor(vertices[3 * k + i] / cell) + SIDES / 2, 0), SIDES - 1);
      if (!found.has(key)) {
        found.set(key, found.size);
        sums.push(0, 0, 0, 0);
      }
      const at = found.get(key);
      index[k] = at;
      for (let i = 0; i < 3; i++) sums[4 * at + i] += vertices[3 * k + i];
      sums[4 * at + 3] += 1;
    }
    const means = new Float32Array(3 * found.size);
    for (let k = 0; k < found.size; k++)
      for (let i = 0; i < 3; i++) means[3 * k + i] = sums[4 * k + i] / sums[4 * k + 3];
    const known = new Set();
    const kept = [];
    for (let k = 0; k < faces.length; k += 3) {
      const [a, b, c] = [index[faces[k]], index[faces[k + 1]], index[faces[k + 2]]];
      if (a === b || b === c || c === a) continue;
      const [low, middle, high] = [a, b, c].sort((p, q) => p - q);
      const key = (low * 131072 + middle) * 131072 + high;
      if (known.has(key)) continue;
      known.add(key);
      kept.push(a, b, c);
    }
    return { vertices: means, faces: Uint32Array.from(kept) };
  }

  // Meshes as one, each with a colour of its own.
  function merged(parts) {
    const corners = parts.reduce((sum, { vertices }) => sum + vertices.length, 0);
    const vertices = new Float32Array(corners);
    const tints = new Uint8Array((4 * corners) / 3);
    const faces = new Uint32Array(parts.reduce((sum, part) => sum + part.faces.length, 0));
    let [v, f] = [0, 0];
    for (const part of parts) {
      vertices.set(part.vertices, v);
      for (let k = 0; k < part.faces.length; k++) faces[f + k] = part.faces[k] + v / 3;
      const tint = [...part.colour.map((share) => Math.round(255 * share)), 255];
      for (let k = v / 3; k < (v + part.vertices.length) / 3; k++) tints.set(tint, 4 * k);
      v += part.vertices.length;
      f += part.faces.length;
    }
    return { vertices, faces, tints };
  }

  Phasmid.meshes = { coarse, merged };
})();
