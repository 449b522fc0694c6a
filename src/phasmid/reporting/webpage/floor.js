"use strict";
// The ground under a robot: level with a grid of 100 mm, or a terrain's own surface.

(() => {
  const { unpacked, IDENTITY } = Phasmid.algebra;
  const REACH = 2.4; // distances of the eye at which a level floor ends
  const EVERYWHERE = [-1e9, 1e9, -1e9, 1e9];

  Phasmid.floor = (drawing, scene) => {
    const { gl, shapes } = drawing;
    const uneven = scene.ground && { vertices: unpacked(scene.ground.vertices), faces: unpacked(scene.ground.faces) };
    const border = uneven ? extent(uneven.vertices) : EVERYWHERE;
    let dyed = null;
    let solid = null;
    drawing.lay(scene.patches);

    function extent(vertices) {
      const found = [Infinity, -Infinity, Infinity, -Infinity];
      for (let k = 0; k < vertices.length; k++) {
        const axis = k % 3;
        if (axis === 2) continue;
        found[2 * axis] = Math.min(found[2 * axis], vertices[k]);
        found[2 * axis + 1] = Math.max(found[2 * axis + 1], vertices[k]);
      }
      return found;
    }

    // Colours of the page are those of the surface's corners.
    function dye(colours) {
      if (dyed === colours) return;
      forget();
      dyed = colours;
      solid = drawing.solid(Phasmid.relief(uneven, colours));
    }

    function paint(seen, colours, grid) {
      gl.disable(gl.BLEND);
      drawing.ground(scene.patches, border, uneven ? colours.edge : colours.line);
      if (uneven) {
        dye(colours);
        drawing.draw(solid, IDENTITY, [1, 1, 1, grid ? 0.3 : 0], "ground");
        return;
      }
      gl.disable(gl.DEPTH_TEST);
      const model = Float32Array.from(IDENTITY);
      model[0] = model[5] = 1.05 * REACH * seen.distance;
      [model[12], model[13], model[14]] = [seen.target[0], seen.target[1], scene.level];
      drawing.draw(shapes.flat, model, [...colours.floor, grid ? 1 : 0], "ground");
      gl.enable(gl.DEPTH_TEST);
    }

    function forget() {
      if (solid) drawing.forget(solid);
    }

    return { paint, forget };
  };
})();
