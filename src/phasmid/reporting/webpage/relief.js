"use strict";
// The surface of uneven ground: its colours by height and slope, and its edges.

(() => {
  const { less, times, add, dot, cross, size, unit, vector } = Phasmid.algebra;
  const CREASE = Math.cos((35 * Math.PI) / 180); // between normals of faces with an edge between them
  const FULL_RANGE = 0.02; // of heights [m], from which on its colours are full
  const STEEPER = 1.8; // than it is, a slope is lit
  const EDGE = 0.003; // width of an edge [m]
  const LIFT = 0.0003; // of an edge over its face, so that it is not hidden in it [m]

  // A solid whose corners have their colours.
  Phasmid.relief = ({ vertices, faces }, colours) => {
    const { LIGHT } = Phasmid.drawing;
    const count = faces.length / 3;
    const corner = (k) => vector(vertices, faces[k]);
    const normals = [];
    const around = Array.from({ length: vertices.length / 3 }, () => []);
    const beside = new Map();
    let [low, high] = [Infinity, -Infinity];
    for (let face = 0; face < count; face++) {
      const [a, b, c] = [0, 1, 2].map((k) => corner(3 * face + k));
      const normal = cross(less(b, a), less(c, a));
      normals.push(normal);
      if (normal[2] > 0.5 * size(normal)) {
        low = Math.min(low, a[2], b[2], c[2]);
        high = Math.max(high, a[2], b[2], c[2]);
      }
      for (let k = 0; k < 3; k++) {
        const [p, q] = [faces[3 * face + k], faces[3 * face + ((k + 1) % 3)]];
        around[p].push(face);
        const key = Math.min(p, q) * around.length + Math.max(p, q);
        if (beside.has(key)) beside.get(key).push(face);
        else beside.set(key, [face]);
      }
    }
    const units = normals.map(unit);

    function colour(place, normal) {
      const part = Math.min(Math.max((place[2] - low) / Math.max(high - low, 1e-9), 0), 1);
      const [x, y, z] = normal;
      const leaning = unit([STEEPER * x, STEEPER * y, z]);
      // Level ground has the colour of its height.
      const bright = z < 0.3 ? 0.62 : 0.45 + (0.55 * Math.max(dot(leaning, LIGHT), 0)) / LIGHT[2];
      const full = add(colours.low, times(less(colours.high, colours.low), part));
      const own = add(colours.floor, times(less(full, colours.floor), Math.min((high - low) / FULL_RANGE, 1)));
      return own.map((share) => Math.min(share * bright, 1));
    }

    const [corners, shades] = [[], []];
    const put = (place, shade) => {
      corners.push(...place);
      shades.push(...shade.map((share) => Math.round(255 * share)), 255);
    };
    for (let k = 0; k < 3 * count; k++) {
      const face = Math.floor(k / 3);
      // Round where the faces about the corner lean little from another, and else with an edge.
      const about = around[faces[k]].filter((other) => dot(units[other], units[face]) > CREASE);
      const normal = unit(about.reduce((sum, other) => add(sum, normals[other]), [0, 0, 0]));
      put(corner(k), colour(corner(k), normal));
    }
    // An edge is a strip on the face that looks up.
    for (const [key, [one, other]] of beside) {
      if (other === undefined || dot(units[one], units[other]) > CREASE) continue;
      const up = units[one][2] > units[other][2] ? one : other;
      if (units[up][2] < 0.5) continue;
      const [a, b] = [Math.floor(key / around.length), key % around.length].map((k) => add(vector(vertices, k), [0, 0, LIFT]));
      const middle = times([0, 1, 2].reduce((sum, k) => add(sum, corner(3 * up + k)), [0, 0, 0]), 1 / 3);
      const inwards = unit(cross(units[up], less(b, a)));
      const side = times(inwards, EDGE * Math.sign(dot(inwards, less(middle, a))));
      for (const place of [a, b, add(b, side), a, add(b, side), add(a, side)]) put(place, colours.edge);
    }
    return {
      vertices: new Float32Array(corners), tints: new Uint8Array(shades),
      faces: Uint32Array.from({ length: corners.length / 3 }, (_, k) => k),
    };
  };
})();
