"""Motion of the feet in the body frame, for each stance law."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from phasmid.errors import InfeasibleWalk
from phasmid.experiment import Stride
from phasmid.gait import Gait
from phasmid.kinematics import neutral_feet, rotated, step_pose
from phasmid.motion.curves import Path, cos_and_sin, join, lift, vector
from phasmid.motion.rolling import Rolling
from phasmid.motion.swing import Swings
from phasmid.motion.trunk import TrunkMotion, progress
from phasmid.robot import Robot


def straight_feet(
    robot: Robot,
    gait: Gait,
    stride: Stride,
    time: Float[np.ndarray, " time"],
    trunk: TrunkMotion,
    rolled: Rolling | None = None,
) -> Path:
    """Return feet that stand still in the world, or roll, and swing from foothold to foothold.

    Args:
        robot: The robot, L legs.
        gait: The gait.
        stride: Steps, heights, times and curves.
        time: Times [s], shape (N,).
        trunk: The body at these times.
        rolled: How balls roll in their stance; None for points.

    Returns:
        Feet in the body frame, with velocity and acceleration there [m, s], shape (N, L, 3).

    Source: Fig. 6; the quintics of the results section. A foot swings between footholds in world
    axes, so that it lands without velocity whatever the body does.
    """
    cycle, u = swing_fraction(gait, stride, time)
    landing = mid_stance(gait, cycle)
    neutral = neutral_feet(robot)
    ground = np.full((*u.shape, 1), robot.foot_radius)
    start, end = (
        np.concatenate([foothold(stride.step, steps, neutral), ground], axis=-1)
        for steps in (landing - 1 / gait.duty_factor, landing)
    )
    swing = gait.swing_fraction * stride.period
    if rolled is None:
        swings = Swings.over_level_ground(start, end, stride.step_height)
        return in_body(swings.feet(stride.curve, u, swing), trunk)
    last, next_ = (
        step_pose(stride.step, steps)[..., 2] for steps in (landing - 1 / gait.duty_factor, landing)
    )
    # A foot lifts off where it has rolled to, and lands where it begins to roll.
    start = start + rolled.at(np.ones_like(u), last, stride.period).position
    way = rolled.at(gait.leg_phase(np.asarray(time) / stride.period), next_, stride.period)
    begun = rolled.at(np.zeros_like(u), next_, stride.period).position
    swings = Swings.over_level_ground(start, end + begun, stride.step_height)
    standing = (u == 1.0)[..., None]
    p, v, a = swings.feet(stride.curve, u, swing)
    p = np.where(standing, end + way.position, p)
    return in_body(Path(p, v + standing * way.velocity, a + standing * way.acceleration), trunk)


def mid_stance(gait: Gait, cycle: Float[np.ndarray, "time legs"]) -> Float[np.ndarray, "time legs"]:
    """Return the number of steps of the body at mid-stance after the swing of a cycle."""
    # Half a step later than the landing.
    return (np.asarray(gait.offsets) + gait.swing_fraction + cycle) / gait.duty_factor + 0.5


def swing_fraction(
    gait: Gait, stride: Stride, time: Float[np.ndarray, " time"]
) -> tuple[Float[np.ndarray, "time legs"], Float[np.ndarray, "time legs"]]:
    """Return the number of each leg's cycle and the fraction of its swing; 1 in stance."""
    cycles = np.asarray(time, dtype=float) / stride.period
    own = gait.leg_phase(cycles)
    number = np.round(cycles[:, None] - np.asarray(gait.offsets) - own)
    u = np.where(gait.stance(cycles), 1.0, own / gait.swing_fraction)
    return number, np.clip(u, 0.0, 1.0)


def foothold(
    step: Float[np.ndarray, "3"],
    steps: Float[np.ndarray, "time legs"],
    neutral: Float[np.ndarray, "legs axes"],
) -> Float[np.ndarray, "time legs 2"]:
    """Return the neutral foot on the ground after a number of steps of the body."""
    pose = step_pose(step, steps)
    c, s = np.cos(pose[..., 2]), np.sin(pose[..., 2])
    x, y = neutral[:, 0], neutral[:, 1]
    return np.stack([pose[..., 0] + c * x - s * y, pose[..., 1] + s * x + c * y], axis=-1)


def in_body(world: Path, trunk: TrunkMotion) -> Path:
    """Return a motion in world axes relative to the body frame."""
    R_body_world = np.swapaxes(trunk.rotation, -1, -2)[:, None]

    def turn(v: np.ndarray) -> np.ndarray:
        return rotated(R_body_world, v)

    w, dw = turn(trunk.angular_velocity[:, None]), turn(trunk.angular_acceleration[:, None])
    p = turn(world.position - trunk.position[:, None])
    v = turn(world.velocity - trunk.velocity[:, None]) - np.cross(w, p)
    a = turn(world.acceleration - trunk.acceleration[:, None])
    a = a - np.cross(dw, p) - 2 * np.cross(w, v) - np.cross(w, np.cross(w, p))
    return Path(p, v, a)


