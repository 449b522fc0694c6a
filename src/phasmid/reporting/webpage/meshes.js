"use strict";
// Simple shapes, and meshes made fewer and coarser, so that a picture costs little.

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

  // Meshes as one, each with a colour of its own, and a part that it is of.
  function merged(meshes) {
    const corners = meshes.reduce((sum, { vertices }) => sum + vertices.length, 0) / 3;
    const vertices = new Float32Array(3 * corners);
    const tints = new Uint8Array(4 * corners);
    const parts = new Uint8Array(corners);
    const faces = new Uint32Array(meshes.reduce((sum, mesh) => sum + mesh.faces.length, 0));
    let [v, f] = [0, 0];
    for (const { colour = [1, 1, 1], part = 0, ...mesh } of meshes) {
      vertices.set(mesh.vertices, 3 * v);
      for (let k = 0; k < mesh.faces.length; k++) faces[f + k] = mesh.faces[k] + v;
      const end = v + mesh.vertices.length / 3;
      const tint = [...colour.map((share) => Math.round(255 * share)), 255];
      for (let k = v; k < end; k++) tints.set(tint, 4 * k);
      parts.fill(part, v, end);
      v = end;
      f += mesh.faces.length;
    }
    return { vertices, faces, tints, parts };
  }

  // A solid of revolution about z through radii at heights.
  function turned(profile, sides) {
    const vertices = [];
    const faces = [];
    profile.forEach(([radius, height]) => {
      for (let k = 0; k < sides; k++) {
        const angle = (2 * Math.PI * k) / sides;
        vertices.push(radius * Math.cos(angle), radius * Math.sin(angle), height);
      }
    });
    for (let ring = 0; ring + 1 < profile.length; ring++)
      for (let k = 0; k < sides; k++) {
        const a = ring * sides + k;
        const b = ring * sides + ((k + 1) % sides);
        faces.push(a, b, b + sides, a, b + sides, a + sides);
      }
    return { vertices: new Float32Array(vertices), faces: new Uint16Array(faces) };
  }

  const rings = Array.from({ length: 13 }, (_, k) => (Math.PI * k) / 12);
  const SHAPES = {
    shaft: turned([[0, 0], [1, 0], [1, 1], [0, 1]], 12),
    cone: turned([[0, 0], [1, 0], [0, 1]], 16),
    funnel: turned([[0, 0], [1, 1]], 32),
    ball: turned(rings.map((angle) => [Math.sin(angle), -Math.cos(angle)]), 20),
    disc: turned([[0, 0], [1, 0]], 32),
    flat: {
      vertices: new Float32Array([-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0]),
      faces: new Uint16Array([0, 1, 2, 0, 2, 3]),
    },
  };

  Phasmid.meshes = { coarse, merged, SHAPES };
})();
