"use strict";
// Drawing of solids, lines and ground: plain WebGL 2 and no library, so that no page needs a network.

(() => {
  const { unit, dot, cross, rgb, IDENTITY } = Phasmid.algebra;
  const { SHAPES } = Phasmid.meshes;
  const POSES = 32; // of the things that are drawn at once; every WebGL 2 has room for twice as many

  const VERTEX = `#version 300 es
    in vec3 corner; in vec4 tint; in float part;
    uniform mat4 models[${POSES}], camera;
    out vec3 world; out vec4 own;
    void main() {
      vec4 place = models[int(part)] * vec4(corner, 1.0);
      world = place.xyz; own = tint;
      gl_Position = camera * place;
    }`;

  const HEAD = `#version 300 es
    precision highp float;
    in vec3 world; in vec4 own; out vec4 colour;
    uniform vec4 paint; uniform vec3 eye, light, middle, back, line; uniform float reach;`;

  // Colour of the ground: that of its friction where there are patches, dimmed where the light
  // sees the robot first; and how much of it has vanished, far away and at the border of what is known.
  const SURFACE = `
    uniform mat4 sun; uniform highp sampler2DShadow shade; uniform float dim;
    uniform sampler2D grip; uniform vec4 field, border; uniform vec2 turn; uniform vec3 slippery, gripping;
    vec3 surface() {
      vec3 colour = paint.rgb * own.rgb;
      vec2 at = (vec2(turn.x * world.x + turn.y * world.y, turn.x * world.y - turn.y * world.x) - field.xy) * field.zw;
      if (at.x > 0.0 && at.y > 0.0 && at.x < 1.0 && at.y < 1.0) {
        vec2 share = textureLod(grip, at, 0.0).rg;
        colour = mix(mix(colour, slippery, 0.85 * share.r), gripping, 0.85 * share.g);
      }
      vec3 lit = 0.5 + 0.5 * (sun * vec4(world, 1.0)).xyz;
      if (lit.x > 0.0 && lit.y > 0.0 && lit.x < 1.0 && lit.y < 1.0) colour *= 1.0 - dim * (1.0 - textureLod(shade, lit, 0.0));
      return colour;
    }
    float vanished(float far) {
      vec2 inside = min(world.xy - border.xy, border.zw - world.xy);
      return max(far, 1.0 - clamp(5.0 * min(inside.x, inside.y), 0.0, 1.0));
    }`;

  // Depth for shadows, paint as it is, lit solids, and ground with its grid.
  const FRAGMENTS = {
    depth: `${HEAD}
      void main() { colour = vec4(1.0); }`,
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
    ground: `${HEAD}${SURFACE}
      void main() {
        // Lines 100 mm apart; every fifth is stronger and is seen from farther away.
        vec2 wide = max(fwidth(world.xy), vec2(1e-5));
        vec2 tenths = world.xy * 10.0;
        vec2 near = 1.0 - smoothstep(vec2(0.02), vec2(0.11), 0.01 * abs(fract(tenths - 0.5) - 0.5) / wide);
        vec2 fifth = step(abs(fract(0.2 * floor(tenths + 0.5) + 0.5) - 0.5), vec2(0.1));
        float far = max(wide.x, wide.y);
        float lines = 0.65 * max(near.x, near.y) * min(0.025 / far, 1.0)
          + 0.35 * max(near.x * fifth.x, near.y * fifth.y) * min(0.125 / far, 1.0);
        float away = smoothstep(0.35, 1.0, length(world.xy - middle.xy) / reach);
        colour = vec4(mix(mix(surface(), line, lines * paint.a), back, vanished(away)), 1.0);
      }`,
  };

  const LIGHT = unit([-0.42, -0.38, 0.82]);
  const TO_SIDE = unit(cross([0, 0, 1], LIGHT));
  const TO_TOP = cross(LIGHT, TO_SIDE);
  const UNIFORMS = [
    "models", "camera", "paint", "eye", "light", "middle", "back", "line", "reach",
    "sun", "shade", "dim", "grip", "field", "border", "turn", "slippery", "gripping",
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
      low: read("--stage-low"), high: read("--stage-high"), edge: read("--stage-edge"),
      slippery: read("--stage-ice"), gripping: read("--stage-grip"),
      good: read("--good"), bad: read("--bad"), mark: read("--stage-mark"),
      dark: style.getPropertyValue("--scheme").trim() === "dark",
    };
  }

  // True where the processor draws, as there is no graphics card.
  function bySoftware() {
    const gl = document.createElement("canvas").getContext("webgl2");
    const unmasked = gl?.getExtension("WEBGL_debug_renderer_info")?.UNMASKED_RENDERER_WEBGL;
    const name = gl?.getParameter(unmasked ?? gl.RENDERER) ?? "";
    gl?.getExtension("WEBGL_lose_context")?.loseContext();
    return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
  }

  // A canvas to draw on, or null where the browser has no WebGL 2.
  Phasmid.drawing = (canvas, { antialias = true } = {}) => {
    const gl = canvas.getContext("webgl2", { antialias, alpha: false });
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
        gl.uniform3fv(at.middle, seen.target);
        gl.uniform3fv(at.back, colours.back);
        gl.uniform3fv(at.line, colours.line);
        gl.uniform1f(at.reach, 2.4 * seen.distance);
        gl.uniform1i(at.shade, 0);
        gl.uniform1i(at.grip, 1);
        gl.uniform1f(at.dim, 0);
        gl.uniform3fv(at.slippery, colours.slippery);
        gl.uniform3fv(at.gripping, colours.gripping);
      }
    }

    // What the light sees: a picture of depths about the robot, smaller where the processor draws.
    const texels = antialias ? 1024 : 512;
    const shade = gl.createTexture();
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, shade);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, texels, texels);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.LINEAR);
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
    const seenByLight = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, seenByLight);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, shade, 0);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);

    // What is drawn meanwhile, as depth, within a radius about a place dims the ground behind it.
    function shadows(place, radius, dim, act) {
      const sun = new Float32Array(16);
      [TO_SIDE, TO_TOP, LIGHT].forEach((axis, row) => {
        const scale = row < 2 ? 1 / radius : -0.25 / radius;
        for (let k = 0; k < 3; k++) sun[4 * k + row] = scale * axis[k];
        sun[12 + row] = -scale * dot(axis, place);
      });
      sun[15] = 1;
      gl.bindFramebuffer(gl.FRAMEBUFFER, seenByLight);
      gl.viewport(0, 0, texels, texels);
      gl.clear(gl.DEPTH_BUFFER_BIT);
      gl.uniformMatrix4fv(use("depth").camera, false, sun);
      act();
      gl.bindFramebuffer(gl.FRAMEBUFFER, null);
      gl.viewport(0, 0, canvas.width, canvas.height);
      const at = use("ground");
      gl.uniformMatrix4fv(at.sun, false, sun);
      gl.uniform1f(at.dim, dim);
    }

    // Where the ground is known, and patches of other friction on it: rectangles in axes of their
    // own, painted onto a texture.
    const grip = gl.createTexture();
    function lay(patches) {
      gl.activeTexture(gl.TEXTURE1);
      gl.bindTexture(gl.TEXTURE_2D, grip);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
      for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
      const sheet = document.createElement("canvas");
      sheet.width = sheet.height = patches ? 1024 : 1;
      if (patches) {
        const [[u0, u1, v0, v1], pen] = [patches.box, sheet.getContext("2d")];
        pen.fillRect(0, 0, 1024, 1024);
        pen.scale(1024 / (u1 - u0), 1024 / (v1 - v0));
        for (const [a, b, c, d, ratio] of patches.each) {
          const share = (part) => Math.round(255 * Math.min(Math.max(part, 0), 1));
          pen.fillStyle = `rgb(${share(1 - ratio)}, ${share(ratio - 1)}, 0)`;
          pen.fillRect(a - u0, c - v0, b - a, d - c);
        }
      }
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, sheet);
      gl.activeTexture(gl.TEXTURE0);
    }

    // The same for the programs, before the ground is drawn; `border` is x and y, from and to.
    function ground(patches, border, line) {
      const [u0, u1, v0, v1] = patches ? patches.box : [0, 1, 0, 1];
      const yaw = patches ? patches.yaw : 0;
      const at = use("ground");
      gl.uniform4f(at.field, u0, v0, patches ? 1 / (u1 - u0) : 0, patches ? 1 / (v1 - v0) : 0);
      gl.uniform2f(at.turn, Math.cos(yaw), Math.sin(yaw));
      gl.uniform4f(at.border, border[0], border[2], border[1], border[3]);
      gl.uniform3fv(at.line, line);
    }

    return { gl, POSES, shapes, solid, forget, draw, fan, ribbons, fit, begin, lay, ground, shadows };
  };

  Object.assign(Phasmid.drawing, { look, bySoftware, LIGHT });
})();