def coxa_only_feet(
    robot: Robot,
    gait: Gait,
    stride: Stride,
    time: Float[np.ndarray, " time"],
    height: float,
) -> Path:
    """Return feet that only the coxa moves in stance, on circles about the hips.

    The chord of the circle, along the direction of travel, is as long as the step; the rest is
    slip.

    Args:
        robot: The robot, L legs.
        gait: The gait.
        stride: Steps, heights, times and curves.
        time: Times [s], shape (N,).
        height: Height of the body frame over the feet [m].

    Returns:
        Feet in the body frame, with velocity and acceleration there [m, s], shape (N, L, 3).

    Raises:
        InfeasibleWalk: A coxa cannot move its foot in the direction of travel, or is tilted.

    Source: the paper's words on Fig. 12, "only the coxa joint has values" in support.
    """
    if gait.sway:
        raise InfeasibleWalk(
            f'gait "{gait.name}" sways the body, which a stance by the coxae alone cannot.',
            hint='stance_law = "straight"',
        )
    for leg in robot.legs:
        if leg.is_tilted:
            lean = np.degrees(np.arccos(leg.R_level_hip[2, 2]))
            raise InfeasibleWalk(
                f"leg {leg.name} cannot stand by its coxa alone: that axis leans by {lean:.3g}°, "
                "and would lift the foot or press it into the ground.",
                hint='stance_law = "straight"',
            )
    neutral, hips = neutral_feet(robot)[:, :2], robot.arrays.p_body_hip[:, :2]
    radius = np.hypot(*(neutral - hips).T)
    middle = np.arctan2(*(neutral - hips).T[::-1])
    half = _coxa_half_angle(robot, stride.step, neutral, middle, radius)

    def on_circle(sigma: Path) -> Path:
        away = vector(*cos_and_sin(sigma * (2 * half) + (middle - half)))
        return away * radius[:, None] + hips

    cycle, u = swing_fraction(gait, stride, time)
    landing = (np.asarray(gait.offsets) + gait.swing_fraction + cycle) / gait.duty_factor
    steps = Path(*(order[:, None] for order in progress(gait, stride, time)))
    sigma = np.clip(steps.position - landing, 0.0, 1.0)
    stance = on_circle(Path(sigma, steps.velocity, steps.acceleration))

    swing = gait.swing_fraction * stride.period
    one = np.ones(len(half))
    lift_off, touchdown = (on_circle(Path(at * one, one, 0 * one)) for at in (1.0, 0.0))
    speed = _end_speed(gait, stride) * swing
    velocities = speed * lift_off.velocity, speed * touchdown.velocity
    xy = join(stride.curve, u[..., None], lift_off.position, touchdown.position, velocities)
    z = lift(stride.curve, u) * stride.step_height
    flying = (u < 1.0)[..., None]
    swinging = Path(*(np.concatenate([xy[k], z[k][..., None]], axis=-1) for k in range(3)))
    standing = (np.concatenate([order, np.zeros((*u.shape, 1))], axis=-1) for order in stance)
    pairs = zip(swinging.over(swing), standing, strict=True)
    return Path(*(np.where(flying, *pair) for pair in pairs)) + np.array([0.0, 0.0, -height])


def _coxa_half_angle(
    robot: Robot,
    step: np.ndarray,
    neutral: np.ndarray,
    middle: np.ndarray,
    radius: np.ndarray,
) -> np.ndarray:
    """Return half the coxa's rotation in stance, from touchdown to lift-off [rad]."""
    ahead, behind = (
        foothold(step, np.full((1, len(neutral)), at), neutral)[0] for at in (0.5, -0.5)
    )
    way = ahead - behind
    length = np.hypot(*way.T)
    along = (-np.sin(middle) * way[:, 0] + np.cos(middle) * way[:, 1]) / np.where(length, length, 1)
    needed = length / (2 * radius)
    for leg, share, sine in zip(robot.legs, np.abs(along), needed, strict=True):
        if sine > 0 and sine > 0.95 * share:
            raise InfeasibleWalk(
                f"leg {leg.name} cannot make this step with its coxa alone: its foot moves "
                f"{np.degrees(np.arccos(min(share, 1.0))):.0f}° off the commanded direction.",
                hint='stance_law = "straight"',
            )
    return -np.arcsin(np.where(length > 0, needed / np.where(length > 0, along, 1.0), 0.0))


def _end_speed(gait: Gait, stride: Stride) -> float:
    """Return the progress of the body at lift-off and touchdown [steps/s]."""
    moving = stride.stance_timing == "constant-speed"
    return 1 / (gait.duty_factor * stride.period) if moving else 0.0
