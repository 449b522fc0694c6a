"use strict";
// The ground under a robot: level with a grid of 100 mm, or a terrain's own surface.

(() => {
  const { unpacked, IDENTITY } = Phasmid.algebra;
  const REACH = 2.4; // distances of the eye at which a level floor ends

  Phasmid.floor = (drawing, scene, rough) => {
    const { gl, shapes } = drawing;
    const uneven = scene.ground && drawing.solid({
      vertices: unpacked(scene.ground.vertices), faces: unpacked(scene.ground.faces),
    });

    function paint(seen, colours, grid = true, fine = false) {
      gl.disable(gl.BLEND);
      if (uneven) {
        drawing.lay(true);
        drawing.draw(uneven, IDENTITY, [...colours.floor, grid ? 1 : 0], "ground");
        return;
      }
      gl.disable(gl.DEPTH_TEST);
      const model = Float32Array.from(IDENTITY);
      model[0] = model[5] = 1.05 * REACH * seen.distance;
      [model[12], model[13], model[14]] = [seen.target[0], seen.target[1], scene.level];
      drawing.lay(false);
      drawing.draw(shapes.flat, model, [...colours.floor, grid ? 1 : 0], rough && !fine ? "grid" : "ground");
      gl.enable(gl.DEPTH_TEST);
    }

    return { uneven: Boolean(uneven), paint, forget: () => uneven && drawing.forget(uneven) };
  };
})();
