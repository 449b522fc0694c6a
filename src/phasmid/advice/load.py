"""Load on the servos of a simulated walk: torque, heat and current."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.experiment import Experiment, ScenarioLike
from phasmid.motion import Walk
from phasmid.servo.motor import Motor
from phasmid.simulation import new_run
from phasmid.simulation.channels import sample_channels
from phasmid.simulation.loop import Samples


@dataclass(frozen=True, eq=False)
class ServoLoad:
    """Load on each servo of a walk, L legs of coxa, femur and tibia.

    Attributes:
        peak_torque: Largest torque on the joint [N·m], shape (L, 3).
        rms_torque: Root mean square of that torque [N·m], shape (L, 3).
        heat: Mean power lost in the winding [W], shape (L, 3); None without a known motor.
        unaided_heat: The same where friction does not help to hold a load [W], shape (L, 3).
        supply_current: Mean current of all motors and electronics [A]; None likewise.
        peak_supply_current: Largest such current [A].
        temperature: Temperature at the end of the walk [°C], shape (L, 3); None likewise.
        duration: Simulated time that counts [s].
        failure: Why the walk ended early; empty where it did not.
    """

    peak_torque: Float[np.ndarray, "legs 3"]
    rms_torque: Float[np.ndarray, "legs 3"]
    heat: Float[np.ndarray, "legs 3"] | None
    unaided_heat: Float[np.ndarray, "legs 3"] | None
    supply_current: float | None
    peak_supply_current: float | None
    temperature: Float[np.ndarray, "legs 3"] | None
    duration: float
    failure: str = ""


def simulate_load(
    scenario: ScenarioLike | Experiment, walk: Walk, *, skip: float = 0.0
) -> ServoLoad:
    """Simulate a walk, and return the load on its servos, in memory that does not grow with it.

    Args:
        scenario: The walk's scenario, or its experiment.
        walk: The plan.
        skip: Time at the start that does not count [s]; nothing is skipped if the walk ends sooner.
    """
    run = new_run(scenario, walk)
    servo = run.robot.servo
    motor = servo.known_motor if run.experiment.solver.planned_drive == "servo" else None
    sums = _Sums()

    def keep(samples: Samples) -> None:
        nonlocal sums
        time = run.time[run.done : run.done + len(samples)]
        begin = int(np.searchsorted(time, skip))
        if 0 < begin < len(time):
            sums, samples = _Sums(), samples[begin:]
        sums.add(sample_channels(run, samples), motor)

    failure = run.advance(keep=keep)
    count = sums.count
    heat = None if motor is None else motor.resistance * sums.square_current / count
    standby = 3 * len(walk.robot.legs) * servo.standby_current
    return ServoLoad(
        peak_torque=sums.peak_torque,
        rms_torque=np.sqrt(sums.square_torque / count),
        heat=None if heat is None else heat[0],
        unaided_heat=None if heat is None else heat[1],
        supply_current=None if heat is None else sums.drawn / count + standby,
        peak_supply_current=None if heat is None else sums.peak_drawn + standby,
        temperature=sums.temperature,
        duration=count * run.dt * run.every,
        failure=failure.sentence if failure else "",
    )


class _Sums:
    """Sums and peaks over samples: torque [N·m], current [A], current from the supply [A]."""

    def __init__(self) -> None:
        self.count = 0
        self.peak_torque: Any = 0.0
        self.square_torque: Any = 0.0
        self.square_current: Any = 0.0  # of each servo, and of each without help from friction
        self.drawn, self.peak_drawn = 0.0, 0.0
        self.temperature: np.ndarray | None = None

    def add(self, channels: Mapping[str, np.ndarray], motor: Motor | None) -> None:
        """Add the samples of a block."""
        torque = np.abs(channels["joint_torque"])
        self.count += len(torque)
        self.peak_torque = np.maximum(self.peak_torque, torque.max(axis=0))
        self.square_torque = self.square_torque + np.sum(torque**2, axis=0)
        if motor is None:
            return
        current = channels["servo_current"]
        unaided = motor.lifting_current(torque)
        both = np.stack([current, np.maximum(np.abs(current), unaided)])
        self.square_current = self.square_current + np.sum(both**2, axis=1)
        # The bridge chops the supply: it draws the duty's share of the winding's current.
        drawn = np.maximum(channels["servo_duty"] * current, 0.0).sum(axis=(1, 2))
        self.drawn += float(drawn.sum())
        self.peak_drawn = max(self.peak_drawn, float(drawn.max()))
        self.temperature = channels["servo_temperature"][-1].copy()
