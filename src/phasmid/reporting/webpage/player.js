"use strict";
// The replay of a run: plain WebGL 2 and no library, so that the page needs no network.

(() => {
  const scene = JSON.parse(document.getElementById("scene").textContent);
  const canvas = document.getElementById("view");
  const gl = canvas.getContext("webgl2", { antialias: true, stencil: true, alpha: false });
  if (!scene || !gl) return;

  // ------------------------------------------------------------------ numbers

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

  // Matrices of 4 by 4, column by column, as WebGL takes them.
  function product(a, b) {
    const c = new Float32Array(16);
    for (let j = 0; j < 4; j++)
      for (let i = 0; i < 4; i++)
        c[4 * j + i] =
          a[i] * b[4 * j] + a[4 + i] * b[4 * j + 1] + a[8 + i] * b[4 * j + 2] + a[12 + i] * b[4 * j + 3];
    return c;
  }

  function pose(p, [w, x, y, z]) {
    return new Float32Array([
      1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y), 0,
      2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x), 0,
      2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y), 0,
      p[0], p[1], p[2], 1,
    ]);
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

  // ------------------------------------------------------------------ the run

  const time = unpacked(scene.time);
  const bodyPosition = unpacked(scene.body_position);
  const bodyOrientation = unpacked(scene.body_orientation);
  const linkPosition = unpacked(scene.link_position);
  const linkOrientation = unpacked(scene.link_orientation);
  const feetRelative = unpacked(scene.feet);
  const forces = unpacked(scene.forces);
  const down = unpacked(scene.down);
  const centre = unpacked(scene.centre);
  const below = unpacked(scene.below);
  const margin = unpacked(scene.margin);
  const count = time.length;
  const links = scene.link_position.shape[1];
  const legs = scene.legs.length;
  const first = time[0];
  const last = time[count - 1];

  // Feet in the world, since they are kept from the body's place.
  let feet = null;
  if (feetRelative) {
    feet = new Float32Array(feetRelative.length);
    for (let i = 0; i < feet.length; i++)
      feet[i] = feetRelative[i] + bodyPosition[3 * Math.floor(i / (3 * legs)) + (i % 3)];
  }

  const vector = (array, index) => [array[3 * index], array[3 * index + 1], array[3 * index + 2]];

  function between(array, width, columns, column, at) {
    const out = new Array(width);
    const a = (at.frame * columns + column) * width;
    const b = (at.next * columns + column) * width;
    for (let k = 0; k < width; k++) out[k] = array[a + k] + at.part * (array[b + k] - array[a + k]);
    return out;
  }

  function turn(array, columns, column, at) {
    const a = (at.frame * columns + column) * 4;
    const b = (at.next * columns + column) * 4;
    let sign = 0;
    for (let k = 0; k < 4; k++) sign += array[a + k] * array[b + k];
    sign = sign < 0 ? -1 : 1;
    const q = [0, 1, 2, 3].map((k) => array[a + k] + at.part * (sign * array[b + k] - array[a + k]));
    const length = Math.hypot(...q);
    return q.map((v) => v / length);
  }

  function moment(t) {
    let low = 0;
    let high = count - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (time[middle] <= t) low = middle;
      else high = middle;
    }
    const next = Math.min(low + 1, count - 1);
    const step = time[next] - time[low];
    const part = step > 0 ? Math.min(Math.max((t - time[low]) / step, 0), 1) : 0;
    return { frame: low, next, part, near: part < 0.5 ? low : next };
  }

  // ------------------------------------------------------------------ drawing

  const VERTEX = `#version 300 es
    in vec3 corner; in vec4 tint;
    uniform mat4 model, camera; uniform vec3 shadow; uniform float squash, level;
    out vec3 world; out vec4 own;
    void main() {
      vec4 place = model * vec4(corner, 1.0);
      // A shadow is the thing itself, pressed along the light onto the ground.
      if (squash > 0.5) place.xyz -= shadow * (place.z - level) / shadow.z;
      world = place.xyz; own = tint;
      gl_Position = camera * place;
    }`;

  const FRAGMENT = `#version 300 es
    precision highp float;
    in vec3 world; in vec4 own; out vec4 colour;
    uniform vec4 paint; uniform int mode; uniform vec3 eye, light, middle, back, line; uniform float reach;
    float grid(vec2 place, float spacing) {
      vec2 cell = abs(fract(place / spacing - 0.5) - 0.5) * spacing;
      vec2 wide = max(fwidth(place), vec2(1e-5));
      vec2 near = 1.0 - smoothstep(vec2(0.2), vec2(1.1), cell / wide);
      return max(near.x, near.y) * clamp(0.25 * spacing / max(wide.x, wide.y), 0.0, 1.0);
    }
    void main() {
      if (mode == 0) { colour = paint * own; return; }
      vec3 normal = normalize(cross(dFdx(world), dFdy(world)));
      if (mode == 1) {
        float facing = max(dot(normal, light), 0.0);
        vec3 toEye = normalize(eye - world);
        float gloss = 0.16 * pow(max(dot(normal, normalize(toEye + light)), 0.0), 24.0);
        float rim = 0.10 * pow(1.0 - max(dot(normal, toEye), 0.0), 3.0);
        float bright = 0.34 + 0.26 * (0.5 + 0.5 * normal.z) + 0.56 * facing;
        colour = vec4(paint.rgb * bright + gloss + rim, 1.0);
        return;
      }
      float shade = mode == 3 ? 0.72 + 0.34 * max(dot(normal, light), 0.0) : 1.0;
      float lines = 0.65 * grid(world.xy, 0.1) + 0.35 * grid(world.xy, 0.5);
      float fade = mode == 3 ? 0.0 : smoothstep(0.35, 1.0, length(world.xy - middle.xy) / reach);
      colour = vec4(mix(mix(paint.rgb * shade, line, lines), back, fade), 1.0);
    }`;

  function program(vertex, fragment) {
    const made = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(made, shader);
    }
    gl.bindAttribLocation(made, 0, "corner");
    gl.bindAttribLocation(made, 1, "tint");
    gl.linkProgram(made);
    return made;
  }

  const drawing = program(VERTEX, FRAGMENT);
  gl.useProgram(drawing);
  const at = {};
  for (const name of ["model", "camera", "shadow", "squash", "level", "paint", "mode", "eye", "light", "middle", "back", "line", "reach"])
    at[name] = gl.getUniformLocation(drawing, name);

  function solid(vertices, faces) {
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, vertices, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, faces, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    const kind = faces instanceof Uint32Array ? gl.UNSIGNED_INT : gl.UNSIGNED_SHORT;
    return { array, count: faces.length, kind };
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
    return solid(new Float32Array(vertices), new Uint16Array(faces));
  }

  const shaft = turned([[0, 0], [1, 0], [1, 1], [0, 1]], 20);
  const cone = turned([[0, 0], [1, 0], [0, 1]], 24);
  const ballRings = [];
  for (let k = 0; k <= 12; k++) ballRings.push([Math.sin((Math.PI * k) / 12), -Math.cos((Math.PI * k) / 12)]);
  const ball = turned(ballRings, 20);
  const disc = turned([[0, 0], [1, 0]], 32);
  const meshes = scene.meshes.map((mesh) => solid(unpacked(mesh.vertices), unpacked(mesh.faces)));
  const ground = scene.ground ? solid(unpacked(scene.ground.vertices), unpacked(scene.ground.faces)) : null;
  const flat = solid(new Float32Array([-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0]), new Uint16Array([0, 1, 2, 0, 2, 3]));

  const loose = gl.createVertexArray();
  const looseBuffer = gl.createBuffer();
  gl.bindVertexArray(loose);
  gl.bindBuffer(gl.ARRAY_BUFFER, looseBuffer);
  gl.enableVertexAttribArray(0);
  gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 28, 0);
  gl.enableVertexAttribArray(1);
  gl.vertexAttribPointer(1, 4, gl.FLOAT, false, 28, 12);
  gl.bindVertexArray(null);

  const IDENTITY = pose([0, 0, 0], [1, 0, 0, 0]);
  const LIGHT = unit([-0.42, -0.38, 0.82]);

  function draw(thing, model, paint, mode) {
    gl.vertexAttrib4f(1, 1, 1, 1, 1);
    gl.bindVertexArray(thing.array);
    gl.uniformMatrix4fv(at.model, false, model);
    gl.uniform4fv(at.paint, paint);
    gl.uniform1i(at.mode, mode);
    gl.drawElements(gl.TRIANGLES, thing.count, thing.kind, 0);
  }

  function drawLoose(numbers, how) {
    if (!numbers.length) return;
    gl.bindVertexArray(loose);
    gl.bindBuffer(gl.ARRAY_BUFFER, looseBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(numbers), gl.STREAM_DRAW);
    gl.uniformMatrix4fv(at.model, false, IDENTITY);
    gl.uniform4fv(at.paint, [1, 1, 1, 1]);
    gl.uniform1i(at.mode, 0);
    gl.drawArrays(how, 0, numbers.length / 7);
  }

  // A line of some width that faces the eye, as one strip.
  function ribbon(points, width, colour, opacity, eye) {
    const numbers = [];
    points.forEach((point, k) => {
      const before = points[Math.max(k - 1, 0)];
      const after = points[Math.min(k + 1, points.length - 1)];
      const side = times(unit(cross(less(after, before), less(eye, point))), width / 2);
      const alpha = typeof opacity === "function" ? opacity(k / (points.length - 1)) : opacity;
      numbers.push(...less(point, side), ...colour, alpha, ...add(point, side), ...colour, alpha);
    });
    drawLoose(numbers, gl.TRIANGLE_STRIP);
  }

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

  let look = {};
  function readLook() {
    const style = getComputedStyle(document.documentElement);
    const read = (name) => rgb(style.getPropertyValue(name));
    look = {
      back: read("--stage"), floor: read("--stage-floor"), line: read("--stage-line"),
      good: read("--good"), bad: read("--bad"), centre: read("--stage-mark"),
      dark: style.getPropertyValue("--scheme").trim() === "dark",
    };
  }

  const legColours = scene.legs.map(rgb);
  const force = rgb(scene.force_colour);
  const span = scene.span || 0.2;

  // ------------------------------------------------------------------ camera

  let largest = 1.6 * span;
  if (feetRelative)
    for (let k = 0; k < legs; k++) largest = Math.max(largest, size(vector(feetRelative, scene.start * legs + k)));
  const FIELD = (30 * Math.PI) / 180;
  const startTurn = turn(bodyOrientation, 1, 0, { frame: scene.start, next: scene.start, part: 0 });
  const startYaw = Math.atan2(
    2 * (startTurn[0] * startTurn[3] + startTurn[1] * startTurn[2]),
    1 - 2 * (startTurn[2] ** 2 + startTurn[3] ** 2),
  );
  const VIEWS = {
    corner: [-56, 27], side: [-90, 8], front: [0, 10], behind: [180, 24], above: [-90, 89],
  };
  const camera = { azimuth: 0, elevation: 0, zoom: 1 };

  function choose(name) {
    const [azimuth, elevation] = VIEWS[name];
    camera.azimuth = startYaw + (azimuth * Math.PI) / 180;
    camera.elevation = (elevation * Math.PI) / 180;
    camera.zoom = 1;
  }
  choose(scene.level === null ? "behind" : "corner");

  function sight(target) {
    const aspect = canvas.width / canvas.height;
    const distance = (0.84 * largest * camera.zoom) / Math.tan(FIELD / 2) / Math.min(1, aspect / 1.25);
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
    return { eye, matrix: product(lens, place), distance };
  }

  // ------------------------------------------------------------------ one picture

  const byId = (id) => document.getElementById(id);
  const shown = (name) => { const box = byId(`show-${name}`); return box && box.checked; };
  let now = time[scene.start];
  const labels = scene.legs.map((colour, leg) => {
    const label = document.createElement("span");
    label.className = "leg-label";
    label.textContent = String(leg + 1);
    label.style.color = colour;
    label.setAttribute("aria-hidden", "true");
    canvas.parentElement.append(label);
    return label;
  });

  function paintAll() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const wide = Math.max(Math.round(canvas.clientWidth * ratio), 1);
    const high = Math.max(Math.round(canvas.clientHeight * ratio), 1);
    if (canvas.width !== wide || canvas.height !== high) [canvas.width, canvas.height] = [wide, high];
    const here = moment(now);
    const body = between(bodyPosition, 3, 1, 0, here);
    const X_world_body = pose(body, turn(bodyOrientation, 1, 0, here));
    const X_links = [];
    for (let k = 0; k < links; k++)
      X_links.push(product(X_world_body, pose(between(linkPosition, 3, links, k, here), turn(linkOrientation, links, k, here))));
    const where = shown("follow") ? body : vector(bodyPosition, scene.start);
    const standing = feet ? Math.min(...legColours.map((_, k) => between(feet, 3, legs, k, here)[2])) : body[2] - span;
    const target = [where[0], where[1], where[2] - 0.35 * Math.max(body[2] - standing, 0)];
    const seen = sight(target);

    gl.viewport(0, 0, wide, high);
    gl.clearColor(...look.back, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.uniformMatrix4fv(at.camera, false, seen.matrix);
    gl.uniform3fv(at.eye, seen.eye);
    gl.uniform3fv(at.light, LIGHT);
    gl.uniform3fv(at.shadow, LIGHT);
    gl.uniform1f(at.squash, 0);
    gl.uniform3fv(at.middle, target);
    gl.uniform3fv(at.back, look.back);
    gl.uniform3fv(at.line, look.line);
    const reach = 2.4 * seen.distance;
    gl.uniform1f(at.reach, reach);
    if (ground) draw(ground, IDENTITY, [...look.floor, 1], 3);
    else {
      const model = Float32Array.from(IDENTITY);
      model[0] = model[5] = 1.05 * reach;
      [model[12], model[13], model[14]] = [target[0], target[1], scene.level];
      gl.disable(gl.DEPTH_TEST);
      draw(flat, model, [...look.floor, 1], 2);
      gl.enable(gl.DEPTH_TEST);
    }
    const pieces = scene.pieces.map((piece) => [meshes[piece.mesh], piece.link < 0 ? X_world_body : X_links[piece.link], piece.colour]);
    gl.enable(gl.BLEND);
    if (!ground) {
      gl.enable(gl.STENCIL_TEST);
      gl.stencilFunc(gl.EQUAL, 0, 255);
      gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
      gl.disable(gl.DEPTH_TEST);
      gl.uniform1f(at.squash, 1);
      gl.uniform1f(at.level, scene.level);
      for (const [mesh, model] of pieces) draw(mesh, model, [0, 0, 0, look.dark ? 0.42 : 0.2], 0);
      gl.uniform1f(at.squash, 0);
      gl.disable(gl.STENCIL_TEST);
      gl.enable(gl.DEPTH_TEST);
    }
    paintSupport(here, seen);
    gl.disable(gl.BLEND);
    for (const [mesh, model, colour] of pieces) draw(mesh, model, [...colour, 1], 1);
    gl.enable(gl.BLEND);
    paintTrails(here, seen);
    gl.disable(gl.BLEND);
    paintForces(here);
    paintCentre(here, seen, body);
    paintLabels(seen, X_links);
    tell(here);
  }

  function feetDown(here) {
    const found = [];
    if (feet && down)
      for (let leg = 0; leg < legs; leg++)
        if (down[here.near * legs + leg]) found.push(between(feet, 3, legs, leg, here));
    return found;
  }

  function paintSupport(here, seen) {
    if (!shown("support") || !feet || !down) return;
    const corners = hull(feetDown(here));
    if (corners.length < 3) return;
    const safe = !margin || margin[here.near] >= 0;
    const colour = safe ? look.good : look.bad;
    gl.disable(gl.DEPTH_TEST);
    const fan = [];
    for (const corner of corners) fan.push(...corner, ...colour, 0.22);
    drawLoose(fan, gl.TRIANGLE_FAN);
    corners.forEach((corner, k) =>
      ribbon([corner, corners[(k + 1) % corners.length]], 0.012 * span, colour, 0.9, seen.eye));
    gl.enable(gl.DEPTH_TEST);
  }

  function paintTrails(here, seen) {
    if (!shown("trails") || !feet) return;
    const begin = moment(Math.max(now - scene.trail, first)).frame;
    const stride = Math.max(1, Math.ceil((here.frame - begin) / 160));
    gl.depthMask(false);
    for (let leg = 0; leg < legs; leg++) {
      const points = [];
      for (let k = begin; k <= here.frame; k += stride) points.push(vector(feet, k * legs + leg));
      points.push(between(feet, 3, legs, leg, here));
      if (points.length > 1) ribbon(points, 0.022 * span, legColours[leg], (part) => 0.15 + 0.8 * part, seen.eye);
    }
    gl.depthMask(true);
  }

  function paintForces(here) {
    if (!shown("forces") || !forces || !feet) return;
    // As in the still picture they lie over everything; only their own far sides are hidden.
    gl.disable(gl.DEPTH_TEST);
    gl.enable(gl.CULL_FACE);
    for (let leg = 0; leg < legs; leg++) {
      const newtons = between(forces, 3, legs, leg, here);
      if (size(newtons) < 0.01 * scene.weight) continue;
      const foot = between(feet, 3, legs, leg, here);
      const arrow = times(newtons, (scene.force_length * span) / scene.weight);
      const length = size(arrow);
      const head = Math.min(0.13 * span, 0.6 * length);
      const neck = add(foot, times(arrow, (length - head) / length));
      draw(shaft, along(foot, arrow, 0.018 * span, length - head), [...force, 1], 1);
      draw(cone, along(neck, arrow, 0.05 * span, head), [...force, 1], 1);
    }
    gl.disable(gl.CULL_FACE);
    gl.enable(gl.DEPTH_TEST);
  }

  function paintCentre(here, seen, body) {
    if (!shown("centre") || !centre) return;
    const place = add(between(centre, 3, 1, 0, here), body);
    const ground = [place[0], place[1], body[2] + between(below, 1, 1, 0, here)[0] + 0.002 * span];
    const safe = !margin || margin[here.near] >= 0;
    const paint = [...(safe ? look.centre : look.bad), 1];
    const here3 = (p, r) => along(p, [0, 0, 1], r, r);
    // It lies within the body, so that it is drawn over everything.
    gl.disable(gl.DEPTH_TEST);
    draw(disc, here3(ground, 0.055 * span), [...look.back, 1], 0);
    draw(disc, here3(ground, 0.04 * span), paint, 0);
    ribbon([ground, place], 0.01 * span, paint.slice(0, 3), 1, seen.eye);
    draw(ball, here3(place, 0.035 * span), paint, 0);
    gl.enable(gl.DEPTH_TEST);
  }

  function paintLabels(seen, X_links) {
    labels.forEach((label, leg) => {
      const knee = scene.knees[leg];
      const on = knee >= 0 && shown("names");
      label.hidden = !on;
      if (!on) return;
      const X = X_links[knee];
      const p = [X[12], X[13], X[14] + 0.13 * span, 1];
      const m = seen.matrix;
      const row = (k) => m[k] * p[0] + m[4 + k] * p[1] + m[8 + k] * p[2] + m[12 + k];
      const x = (0.5 + (0.5 * row(0)) / row(3)) * canvas.clientWidth;
      const y = (0.5 - (0.5 * row(1)) / row(3)) * canvas.clientHeight;
      const within = x > 8 && y > 8 && x < canvas.clientWidth - 8 && y < canvas.clientHeight - 8;
      label.hidden = !within;
      label.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px) translate(-50%, -50%)`;
    });
  }

  // ------------------------------------------------------------------ words beside it

  const slider = byId("seek");
  const clock = byId("clock");
  const loads = [...document.querySelectorAll("[data-load]")];

  function tell(here) {
    const text = `${now.toFixed(2)} s`;
    clock.textContent = `${text} of ${last.toFixed(2)} s`;
    slider.value = String(now);
    slider.setAttribute("aria-valuetext", text);
    const told = byId("margin");
    if (told && margin) {
      const value = margin[here.near];
      const none = value < -1e8;
      told.textContent = none ? "fewer than three feet" : `${(1000 * value).toFixed(1)} mm`;
      told.className = value < 0 ? "beyond" : "";
    }
    if (!forces) return;
    let sum = 0;
    loads.forEach((cell, leg) => {
      const newtons = between(forces, 3, legs, leg, here);
      sum += newtons[2];
      cell.textContent = `${Math.max(size(newtons), 0).toFixed(1)} N`;
      cell.parentElement.classList.toggle("swings", Boolean(down) && !down[here.near * legs + leg]);
    });
    const total = byId("load-sum");
    if (total) total.textContent = `${sum.toFixed(1)} N of ${scene.weight.toFixed(1)} N`;
  }

  // ------------------------------------------------------------------ hands

  const button = byId("play");
  let plays = false;
  let asked = false;
  let before = 0;

  function ask() {
    if (asked) return;
    asked = true;
    requestAnimationFrame((stamp) => {
      asked = false;
      if (plays) {
        now += (Math.min((stamp - before) / 1000, 0.25)) * Number(byId("speed").value);
        before = stamp;
        if (now >= last) [now, plays] = [last, false];
        show();
      }
      paintAll();
      if (plays) ask();
    });
  }

  function show() {
    button.textContent = plays ? "Pause" : "Play";
    button.setAttribute("aria-pressed", String(plays));
  }

  function toggle() {
    plays = !plays;
    if (plays && now >= last - 1e-6) now = first;
    before = performance.now();
    show();
    ask();
  }

  function go(t) {
    now = Math.min(Math.max(t, first), last);
    ask();
  }

  function step(frames) {
    plays = false;
    show();
    go(time[Math.min(Math.max(moment(now).near + frames, 0), count - 1)]);
  }

  button.addEventListener("click", toggle);
  byId("back").addEventListener("click", () => step(-1));
  byId("on").addEventListener("click", () => step(1));
  slider.addEventListener("input", () => { plays = false; show(); go(Number(slider.value)); });
  slider.min = String(first);
  slider.max = String(last);
  slider.step = "any";
  byId("view-from").addEventListener("change", (event) => { choose(event.target.value); ask(); });
  byId("view-from").value = scene.level === null ? "behind" : "corner";
  for (const box of document.querySelectorAll("#replay input[type=checkbox]")) box.addEventListener("change", ask);

  const HANDS = {
    " ": toggle,
    ArrowLeft: (event) => (event.shiftKey ? go(now - 1) : step(-1)),
    ArrowRight: (event) => (event.shiftKey ? go(now + 1) : step(1)),
    Home: () => go(first),
    End: () => go(last),
    "+": () => { camera.zoom = Math.max(camera.zoom / 1.15, 0.2); ask(); },
    "-": () => { camera.zoom = Math.min(camera.zoom * 1.15, 5); ask(); },
  };
  byId("replay").addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const kind = event.target.tagName;
    // What a control does with a key of its own stays as it is, but for the slider's.
    if (kind === "SELECT" || kind === "SUMMARY" || kind === "A") return;
    if (event.key === " " && (kind === "BUTTON" || event.target.type === "checkbox")) return;
    const act = HANDS[event.key];
    if (!act) return;
    event.preventDefault();
    act(event);
  });

  const fingers = new Map();
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
      const ratio = apart(old) / Math.max(apart([event.clientX, event.clientY]), 1);
      camera.zoom = Math.min(Math.max(camera.zoom * ratio, 0.2), 5);
    } else {
      camera.azimuth -= (event.clientX - old[0]) * 0.008;
      camera.elevation = Math.min(Math.max(camera.elevation + (event.clientY - old[1]) * 0.008, -0.1), 1.555);
    }
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    ask();
  });
  for (const name of ["pointerup", "pointercancel"])
    canvas.addEventListener(name, (event) => fingers.delete(event.pointerId));
  canvas.addEventListener("wheel", (event) => {
    // Only a picture that was chosen takes the wheel, so that the page still scrolls over it.
    if (document.activeElement !== canvas) return;
    event.preventDefault();
    camera.zoom = Math.min(Math.max(camera.zoom * Math.exp(event.deltaY * 0.001), 0.2), 5);
    ask();
  }, { passive: false });
  canvas.addEventListener("webglcontextlost", (event) => {
    event.preventDefault();
    document.documentElement.classList.remove("plays");
  });

  document.documentElement.classList.add("plays");
  readLook();
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { readLook(); ask(); });
  new ResizeObserver(ask).observe(canvas);
  show();
  ask();
})();

// The data are kept compressed; who has scripts gets the table itself.
(() => {
  const link = document.getElementById("csv");
  if (!link || !window.DecompressionStream) return;
  link.addEventListener("click", (event) => {
    event.preventDefault();
    const bytes = Uint8Array.from(atob(link.href.split(",")[1]), (letter) => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    new Response(stream).blob().then((table) => {
      const plain = document.createElement("a");
      plain.href = URL.createObjectURL(new Blob([table], { type: "text/csv" }));
      plain.download = link.download.replace(/\.gz$/, "");
      plain.click();
      setTimeout(() => URL.revokeObjectURL(plain.href), 60000);
    });
  });
})();
