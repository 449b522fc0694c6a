// The robot, its servos and its policy in MuJoCo: no drawing, and no clock of its own.
//
// Observations, actions and servos are those of phasmid.learning at fast fidelity.

export const SHOVE = 0.1; // s for which a push lasts
const STRIDE = 40; // control periods over which the velocity is averaged: one cycle of the gait

const clip = (value, low, high) => Math.min(Math.max(value, low), high);

// Heading, and the world's vertical in body axes, of an orientation w x y z.
const yawOf = ([w, x, y, z]) => Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
const upOf = ([w, x, y, z]) => [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)];

// Actions for observations: dense layers, with ELU between them.
export function infer(layers, observation) {
  return layers.reduce((input, { weights, biases }, layer) => {
    const last = layer === layers.length - 1;
    return Array.from(biases, (bias, row) => {
      let sum = bias;
      for (let k = 0; k < input.length; k++) sum += weights[row * input.length + k] * input[k];
      return last ? clip(sum, -1, 1) : sum > 0 ? sum : Math.expm1(sum);
    });
  }, observation);
}

export class Walker {
  constructor(mujoco, xml, task, layers) {
    Object.assign(this, { mujoco, task, layers });
    this.model = mujoco.MjModel.from_xml_string(xml);
    this.data = new mujoco.MjData(this.model);
    this.timeStep = this.model.opt.timestep;
    this.stepsPerPeriod = Math.round(task.control_period_s / this.timeStep);
    const { forward, left, yaw } = task.task.commands;
    this.largest = [forward, left, yaw];
    this.trunk = this.bodyNumber("trunk");
    this.command = [0, 0, 0]; // forward, left [m/s], yaw rate [rad/s]
    this.reset();
  }

  bodyNumber(name) {
    return this.mujoco.mj_name2id(this.model, this.mujoco.mjtObj.mjOBJ_BODY.value, name);
  }

  // Begin at rest in the neutral stance.
  reset() {
    this.mujoco.mj_resetDataKeyframe(this.model, this.data, 0);
    this.mujoco.mj_forward(this.model, this.data);
    this.target = Array.from(this.task.neutral_rad);
    this.previousTarget = this.target;
    this.action = this.target.map(() => 0);
    this.phase = 0; // of the gait's clock, in cycles
    this.step = 0; // time steps since the start
    this.shove = [0, 0];
    this.shoveEnd = 0;
    this.places = [];
    this.fell = false;
  }

  get isMoving() {
    return this.command.some((value) => value !== 0);
  }

  // Push the trunk with an impulse along the ground [N s].
  push(impulse) {
    this.shove = impulse.map((value) => value / SHOVE);
    this.shoveEnd = this.step + Math.round(SHOVE / this.timeStep);
  }

  observe() {
    const { qpos, qvel } = this.data;
    const angle = 2 * Math.PI * this.phase;
    const isMoving = this.isMoving ? 1 : 0;
    return [
      ...Array.from(qvel.subarray(3, 6), (rate) => rate / 4),
      ...upOf(qpos.subarray(3, 7)).map((share) => -share),
      ...this.task.neutral_rad.map((neutral, joint) => qpos[7 + joint] - neutral),
      ...Array.from(qvel.subarray(6), (speed) => speed / 10),
      ...this.action,
      ...this.command.map((value, axis) => value / this.largest[axis]),
      isMoving * Math.sin(angle),
      isMoving * Math.cos(angle),
    ];
  }

  // Decide the joint targets of the next control period; they change no faster than the servo turns.
  beginPeriod() {
    const { action_scale_rad: scale, largest_target_change_rad: change } = this.task;
    const [lowest, highest] = this.task.joint_limits_rad;
    this.action = infer(this.layers, this.observe());
    this.previousTarget = this.target;
    this.target = this.action.map((action, joint) => {
      const last = this.previousTarget[joint];
      const goal = clip(this.task.neutral_rad[joint] + scale * action, last - change, last + change);
      return clip(goal, lowest[joint], highest[joint]);
    });
    if (this.isMoving) this.phase = (this.phase + this.task.control_period_s / this.task.gait.period_s) % 1;
    const { qpos } = this.data;
    this.places.push([qpos[0], qpos[1], yawOf(qpos.subarray(3, 7))]);
    if (this.places.length > STRIDE + 1) this.places.shift();
  }

  // The servos' delay and friction, which position actuators do not have.
  driveServos(step) {
    const { gain, stall, friction, load_loss: loss, delay } = this.task.motor;
    const { qpos, qvel, ctrl, qfrc_applied: applied } = this.data;
    const goal = step * this.timeStep < delay - 1e-9 ? this.previousTarget : this.target;
    for (let joint = 0; joint < goal.length; joint++) {
      const torque = clip(gain * (goal[joint] - qpos[7 + joint]), -stall, stall);
      ctrl[joint] = goal[joint];
      applied[6 + joint] = -(friction + loss * Math.abs(torque)) * clip(qvel[6 + joint], -1, 1);
    }
  }

  // Advance one time step.
  advance() {
    const step = this.step % this.stepsPerPeriod;
    if (step === 0) this.beginPeriod();
    this.driveServos(step);
    const isPushed = this.step < this.shoveEnd;
    const force = this.data.xfrc_applied;
    for (let axis = 0; axis < 2; axis++) force[6 * this.trunk + axis] = isPushed ? this.shove[axis] : 0;
    this.mujoco.mj_step(this.model, this.data);
    this.step++;
    // Training ends at the same tilt, 1 rad. Only the feet touch the ground: a low trunk lies on it.
    const { qpos } = this.data;
    if (!(upOf(qpos.subarray(3, 7))[2] > Math.cos(1) && qpos[2] > 0.4 * this.task.neutral_height_m)) this.fell = true;
  }

  get time() {
    return this.step * this.timeStep;
  }

  get position() {
    return Array.from(this.data.qpos.subarray(0, 3));
  }

  get heading() {
    return yawOf(this.data.qpos.subarray(3, 7));
  }

  // Mean velocity over the last cycle of the gait: forward, left [m/s], yaw rate [rad/s].
  get velocity() {
    const count = this.places.length - 1;
    if (count < 1) return [0, 0, 0];
    const [[x0, y0, yaw0], [x1, y1, yaw1]] = [this.places[0], this.places[count]];
    const seconds = count * this.task.control_period_s;
    const turn = Math.atan2(Math.sin(yaw1 - yaw0), Math.cos(yaw1 - yaw0));
    const [c, s] = [Math.cos(yaw0 + turn / 2), Math.sin(yaw0 + turn / 2)];
    const [dx, dy] = [(x1 - x0) / seconds, (y1 - y0) / seconds];
    return [c * dx + s * dy, c * dy - s * dx, turn / seconds];
  }

  // Position, contact and force [N] of each foot, in world axes, from the sensors of the model.
  get feet() {
    const { sensordata } = this.data;
    const count = this.task.feet.length;
    return this.task.feet.map((_, leg) => ({
      position: Array.from(sensordata.subarray(4 * count + 3 * leg, 4 * count + 3 * leg + 3)),
      isDown: sensordata[4 * leg] > 0,
      force: Array.from(sensordata.subarray(4 * leg + 1, 4 * leg + 4)),
    }));
  }
}
