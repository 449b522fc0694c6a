"use strict";
// Drawing of solids, lines and ground: plain WebGL 2 and no library, so that no page needs a network.

(() => {
  const { unit, rgb, IDENTITY } = Phasmid.algebra;

  const VERTEX = `#version 300 es
    in vec3 corner; in vec4 tint;
    uniform mat4 model, camera; uniform vec3 light; uniform float squash, level;
    out vec3 world; out vec4 own;
    void main() {
      vec4 place = model * vec4(corner, 1.0);
      // A shadow is the thing itself, pressed along the light onto the ground.
      if (squash > 0.5) place.xyz -= light * (place.z - level) / light.z;
      world = place.xyz; own = tint;
      gl_Position = camera * place;
    }`;

  const HEAD = `#version 300 es
    precision highp float;
    in vec3 world; in vec4 own; out vec4 colour;
    uniform vec4 paint; uniform vec3 eye, light, middle, back, line; uniform float reach, uneven;`;

  // What a piece of paint is for: as it is, lit, or ground with its grid. Each has a program of
  // its own, as a processor that draws would follow all branches of one.
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
  };

  const LIGHT = unit([-0.42, -0.38, 0.82]);
  const UNIFORMS = [
    "model", "camera", "squash", "level", "paint", "eye", "light", "middle", "back", "line", "reach", "uneven",
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

    // Colours of its corners are multiplied with the paint; without any it is all paint.
    function solid({ vertices, faces, tints }) {
      const array = gl.createVertexArray();
      const buffers = [gl.createBuffer(), gl.createBuffer(), gl.createBuffer()];
      gl.bindVertexArray(array);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffers[0]);
      gl.bufferData(gl.ARRAY_BUFFER, vertices, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(0);
      gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
      if (tints) {
        gl.bindBuffer(gl.ARRAY_BUFFER, buffers[2]);
        gl.bufferData(gl.ARRAY_BUFFER, tints, gl.STATIC_DRAW);
        gl.enableVertexAttribArray(1);
        gl.vertexAttribPointer(1, 4, gl.UNSIGNED_BYTE, true, 0, 0);
      }
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffers[1]);
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, faces, gl.STATIC_DRAW);
      gl.bindVertexArray(null);
      const kind = faces instanceof Uint32Array ? gl.UNSIGNED_INT : gl.UNSIGNED_SHORT;
      return { array, buffers, count: faces.length, kind };
    }

    function forget({ array, buffers }) {
      gl.deleteVertexArray(array);
      buffers.forEach((buffer) => gl.deleteBuffer(buffer));
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
      return solid({ vertices: new Float32Array(vertices), faces: new Uint16Array(faces) });
    }

    const rings = [];
    for (let k = 0; k <= 12; k++) rings.push([Math.sin((Math.PI * k) / 12), -Math.cos((Math.PI * k) / 12)]);
    const shapes = {
      shaft: turned([[0, 0], [1, 0], [1, 1], [0, 1]], 12),
      cone: turned([[0, 0], [1, 0], [0, 1]], 16),
      funnel: turned([[0, 0], [1, 1]], 32),
      ball: turned(rings, 20),
      disc: turned([[0, 0], [1, 0]], 32),
      flat: solid({
        vertices: new Float32Array([-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0]),
        faces: new Uint16Array([0, 1, 2, 0, 2, 3]),
      }),
    };

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

    function draw(thing, model, paint, kind) {
      const at = use(kind);
      gl.vertexAttrib4f(1, 1, 1, 1, 1);
      gl.bindVertexArray(thing.array);
      gl.uniformMatrix4fv(at.model, false, model);
      gl.uniform4fv(at.paint, paint);
      gl.drawElements(gl.TRIANGLES, thing.count, thing.kind, 0);
    }

    function drawLoose(count, how) {
      const at = use("plain");
      gl.bindVertexArray(loose);
      gl.bindBuffer(gl.ARRAY_BUFFER, looseBuffer);
      gl.bufferData(gl.ARRAY_BUFFER, sheet.subarray(0, 7 * count), gl.STREAM_DRAW);
      gl.uniformMatrix4fv(at.model, false, IDENTITY);
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

    // A line of some width that faces the eye, through numbers three by three; it fades from one
    // opacity to another.
    function ribbon(points, width, colour, eye, from = 1, to = from) {
      const count = points.length / 3;
      if (count < 2) return;
      room(2 * count);
      for (let k = 0; k < count; k++) {
        const a = 3 * Math.max(k - 1, 0);
        const b = 3 * Math.min(k + 1, count - 1);
        const [x, y, z] = [points[3 * k], points[3 * k + 1], points[3 * k + 2]];
        const [dx, dy, dz] = [points[b] - points[a], points[b + 1] - points[a + 1], points[b + 2] - points[a + 2]];
        const [ex, ey, ez] = [eye[0] - x, eye[1] - y, eye[2] - z];
        const [sx, sy, sz] = [dy * ez - dz * ey, dz * ex - dx * ez, dx * ey - dy * ex];
        const half = width / 2 / Math.max(Math.hypot(sx, sy, sz), 1e-12);
        const alpha = from + ((to - from) * k) / (count - 1);
        corner(2 * k, x - sx * half, y - sy * half, z - sz * half, colour, alpha);
        corner(2 * k + 1, x + sx * half, y + sy * half, z + sz * half, colour, alpha);
      }
      drawLoose(2 * count, gl.TRIANGLE_STRIP);
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

    return { gl, shapes, solid, forget, draw, fan, ribbon, fit, begin, lay, shadows };
  };

  Phasmid.drawing.look = look;
})();
