// The page: draws the walking robot, and takes what its visitor does.

import loadMujoco from "./mujoco.js";
import { SHOVE, Walker } from "./walker.js";

const { algebra, camera: newCamera, drawing: newDrawing, input, marks: newMarks } = globalThis.Phasmid;
const { unpacked, add, less, times, vector, pose } = algebra;
const CRUISE = [0.08, 0, 0]; // m/s: the command until the visitor gives one
const IMPULSE = 3; // N s, of a push
const SHOWN = 0.8; // s for which a push is shown
const SLOW = 0.2; // simulated seconds per second in slow motion
const BUDGET = 12; // ms of a picture for the physics; the rest of a slow machine's time is dropped
const AFTER_FALL = 1.5; // s
const TRAIL = [0.04, 40]; // s between the points of a foot's trail, and their number
const byId = (id) => document.getElementById(id);
const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;

function say(text) {
  byId("status").textContent = text;
  byId("status").hidden = text === "";
}

const read = async (name, kind = "json") => {
  const answer = await fetch(name);
  if (!answer.ok) throw new Error(`${name} is missing`);
  return answer[kind]();
};

async function begin() {
  const [scene, task, packedLayers, xml, mujoco] = await Promise.all([
    read("scene.json"), read("task.json"), read("policy.json"), read("robot.xml", "text"), loadMujoco(),
  ]);
  const layers = packedLayers.map(({ weights, biases }) => ({ weights: unpacked(weights), biases: unpacked(biases) }));
  const walker = new Walker(mujoco, xml, task, layers);
  const soft = newDrawing.bySoftware();
  const canvas = byId("view");
  const drawing = newDrawing(canvas, { antialias: !soft });
  if (!drawing) throw new Error("this browser has no WebGL 2");
  run(walker, scene, canvas, drawing, soft);
}

