"""Numbers of a run: path, slip, load and support of the feet, joints, energy and servos.

Each function returns what is recorded; the summary leaves out what is absent.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid import kinematics
from phasmid.advice import servo_verdict
from phasmid.errors import InvalidInput, Unreachable
from phasmid.experiment.contact_law import STANDING_SPEED
from phasmid.gait import support_margin, sway
from phasmid.kinematics.shared_kernels import turned
from phasmid.recording.channels import walking_command
from phasmid.reporting.run import Run, Source
from phasmid.reporting.steps import (
    away_from_switches,
    durations,
    intervals,
    middle_halves,
    rms,
)
from phasmid.terrain.sliding import find_slide

SHORTEST_DISTANCE = 1e-3
"""Shortest distance with a cost of transport [m]."""


def commanded_way(
    source: Source, duration: float, planned_steps: float | None = None
) -> dict[str, float]:
    """Return the displacement of the body by the stride's steps.

    Each step takes the body by the stride's step, forward, left and around, from where the last
    one left it; in between the body follows the arc through these places.

    Args:
        source: Robot and experiment.
        duration: Time from the start [s].
        planned_steps: Number of steps of the plan in that time; None: at constant pace. A
            rest-to-rest walk is on that pace after every whole step.

    Returns:
        ``steps`` made; ``forward`` and ``sideways`` (left) from the start, in its axes [m];
        ``turn`` to the left [rad]; ``distance`` along the way [m].
    """
    stride = source.experiment.course.stride
    steps = duration / source.step_time if planned_steps is None else planned_steps
    step = np.array([stride.step_length, stride.step_sideways, stride.step_turn])
    forward, sideways, turn = kinematics.step_pose(step, np.array([steps]))[0].tolist()
    return {
        "steps": steps,
        "forward": forward,
        "sideways": sideways,
        "turn": turn,
        "distance": steps * math.hypot(stride.step_length, stride.step_sideways),
    }


def driven_way(run: Run) -> dict[str, float] | None:
    """Return the displacement of the body by the commanded velocities, as `commanded_way`.

    None without a velocity command.
    """
    velocity = run.velocity_command
    if velocity is None:
        return None
    held, v = np.diff(run.time), velocity[:-1]
    yaw = np.cumsum(held * v[:, 2]) - held * v[:, 2] / 2
    forward, sideways = turned(yaw, v[:, 0], v[:, 1])
    return {
        "steps": float(run.time[-1] - run.time[0]) / run.step_time,
        "forward": float(held @ forward),
        "sideways": float(held @ sideways),
        "turn": float(held @ v[:, 2]),
        "distance": float(held @ np.hypot(v[:, 0], v[:, 1])),
    }


def velocity(run: Run) -> dict[str, Any]:
    """Return mean velocities of a driven run in the body's heading: vx, vy [m/s], wz [rad/s].

    Returns:
        The ``commanded`` velocity, the ``feasible`` one where the controller gives it, and the
        ``actual`` one; empty where none was commanded.
    """
    time, found = run.time, {}
    weights = durations(time)
    weights /= weights.sum()
    for name, label in (("velocity_command", "commanded"), ("velocity_reference", "feasible")):
        values = run.channel(name)
        if values is not None:
            found[label] = (weights @ values).tolist()
    v, orientation = run.channel("body_velocity"), run.channel("body_orientation")
    if found and v is not None and orientation is not None and len(time) > 1:
        yaw = np.unwrap(kinematics.quaternion_yaw(orientation))
        vx, vy = turned(-yaw, v[:, 0], v[:, 1])
        wz = (yaw[-1] - yaw[0]) / (time[-1] - time[0])
        found["actual"] = [float(weights @ vx), float(weights @ vy), float(wz)]
    return found


def travel(run: Run) -> dict[str, Any]:
    """Return distance, drift, heading and tilt of the body, and its shares of the commanded motion.

    ``distance_share`` and ``turn_share`` are those of `CommandTracking`.
    """
    time = run.time
    duration = float(time[-1] - time[0])
    # Between waypoints the velocity follows from where the robot is: it commands no path.
    way = {}
    if "waypoints" not in run.recording.attrs:
        ended = duration < run.experiment.duration - run.experiment.solver.time_step
        steps = None if ended else run.recording.attrs.get("planned_steps")
        way = driven_way(run) or commanded_way(run, duration, steps)
    found: dict[str, Any] = {f"commanded_{name}": value for name, value in way.items()}
    position, orientation = run.channel("body_position"), run.channel("body_orientation")
    yaw = np.zeros(len(time))
    if orientation is not None:
        yaw = np.unwrap(kinematics.quaternion_yaw(orientation))
    if position is not None:
        path = position[:, :2]
        # The sway of a driven robot follows its controller's clock.
        if run.gait.sway and not {"trajectory", "controller"} & set(run.recording.attrs):
            neutral, period = (
                kinematics.neutral_feet(run.robot),
                run.experiment.course.stride.period,
            )
            path = sway(run.gait, neutral, period, time).removed_from(position, yaw)
        dx, dy = path[-1] - path[0]
        forward, sideways = map(float, turned(-yaw[0], dx, dy))
        # Chords of one step each follow a curved path without the oscillation within a step.
        # No more chords than samples: times of a damaged file may lie far apart.
        step = max(run.step_time, duration / len(time))
        marks = np.append(np.arange(time[0], time[-1] - 1e-9, step), time[-1])
        places = np.stack([np.interp(marks, time, path[:, k]) for k in range(2)], axis=-1)
        distance = float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())
        height = position[:, 2]
        found |= {
            "distance": distance,
            "forward": forward,
            "sideways": sideways,
            "mean_speed": distance / duration if duration > 0 else math.nan,
            "sideways_drift": sideways - way["sideways"] if way else math.nan,
            "body_height_change": float(height[-1] - height[0]),
            "body_height_range": float(height.max() - height.min()),
        }
        if way and orientation is not None:
            tracking = command_tracking(run, way["steps"], path, orientation)
            found |= {"distance_share": tracking.distance_share, "turn_share": tracking.turn_share}
    if orientation is not None:
        upright = kinematics.quaternion_rotation(orientation)[:, 2, 2]
        found |= {
            "heading_change": float(yaw[-1] - yaw[0]),
            "largest_tilt": float(np.arccos(np.clip(upright, -1, 1)).max()),
        }
    return found


def command_tracking(
    run: Run,
    steps: float,
    path: Float[np.ndarray, "time 2"],
    orientation: Float[np.ndarray, "time 4"],
) -> kinematics.CommandTracking:
    """Return how a body followed its commanded velocity, or the mean one of its plan.

    Args:
        run: The run.
        steps: Number of steps of the plan in its time.
        path: The body without its sway [m], shape (N, 2).
        orientation: w x y z, shape (N, 4).
    """
    time, command = run.time, run.velocity_command
    if command is not None:
        command = walking_command(command, run.channel("sequence"))
        return kinematics.track_command(time, command, path, orientation)
    is_planned = run.is_simulated and "trajectory" not in run.recording.attrs
    if not is_planned or len(time) < 2:
        return kinematics.CommandTracking()
    twist = kinematics.step_twist(run.experiment.course.stride.step) * steps / (time[-1] - time[0])
    return kinematics.track_twist(time, twist, path, orientation)


def state_estimate(run: Run, distance: float | None) -> dict[str, Any]:
    """Return the errors of the estimated position and velocity of the body.

    Odom begins at the true position, x along the body.

    Args:
        run: The run.
        distance: Distance walked [m].

    Returns:
        ``position_error`` at the end [m], ``position_drift``, the same over the distance, and
        ``velocity_error``, the rms of the error's length [m/s]; empty without estimate or truth.
    """
    if not (run.has("body_position") and run.has("body_position_estimated")):
        return {}
    channels = run.recording
    yaw = kinematics.quaternion_yaw(channels["body_orientation"].values[0])
    p, v = (
        np.stack([*turned(-yaw, x, y), z], axis=-1)
        for x, y, z in (channels[name].values.T for name in ("body_position", "body_velocity"))
    )
    p_estimated, v_estimated = (
        channels[f"{name}_estimated"].values for name in ("body_position", "body_velocity")
    )
    error = float(np.linalg.norm((p_estimated[-1] - p_estimated[0]) - (p[-1] - p[0])))
    square = np.sum((v_estimated - v) ** 2, axis=1)
    found = {"position_error": error, "velocity_error": math.sqrt(square.mean())}
    if distance is not None and distance > SHORTEST_DISTANCE:
        found["position_drift"] = error / distance
    return found


def slip(run: Run) -> dict[str, Any]:
    """Return the horizontal displacement of stance feet from touchdown to lift-off, in whole steps.

    A ball's displacement counts without that by which it rolls.

    Returns:
        Mean and largest over all steps [m] and the mean of each leg [m]; empty without feet.
    """
    time = run.time
    feet, stance = run.channel("foot_position"), run.channel("stance")
    if feet is None or stance is None or len(time) < 2:
        return {}
    touching = run.channel("contact")
    standing = stance if touching is None else stance & touching
    moved = np.linalg.norm(contact_displacement(run, feet)[..., :2], axis=-1)
    moved = np.where(standing[1:] & standing[:-1], moved, 0.0)
    widest = float(np.diff(time).max())
    paths: list[list[float]] = []
    for leg in range(stance.shape[1]):
        paths.append([])
        for start, stop in intervals(stance[:, leg]):
            # A whole stance may miss one sample at either end. In a driven run its
            # duration is unknown: stances cut by the ends of the run are left out.
            missing = run.step_time - (time[stop - 1] - time[start])
            whole = missing <= 2.001 * widest
            if "controller" in run.recording.attrs:
                whole = start > 0 and stop < len(stance)
            if whole:
                paths[-1].append(float(moved[start : stop - 1, leg].sum()))
    everything = [path for leg in paths for path in leg]
    if not everything:
        return {}
    return {
        "steps": len(everything),
        "mean": float(np.mean(everything)),
        "largest": max(everything),
        "mean_by_leg": [float(np.mean(leg)) if leg else np.nan for leg in paths],
    }


def contact_displacement(
    run: Run, feet: Float[np.ndarray, "time legs 3"]
) -> Float[np.ndarray, "intervals legs 3"]:
    """Return by how much the tibiae's points that touch move from sample to sample [m].

    Args:
        run: The run, N samples; without joint angles or orientation balls are taken for points.
        feet: Its ``foot_position``.

    Returns:
        Displacements of the points that touch at the earlier sample, shape (N - 1, L, 3).
    """
    moved = np.diff(feet, axis=0)
    orientation, q = run.channel("body_orientation"), run.channel("joint_position")
    if not run.robot.foot_radius or orientation is None or q is None:
        return moved
    tibiae = kinematics.link_frames(run.robot, q).rotation[..., 2, :, :]
    R = kinematics.quaternion_rotation(orientation)[:, None] @ tibiae
    down = -run.robot.foot_radius * run.experiment.world.terrain.normal(feet[..., 0], feet[..., 1])
    arm = np.swapaxes(R[:-1], -1, -2) @ down[:-1, ..., None]
    return np.asarray(moved + ((R[1:] - R[:-1]) @ arm)[..., 0])


def standing(run: Run) -> dict[str, Any]:
    """Return how the robot slides, and creeps while it stands for a gait period or longer.

    Returns:
        ``creep``, the speed at which the touching feet move together over the second half of such a
        time, when the robot has settled; the largest of all such times [m/s]. Feet that give way to
        each other move, but not together. Absent without such a time. ``slide``, the numbers of
        `phasmid.terrain.sliding.Slide`, where the robot slides down its ground.
    """
    target, feet, contact = map(run.channel, ("joint_position_target", "foot_position", "contact"))
    if feet is None or contact is None or len(run.time) < 2:
        return {}
    slide = find_slide(run.experiment.world.terrain, run.scale, run.time, feet, contact)
    found: dict[str, Any] = {} if slide is None else {"slide": vars(slide)}
    if target is None:
        return found
    speed = np.gradient(target, run.time, axis=0)
    speeds = []
    for start, stop in intervals(np.abs(speed).max(axis=(1, 2)) < STANDING_SPEED):
        middle, last = (start + stop) // 2, stop - 1
        time = float(run.time[last] - run.time[middle])
        touching = contact[middle:stop].all(axis=0)
        if (
            run.time[last] - run.time[start] >= run.experiment.course.stride.period
            and touching.any()
        ):
            moved = (feet[last] - feet[middle])[touching].mean(axis=0)
            speeds.append(float(np.linalg.norm(moved)) / time)
    return found | ({"creep": max(speeds)} if speeds else {})


def load(run: Run, name: str) -> dict[str, Any]:
    """Return the normal forces of one channel.

    Args:
        run: The run.
        name: ``foot_normal_force`` or ``foot_normal_force_model``.

    Returns:
        ``mean_in_stance`` of each leg [N]; ``mean_sum`` over whole cycles [N] and
        ``sum_over_weight``; ``largest_in_swing`` [N] outside `Source.settling` of the
        leg's switches; empty without the channel.
    """
    normal, stance = run.channel(name), run.channel("stance")
    if normal is None:
        return {}
    time = run.time
    found: dict[str, Any] = {"largest": float(normal.max())}
    period = run.experiment.course.stride.period
    cycles = int((time[-1] - time[0]) / period + 1e-9)
    if cycles > 0:
        whole = time <= time[0] + cycles * period + 1e-9
        total = normal.sum(axis=1)[whole]
        weights = durations(time[whole])
        found["cycles"] = cycles
        found["mean_sum"] = float(total @ weights / weights.sum())
        found["sum_over_weight"] = found["mean_sum"] / run.weight
    if stance is not None:
        held = durations(time)[:, None] * stance
        with np.errstate(invalid="ignore", divide="ignore"):
            mean = (normal * held).sum(axis=0) / held.sum(axis=0)
        found["mean_in_stance"] = mean.tolist()
        margin = run.settling
        swinging = ~stance & away_from_switches(time, stance, margin)
        if swinging.any():
            found["largest_in_swing"] = float(normal[swinging].max())
            found["swing_margin_time"] = margin
    return found


def least_support(run: Run) -> float | None:
    """Return the smallest static stability margin in planned stance [m]; None where unknown."""
    if not (run.can_be_drawn and run.has("foot_position") and run.has("stance")):
        return None
    return float(margin_over_time(run, "stance")[0].min())


def margin_over_time(run: Run, standing: str) -> tuple[np.ndarray, str]:
    """Return the static stability margin of every sample.

    Args:
        run: A run with feet and the body's position.
        standing: Channel of the stance feet: ``contact`` or ``stance``.

    Returns:
        Margin [m], shape (N,), minus infinity where fewer than three feet stand, or all in a
        line; and its reference point: the centre of mass or, where the joint angles or the pose are
        not recorded, the body's origin.
    """
    feet, down = (run.recording[name].values for name in ("foot_position", standing))
    centre, what = centre_of_mass(run), "centre of mass"
    if centre is None:
        centre, what = run.recording["body_position"].values, "body's origin"
    return support_margin(feet[..., :2], down, centre[..., :2]), what


def centre_of_mass(run: Run) -> np.ndarray | None:
    """Return the centre of mass of the whole robot in the world [m], shape (N, 3).

    Joint angles are the recorded or else the planned ones; None where the pose is not recorded.
    """
    if not run.can_be_drawn:
        return None
    position, orientation, angles = run.pose("the centre of mass")
    p_body_com = kinematics.centre_of_mass(run.robot, angles)
    R_world_body = kinematics.quaternion_rotation(orientation)
    return np.asarray(position + np.einsum("nij,nj->ni", R_world_body, p_body_com))


def torque(run: Run, name: str) -> dict[str, Any]:
    """Return the torques of one channel.

    Args:
        run: The run.
        name: ``joint_torque`` or ``joint_torque_model``.

    Returns:
        ``peak`` and ``rms`` of each joint [N·m], shape (L, 3), ``peak_over_stall`` and
        ``share_above_continuous``, the part of all samples above the servo's continuous torque;
        empty without the channel.
    """
    tau = run.channel(name)
    if tau is None:
        return {}
    size, arrays = np.abs(tau), run.robot.arrays
    stall, continuous = arrays.stall_torque, run.joint_continuous_torque
    peak = size.max(axis=0)
    return {
        "peak": peak.tolist(),
        "rms": rms(tau, np.ones(tau.shape, dtype=bool)).tolist(),
        "peak_over_stall": (peak / stall).tolist(),
        "largest": float(peak.max()),
        "largest_over_stall": float((peak / stall).max()),
        "share_above_continuous": float((size > continuous).mean()),
    }


def model_difference(run: Run) -> dict[str, Any]:
    """Return the rms differences of the model from the simulation.

    Returns:
        ``torque`` [N·m], shape (L, 3): ``rms`` away from all legs' switches, and
        ``rms_mid_stance`` over the middle half of each whole stance. ``normal_force`` [N]:
        ``rms`` away from all legs' switches, shape (L,). ``left_out_about_switches`` [s].
    """
    found: dict[str, Any] = {}
    stance = run.channel("stance")
    if stance is None:
        return found
    calm = away_from_switches(run.time, stance, run.settling).all(axis=1, keepdims=True)
    middle = middle_halves(stance)
    for section, name in (("torque", "joint_torque"), ("normal_force", "foot_normal_force")):
        seen, model = run.channel(name), run.channel(f"{name}_model")
        if seen is None or model is None:
            continue
        rows = (*stance.shape, *[1] * (seen.ndim - 2))
        masks = {"rms": np.broadcast_to(calm, stance.shape), "rms_mid_stance": middle}
        found[section] = {
            key: rms(model - seen, np.broadcast_to(mask.reshape(rows), seen.shape)).tolist()
            for key, mask in masks.items()
            if key == "rms" or section == "torque"
        }
    left_out = {"left_out_about_switches": run.settling} if "normal_force" in found else {}
    return left_out | found


def speed(run: Run) -> dict[str, Any]:
    """Return the peak speed of the joints [rad/s], and its share of the no-load speed."""
    name = "joint_velocity" if run.has("joint_velocity") else "joint_velocity_target"
    qd = run.channel(name)
    if qd is None:
        return {}
    peak = np.abs(qd).max(axis=0)
    return {
        "channel": name,
        "peak": peak.tolist(),
        "largest": float(peak.max()),
        "largest_over_no_load": float((peak / run.robot.arrays.no_load_speed).max()),
    }


def torque_and_speed(run: Run) -> tuple[np.ndarray, np.ndarray, str]:
    """Return torques [N·m], speeds [rad/s], shape (N, L, 3), and the name of the torques' channel.

    They are the recorded ones, or else those of the model and the plan.

    Raises:
        InvalidInput: The recording has no such pair.
    """
    pairs = {"joint_torque": "joint_velocity", "joint_torque_model": "joint_velocity_target"}
    for torques, speeds in pairs.items():
        tau, qd = run.channel(torques), run.channel(speeds)
        if tau is not None and qd is not None:
            return tau, qd, torques
    lacking = "joint_velocity" if run.has("joint_torque") else "joint_torque"
    raise run.absent((lacking,), "torque over speed")


def joint_power(run: Run) -> dict[str, np.ndarray]:
    """Return each kind of power of all joints together [W], shape (N,).

    Returns:
        ``given``, the sum over joints of the positive parts of torque times speed at the joints'
        axes, as braking recovers nothing; with recorded friction of the servos ``friction``, the
        power that it takes; and with recorded servo currents ``electrical``, the positive part of
        output times supply voltage times current: the bridge chops the supply, and draws that
        share of the winding's current.

    Raises:
        InvalidInput: A channel is absent.
    """
    tau, qd, _ = torque_and_speed(run)
    duty, current = run.channel("servo_duty"), run.channel("servo_current")
    kinds = {"given": np.maximum(tau * qd, 0.0)}
    friction, rotor = run.channel("servo_friction_torque"), run.channel("servo_speed")
    if friction is not None:
        kinds["friction"] = -friction * (qd if rotor is None else rotor)
    if duty is not None and current is not None:
        kinds["electrical"] = np.maximum(duty * run.robot.servo.voltage * current, 0.0)
    return {name: power.sum(axis=(1, 2)) for name, power in kinds.items()}


def cost_of_transport(run: Run, energy: float, distance: float | None) -> float | None:
    """Return energy [J] over weight and distance [m]; None for an unknown distance or nearly 0."""
    if distance is None or distance < SHORTEST_DISTANCE:
        return None
    return energy / (run.weight * distance)


def energy(run: Run, distance: float | None) -> dict[str, Any]:
    """Return the work of the joints and of friction, and the electrical energy.

    Args:
        run: The run.
        distance: Distance of the body [m]; None where unknown.

    Returns:
        ``work`` [J]: the integral of the power ``given`` of `joint_power`; ``mean_power`` [W]:
        its mean; ``cost_of_transport``: of that work, mechanical; ``friction_work`` [J]: lost in
        the servos' motors and gears; ``electrical_energy`` [J] and ``electrical_power`` [W], its
        mean: drawn by the motors, most of which becomes heat. Empty without torques and speeds.
    """
    lasts, weights = float(run.time[-1] - run.time[0]), durations(run.time)
    try:
        power, name = joint_power(run), torque_and_speed(run)[2]
    except InvalidInput:
        return {}
    if lasts <= 0:
        return {}
    total = {kind: float(values @ weights) for kind, values in power.items()}
    return {
        "channel": name,
        "work": total["given"],
        "mean_power": total["given"] / lasts,
        "cost_of_transport": cost_of_transport(run, total["given"], distance),
        "friction_work": total.get("friction"),
        "electrical_energy": total.get("electrical"),
        "electrical_power": total["electrical"] / lasts if "electrical" in total else None,
    }


def verdict(run: Run) -> dict[str, Any]:
    """Return the verdict on the servos of the run's experiment.

    Args:
        run: The run.

    Returns:
        `phasmid.advice.ServoVerdict` as a dictionary; empty for a trajectory, whose stance is
        unknown, and where a neutral foot is out of reach.
    """
    if "trajectory" in run.recording.attrs:
        return {}
    try:
        return servo_verdict(run.experiment).as_dict()
    except Unreachable:
        return {}


def servos(run: Run) -> dict[str, Any]:
    """Return how close the servos came to their limits.

    Args:
        run: The run.

    Returns:
        Of each joint, shape (L, 3): ``saturated`` and ``above_continuous``, the parts of the time
        at the largest output and above the continuous torque; ``peak_temperature``,
        ``final_temperature`` [°C], and ``shutdown_time`` [s]. Then the supply and the limits.
        Empty without the servos' channels.
    """
    duty, current = run.channel("servo_duty"), run.channel("servo_current")
    warmth, down = run.channel("servo_temperature"), run.channel("servo_shutdown")
    if duty is None or current is None or warmth is None or down is None:
        return {}
    servo, time = run.robot.servo, run.time
    weights = durations(time) / durations(time).sum()

    def mean(values: np.ndarray) -> np.ndarray:
        return np.asarray(np.einsum("t,tlj->lj", weights, values.astype(float)))

    found: dict[str, Any] = {
        "voltage": servo.voltage,
        "torque_limit": servo.torque_limit,
        "ambient_temperature": servo.ambient_temperature,
        "temperature_limit": servo.temperature_limit,
        "saturated": mean(np.abs(duty) >= servo.torque_limit * (1 - 1e-12)).tolist(),
    }
    torque = run.channel("joint_torque")
    if torque is not None:
        above = np.abs(torque) > run.joint_continuous_torque
        found["above_continuous"] = mean(above).tolist()
    return found | {
        "peak_temperature": warmth.max(axis=0).tolist(),
        "final_temperature": warmth[-1].tolist(),
        "shutdown_time": np.where(down.any(axis=0), time[np.argmax(down, axis=0)], np.nan).tolist(),
    }
