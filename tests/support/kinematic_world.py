"""A world without forces: joints follow their targets, and stance feet do not move."""

from dataclasses import dataclass

import numpy as np

from phasmid.control import LocomotionEngine
from phasmid.control.types import LegPhase
from phasmid.experiment import Command, Observation
from phasmid.gait import GAITS, support_margin
from phasmid.kinematics import body_from_hip, centre_of_mass, foot_position


@dataclass
class Seen:
    """Motion of an engine, update by update."""

    robot: object
    dt: float
    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    stance: np.ndarray
    leg: np.ndarray
    body: np.ndarray
    place: np.ndarray
    path: np.ndarray
    velocity: np.ndarray
    slow: np.ndarray
    events: list

    @property
    def feet_in_body(self):
        return body_from_hip(self.robot, foot_position(self.robot.arrays, self.q))

    @property
    def feet(self):
        """Feet in odom, by the package's own kinematics."""
        return np.einsum("tij,tlj->tli", self.body, self.feet_in_body) + self.place[:, None]

    @property
    def slip(self):
        """Farthest that a foot which stands moves from one update to the next [m]."""
        stays = self.stance[1:] & self.stance[:-1]
        moved = np.linalg.norm(np.diff(self.feet, axis=0), axis=-1)
        return float(np.max(moved, where=stays, initial=0.0))

    @property
    def joint_speed(self):
        return np.abs(np.diff(self.q, axis=0)) / self.dt

    @property
    def margin(self):
        com = np.einsum("tij,tj->ti", self.body, centre_of_mass(self.robot, self.q)) + self.place
        return support_margin(self.feet[..., :2], self.stance, com[:, :2])


def drive(engine, commands, duration):
    """Let an engine follow commands (time, command) for a time [s]."""
    dt = engine.settings.update_period
    names = "q", "qd", "qdd", "leg", "body", "place", "path", "velocity", "slow"
    rows = {name: [] for name in names}
    rest, now = list(commands), Command()
    q = engine.state.q.copy()
    for k in range(round(duration / dt)):
        while rest and rest[0][0] <= k * dt + 1e-9:
            now = rest.pop(0)[1]
        targets = engine.update(Observation(k * dt, q), now)
        q = targets.position
        s = engine.state
        rows["q"].append(q)
        rows["qd"].append(targets.velocity)
        rows["qdd"].append(s.qdd.copy())
        rows["leg"].append(s.leg_phase.copy())
        rows["body"].append(s.R_odom_body.copy())
        rows["place"].append(s.body_position.copy())
        rows["path"].append(s.path.copy())
        rows["velocity"].append(s.velocity_filter[2].copy())
        rows["slow"].append(s.clock.time_scale)
    rows = {name: np.array(values) for name, values in rows.items()}
    return Seen(
        engine.robot, dt, stance=rows["leg"] == LegPhase.STANCE, events=engine.events.copy(), **rows
    )


def random_commands(robot, rng, duration):
    """A sequence of commands: velocities, poses and gaits, starts and stops at random times."""
    gaits = list(GAITS[len(robot.legs)])
    found, time = [], 0.0
    gait, pose, velocity = None, (0.0,) * 6, (0.0,) * 3
    while time < duration:
        what = rng.integers(5)
        if what <= 1:
            size = 10 ** rng.uniform(-2, 0)
            way = rng.normal(size=3)
            way *= size / np.linalg.norm(way)
            velocity = (float(way[0]), float(way[1]), float(5 * way[2]))
            if rng.random() < 0.3:
                velocity = (velocity[0], 0.0, 0.0)
        elif what == 2:
            velocity = (0.0, 0.0, 0.0)
        elif what == 3:
            gait = str(rng.choice(gaits))
        else:
            most = np.array([0.06, 0.06, 0.06, 0.4, 0.4, 0.5])
            pose = tuple(float(x) for x in rng.uniform(-most, most) * rng.integers(0, 2, 6))
        found.append((time, Command(velocity=velocity, pose=pose, gait=gait)))
        time += rng.exponential(2.0)
    return found


def worst(seen):
    """The numbers that a test looks at."""
    limits = seen.robot.arrays.joint_limits
    air = seen.leg == LegPhase.HELD
    out = np.maximum(limits[..., 0] - seen.q, seen.q - limits[..., 1])
    return {
        "slip": seen.slip,
        "speed": float(seen.joint_speed.max() / seen.robot.servo.no_load_speed),
        "beyond": float(out.max()),
        "margin": float(seen.margin.min()),
        "finite": bool(np.isfinite(seen.q).all()),
        "held": bool(air.any()),
        "slow": float(seen.slow.min()),
        "way": float(np.linalg.norm(np.diff(seen.path[:, :2], axis=0), axis=1).sum()),
    }


def core_engine(robot, **keywords):
    """An engine that neither feels the ground nor minds forces: this world has none."""
    return LocomotionEngine(robot, ground_sensing=False, dynamics="none", **keywords)
