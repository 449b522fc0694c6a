"use strict";
// Drawing of solids, lines and ground: plain WebGL 2 and no library, so that no page needs a network.

(() => {
  const { unit, rgb, IDENTITY } = Phasmid.algebra;
  const { SHAPES } = Phasmid.meshes;
  const POSES = 32; // of the things that are drawn at once; every WebGL 2 has room for twice as many

  const VERTEX = `#version 300 es
    in vec3 corner; in vec4 tint; in float part;
    uniform mat4 models[${POSES}], camera; uniform vec3 light; uniform float squash, level;
    out vec3 world; out vec4 own;
    void main() {
      vec4 place = models[int(part)] * vec4(corner, 1.0);
      // A shadow is the thing itself, pressed along the light onto the ground.
      if (squash > 0.5) place.xyz -= light * (place.z - level) / light.z;
      world = place.xyz; own = tint;
      gl_Position = camera * place;
    }`;

  const HEAD = `#version 300 es
    precision highp float;
    in vec3 world; in vec4 own; out vec4 colour;
    uniform vec4 paint; uniform vec3 eye, light, middle, back, line; uniform float reach, uneven;`;

  // What a piece of paint is for: as it is, lit, or ground with its grid; simpler ones of the last
  // two are for where the processor draws. Each has a program of its own, as a processor would follow
  // all branches of one.
  const FRAGMENTS = {
    plain: `${HEAD}
      void main() { colour = paint * own; }`,
    lit: `${HEAD}
      void main() {
        vec3 normal = normalize(cross(dFdx(world), dFdy(world)));
        vec3 toEye = normalize(eye - world);
        float shine = max(dot(normal, normalize(toEye + light)), 0.0);
        float eighth = shine * shine; eighth *= eighth; eighth *= eighth;
        float away = 1.0 - max(dot(normal, toEye), 0.0);
        float bright = 0.34 + 0.26 * (0.5 + 0.5 * normal.z) + 0.56 * max(dot(normal, light), 0.0);
        float gloss = 0.16 * eighth * eighth * eighth + 0.10 * away * away * away;
        colour = vec4(paint.rgb * own.rgb * bright + gloss, 1.0);
      }`,
    shaded: `${HEAD}
      void main() {
        vec3 normal = normalize(cross(dFdx(world), dFdy(world)));
        colour = vec4(paint.rgb * own.rgb * (0.5 + 0.15 * normal.z + 0.5 * max(dot(normal, light), 0.0)), 1.0);
      }`,
    ground: `${HEAD}
      void main() {
        // Lines 100 mm apart; every fifth is stronger and is seen from farther away.
        vec2 wide = max(fwidth(world.xy), vec2(1e-5));
        vec2 tenths = world.xy * 10.0;
        vec2 near = 1.0 - smoothstep(vec2(0.02), vec2(0.11), 0.01 * abs(fract(tenths - 0.5) - 0.5) / wide);
        vec2 fifth = step(abs(fract(0.2 * floor(tenths + 0.5) + 0.5) - 0.5), vec2(0.1));
        float far = max(wide.x, wide.y);
        float lines = 0.65 * max(near.x, near.y) * min(0.025 / far, 1.0)
          + 0.35 * max(near.x * fifth.x, near.y * fifth.y) * min(0.125 / far, 1.0);
        float shade = 1.0; float fade = 0.0;
        if (uneven > 0.5) shade = 0.72 + 0.34 * max(dot(normalize(cross(dFdx(world), dFdy(world))), light), 0.0);
        else fade = smoothstep(0.35, 1.0, length(world.xy - middle.xy) / reach);
        colour = vec4(mix(mix(paint.rgb * shade, line, lines * paint.a), back, fade), 1.0);
      }`,
    grid: `${HEAD}
      void main() {
        vec2 tenths = world.xy * 10.0;
        vec2 wide = fwidth(tenths);
        vec2 near = clamp(1.1 - abs(fract(tenths - 0.5) - 0.5) / wide, 0.0, 1.0);
        float lines = max(near.x, near.y) * min(0.2 / max(wide.x, wide.y), 0.65);
        vec2 off = (world.xy - middle.xy) / reach;
        float fade = clamp(1.15 * dot(off, off) - 0.15, 0.0, 1.0);
        colour = vec4(mix(mix(paint.rgb, line, lines * paint.a), back, fade), 1.0);
      }`,
  };

  const LIGHT = unit([-0.42, -0.38, 0.82]);
  const UNIFORMS = [
    "models", "camera", "squash", "level", "paint", "eye", "light", "middle", "back", "line", "reach", "uneven",
  ];

  function program(gl, fragment) {
    const made = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(made, shader);
    }
    gl.bindAttribLocation(made, 0, "corner");
    gl.bindAttribLocation(made, 1, "tint");
    gl.bindAttribLocation(made, 2, "part");
    gl.linkProgram(made);
    const at = {};
    for (const name of UNIFORMS) at[name] = gl.getUniformLocation(made, name);
    return { made, at };
  }

  // Colours of the page's own style sheet, light or dark.
  function look() {
    const style = getComputedStyle(document.documentElement);
    const read = (name) => rgb(style.getPropertyValue(name));
    return {
      back: read("--stage"), floor: read("--stage-floor"), line: read("--stage-line"),
      good: read("--good"), bad: read("--bad"), mark: read("--stage-mark"),
      dark: style.getPropertyValue("--scheme").trim() === "dark",
    };
  }

  // A canvas to draw on, or null where the browser has no WebGL 2.
  Phasmid.drawing = (canvas, { antialias = true } = {}) => {
    const gl = canvas.getContext("webgl2", { antialias, stencil: true, alpha: false });
    if (!gl) return null;
    const programs = {};
    for (const [name, fragment] of Object.entries(FRAGMENTS)) programs[name] = program(gl, fragment);
    let used = null;

    function use(name) {
      if (used !== programs[name]) gl.useProgram(programs[name].made);
      used = programs[name];
      return used.at;
    }

    // Colours of its corners are multiplied with the paint; without any it is all paint. Its parts
    // say which pose a corner moves with; without any it is the first.
    function solid({ vertices, faces, tints, parts }) {
      const array = gl.createVertexArray();
      const buffers = [];
      gl.bindVertexArray(array);
      const attribute = (index, data, size, kind, shares) => {
        if (!data) return;
        buffers.push(gl.createBuffer());
        gl.bindBuffer(gl.ARRAY_BUFFER, buffers[buffers.length - 1]);
        gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
        gl.enableVertexAttribArray(index);
        gl.vertexAttribPointer(index, size, kind, shares, 0, 0);
      };
      attribute(0, vertices, 3, gl.FLOAT, false);
      attribute(1, tints, 4, gl.UNSIGNED_BYTE, true);
      attribute(2, parts, 1, gl.UNSIGNED_BYTE, false);
      buffers.push(gl.createBuffer());
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffers[buffers.length - 1]);
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, faces, gl.STATIC_DRAW);
      gl.bindVertexArray(null);
      const kind = faces instanceof Uint32Array ? gl.UNSIGNED_INT : gl.UNSIGNED_SHORT;
      return { array, buffers, count: faces.length, kind };
    }

    function forget({ array, buffers }) {
      gl.deleteVertexArray(array);
      buffers.forEach((buffer) => gl.deleteBuffer(buffer));
    }

    const shapes = { ball: solid(SHAPES.ball), disc: solid(SHAPES.disc), flat: solid(SHAPES.flat) };

    // Lines and surfaces that change with each picture: place and colour of each corner.
    const loose = gl.createVertexArray();
    const looseBuffer = gl.createBuffer();
    let sheet = new Float32Array(7 * 512);
    gl.bindVertexArray(loose);
    gl.bindBuffer(gl.ARRAY_BUFFER, looseBuffer);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 28, 0);
    gl.enableVertexAttribArray(1);
    gl.vertexAttribPointer(1, 4, gl.FLOAT, false, 28, 12);
    gl.bindVertexArray(null);

    // A solid at the pose of each of its parts, matrix by matrix.
    function draw(thing, poses, paint, kind) {
      const at = use(kind);
      gl.vertexAttrib4f(1, 1, 1, 1, 1);
      gl.vertexAttrib1f(2, 0);
      gl.bindVertexArray(thing.array);
      gl.uniformMatrix4fv(at.models, false, poses);
      gl.uniform4fv(at.paint, paint);
      gl.drawElements(gl.TRIANGLES, thing.count, thing.kind, 0);
    }

    function drawLoose(count, how) {
      const at = use("plain");
      gl.vertexAttrib1f(2, 0);
      gl.bindVertexArray(loose);
      gl.bindBuffer(gl.ARRAY_BUFFER, looseBuffer);
      gl.bufferData(gl.ARRAY_BUFFER, sheet.subarray(0, 7 * count), gl.STREAM_DRAW);
      gl.uniformMatrix4fv(at.models, false, IDENTITY);
      gl.uniform4f(at.paint, 1, 1, 1, 1);
      gl.drawArrays(how, 0, count);
    }

    function corner(index, x, y, z, colour, alpha) {
      const k = 7 * index;
      sheet[k] = x;
      sheet[k + 1] = y;
      sheet[k + 2] = z;
      sheet[k + 3] = colour[0];
      sheet[k + 4] = colour[1];
      sheet[k + 5] = colour[2];
      sheet[k + 6] = alpha;
    }

    function room(corners) {
      if (sheet.length < 7 * corners) sheet = new Float32Array(14 * corners);
    }

    // A surface through points, the first of which sees all the others.
    function fan(points, colour, alpha) {
      room(points.length);
      points.forEach((point, k) => corner(k, point[0], point[1], point[2], colour, alpha));
      drawLoose(points.length, gl.TRIANGLE_FAN);
    }

    // Lines of some width that face the eye, each through numbers three by three; they fade from
    // one opacity to another.
    function ribbons(lines, eye) {
      const drawn = lines.filter(({ points }) => points.length > 3);
      if (!drawn.length) return;
      room(drawn.reduce((sum, { points }) => sum + (2 * points.length) / 3 + 2, 0));
      let end = 0;
      for (const { points, width, colour, from = 1, to = from } of drawn) {
        const count = points.length / 3;
        const begin = end;
        // Between two lines the strip goes on without an area.
        if (begin) end += 2;
        for (let k = 0; k < count; k++, end += 2) {
          const a = 3 * Math.max(k - 1, 0);
          const b = 3 * Math.min(k + 1, count - 1);
          const [x, y, z] = [points[3 * k], points[3 * k + 1], points[3 * k + 2]];
          const [dx, dy, dz] = [points[b] - points[a], points[b + 1] - points[a + 1], points[b + 2] - points[a + 2]];
          const [ex, ey, ez] = [eye[0] - x, eye[1] - y, eye[2] - z];
          const [sx, sy, sz] = [dy * ez - dz * ey, dz * ex - dx * ez, dx * ey - dy * ex];
          const half = width / 2 / Math.max(Math.hypot(sx, sy, sz), 1e-12);
          const alpha = from + ((to - from) * k) / (count - 1);
          corner(end, x - sx * half, y - sy * half, z - sz * half, colour, alpha);
          corner(end + 1, x + sx * half, y + sy * half, z + sz * half, colour, alpha);
        }
        if (begin) {
          sheet.copyWithin(7 * begin, 7 * (begin - 1), 7 * begin);
          sheet.copyWithin(7 * (begin + 1), 7 * (begin + 2), 7 * (begin + 3));
        }
      }
      drawLoose(end, gl.TRIANGLE_STRIP);
    }

    // Begin a picture with `ratio` dots for a pixel of the page.
    function fit(ratio) {
      const wide = Math.max(Math.round(canvas.clientWidth * ratio), 1);
      const high = Math.max(Math.round(canvas.clientHeight * ratio), 1);
      if (canvas.width !== wide || canvas.height !== high) [canvas.width, canvas.height] = [wide, high];
    }

    function begin(seen, colours) {
      gl.viewport(0, 0, canvas.width, canvas.height);
      gl.clearColor(...colours.back, 1);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
      gl.enable(gl.DEPTH_TEST);
      gl.disable(gl.BLEND);
      gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
      for (const name of Object.keys(programs)) {
        const at = use(name);
        gl.uniformMatrix4fv(at.camera, false, seen.matrix);
        gl.uniform3fv(at.eye, seen.eye);
        gl.uniform3fv(at.light, LIGHT);
        gl.uniform1f(at.squash, 0);
        gl.uniform3fv(at.middle, seen.target);
        gl.uniform3fv(at.back, colours.back);
        gl.uniform3fv(at.line, colours.line);
        gl.uniform1f(at.reach, 2.4 * seen.distance);
      }
    }

    // How the ground is drawn from now on.
    function lay(uneven) {
      gl.uniform1f(use("ground").uneven, uneven ? 1 : 0);
    }

    // What is drawn meanwhile is pressed onto a level, each dot of it once.
    function shadows(level, act) {
      gl.enable(gl.BLEND);
      gl.enable(gl.STENCIL_TEST);
      gl.stencilFunc(gl.EQUAL, 0, 255);
      gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
      gl.disable(gl.DEPTH_TEST);
      const at = use("plain");
      gl.uniform1f(at.squash, 1);
      gl.uniform1f(at.level, level);
      act();
      gl.uniform1f(use("plain").squash, 0);
      gl.disable(gl.STENCIL_TEST);
      gl.enable(gl.DEPTH_TEST);
    }

    return { gl, POSES, shapes, solid, forget, draw, fan, ribbons, fit, begin, lay, shadows };
  };

  Phasmid.drawing.look = look;
})();