function run(walker, scene, canvas, drawing, soft) {
  const marks = newMarks(drawing, scene, { rough: soft });
  const camera = newCamera(canvas, () => {});
  const bodies = scene.bodies.map((name) => walker.bodyNumber(name));
  const bars = scene.names.map((name, leg) => bar(name, scene.legs[leg]));
  let colours = newDrawing.look();
  let place = null; // where the camera looks
  let trail = []; // places of all feet, and their time
  let push = null; // the arrow of the last push, and until when it is drawn
  let speed = 1; // simulated seconds per second
  let owed = 0; // simulated time that is to be computed [s]
  let previous = performance.now();
  let fallenAt = null;
  const shownAt = []; // times of the last second's pictures, and of the robot then

  const reset = () => {
    walker.reset();
    [place, trail, push, fallenAt, owed] = [null, [], null, null, 0];
    shownAt.length = 0;
    camera.choose("corner", 0);
    // A narrow picture is mostly ground: nearer.
    if (canvas.clientWidth < canvas.clientHeight) camera.zoom = 0.75;
    say("");
  };
  camera.largest = 1.9 * marks.span;
  walker.command = calm ? [0, 0, 0] : CRUISE;
  reset();

  input(({ at }) => (walker.command = at.map((share, axis) => share * walker.largest[axis])), {
    halt: () => (walker.command = [0, 0, 0]),
    pause: () => byId("push").click(),
    reset,
  });
  byId("push").addEventListener("click", () => {
    const angle = 2 * Math.PI * Math.random();
    const impulse = [IMPULSE * Math.cos(angle), IMPULSE * Math.sin(angle)];
    walker.push(impulse);
    push = { impulse, end: walker.time + SHOWN };
    say(`Pushed by ${Math.round(IMPULSE / SHOVE)} N for ${SHOVE} s`);
  });
  byId("slow").addEventListener("click", ({ currentTarget }) => {
    speed = speed === 1 ? SLOW : 1;
    currentTarget.setAttribute("aria-pressed", String(speed !== 1));
  });
  byId("reset").addEventListener("click", reset);
  // Arrow keys drive while the stick has the focus.
  document.addEventListener("pointerup", () => byId("stick").focus({ preventScroll: true }));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => (colours = newDrawing.look()));
  canvas.addEventListener("webglcontextlost", () => location.reload());
  for (const id of ["readings", "feet", "drive", "buttons"]) byId(id).hidden = false;
  byId("stick").focus({ preventScroll: true });
  requestAnimationFrame(frame);

  // What a slow machine cannot compute in time is dropped: the robot is slower, its time steps never longer.
  function simulate(seconds) {
    const until = performance.now() + BUDGET;
    for (owed += Math.min(seconds, 0.1) * speed; owed >= walker.timeStep; owed -= walker.timeStep) {
      if (walker.fell || performance.now() > until) {
        owed = 0;
        return;
      }
      walker.advance();
    }
  }

  function frame(stamp) {
    requestAnimationFrame(frame);
    const seconds = Math.max(stamp - previous, 0) / 1000;
    previous = stamp;
    simulate(seconds);
    if (walker.fell && fallenAt === null) {
      fallenAt = stamp;
      say("The robot fell. It starts again.");
    }
    if (fallenAt !== null && stamp - fallenAt > 1000 * AFTER_FALL) reset();
    if (push && walker.time > push.end) {
      push = null;
      say("");
    }
    shownAt.push([stamp, walker.time]);
    while (shownAt[0][0] < stamp - 1000) shownAt.shift();
    paint(seconds);
    tell(stamp);
  }

  // The pose of a body in the world.
  const X = (body) => pose(vector(walker.data.xpos, body), walker.data.xquat.subarray(4 * body, 4 * body + 4));

  function paint(seconds) {
    drawing.fit(soft ? 0.75 : Math.min(window.devicePixelRatio || 1, 2));
    const body = walker.position;
    const feet = walker.feet;
    const wanted = [body[0], body[1], 0.5 * body[2]];
    const part = place ? 1 - Math.exp(-seconds / 0.25) : 1;
    place = place ? add(place, times(less(wanted, place), part)) : wanted;
    const X_links = bodies.map(X);
    const seen = camera.sight(place);
    const standing = feet.filter(({ isDown }) => isDown).map(({ position }) => position);
    drawing.begin(seen, colours);
    marks.ground(X(walker.trunk), X_links, seen, colours, true);
    marks.support(standing, true, seen, colours);
    marks.machine(X(walker.trunk), X_links);
    if (!trail.length || walker.time - trail[trail.length - 1].time > TRAIL[0]) trail.push({ time: walker.time, feet });
    if (trail.length > TRAIL[1]) trail.shift();
    marks.trails(feet.map((_, leg) => [...trail, { feet }].flatMap((then) => then.feet[leg].position)), seen);
    marks.arrows(feet.map(({ position }) => position), feet.map(({ force }) => force));
    if (push) paintPush(body);
  }

  // An arrow whose head touches the trunk.
  function paintPush(body) {
    const force = times([...push.impulse, 0], scene.weight / IMPULSE);
    const length = scene.force_length * scene.span;
    const tail = less([body[0], body[1], body[2] + 0.03], times([...push.impulse, 0], length / IMPULSE));
    marks.arrows(scene.legs.map(() => tail), scene.legs.map((_, leg) => (leg ? [0, 0, 0] : force)), colours.bad, 2);
  }

  function tell(stamp) {
    const [first, then] = shownAt[0];
    const pace = stamp > first ? (1000 * (walker.time - then)) / (stamp - first) : speed;
    const millimetres = (value) => `${Math.round(1000 * value) || 0} mm/s`;
    byId("speed").textContent = millimetres(walker.velocity[0]);
    byId("wanted").textContent = millimetres(walker.command[0]);
    byId("place").textContent = walker.position.slice(0, 2).map((value) => value.toFixed(2)).join(", ") + " m";
    byId("time").textContent = `${walker.time.toFixed(1)} s`;
    byId("pace").textContent = `${pace.toFixed(2)} ×`;
    byId("frames").textContent = `${shownAt.length} /s`;
    walker.feet.forEach(({ force }, leg) => {
      bars[leg].style.transform = `scaleX(${Math.min((2 * force[2]) / scene.weight, 1).toFixed(3)})`;
    });
  }
}

// The bar of a foot's force, full at half the robot's weight.
function bar(name, colour) {
  const row = document.createElement("div");
  row.append(Object.assign(document.createElement("span"), { textContent: name }));
  const track = row.appendChild(document.createElement("i"));
  const fill = track.appendChild(document.createElement("b"));
  fill.style.background = colour;
  byId("feet").append(row);
  return fill;
}

begin().catch((error) => say(`The demo cannot start: ${error.message}.`));
