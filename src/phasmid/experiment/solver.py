"""How the engine runs."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Ge, Gt, Le

from phasmid.tables import Count, Length, Number, Table, Time

USUAL_STEP = 0.001
"""Time step where no part of an experiment needs a shorter one [s]."""

SETTLING_TIME = 1.0
"""Time for which the robot stands still before a simulated walk, to find its equilibrium [s]."""


class Solver(Table):
    """``[simulation]``: how the engine runs.

    Attributes:
        drive: ``prescribed``: joints follow the plan, at any torque, as in the paper;
            ``ideal-servo``: position servos with the torque and speed limits of the robot's servo;
            ``servo``: the robot's servo with its own law, motor, gears and heat; ``torque``: the
            torque of the planned motion by inverse dynamics plus a correction of errors, within the
            torque and speed limits of the robot's servo. Absent: ``prescribed`` for a planned walk;
            for a driven robot ``servo``, or ``ideal-servo`` where no stall current is known
            or joints differ.
        position_gain: Drive ``torque``: angular acceleration per error of a joint's angle [1/s²];
            the joint's inertia is that of the robot on half of its legs.
        speed_gain: Drive ``torque``: angular acceleration per error of a joint's speed [1/s];
            absent: critical damping, twice the root of the position gain.
        dt: Time step [s]; absent: 1 ms, or less where robot, servos or contact need it.
        record_interval: Time between recorded samples [s], a whole number of steps; absent: every
            step, or every millisecond where steps are shorter.
        max_steps: Largest number of steps; longer runs are refused.
        start_height: Height of the body frame at the start [m], from which the robot drops onto its
            feet; absent: that of the plan.
        start_posture: Start of a driven robot: ``standing`` on its feet, or ``packed`` on its
            belly with its legs folded.
        belly_contact: Whether the trunk's underside can lie on the ground; without it a trunk that
            touches the ground ends the run. A robot that starts packed always can.
    """

    drive: Literal["prescribed", "ideal-servo", "servo", "torque"] | None = None
    position_gain: Annotated[Number, Gt(0), Le(1e5)] = 900.0
    speed_gain: Annotated[Number, Ge(0), Le(1e3)] | None = None
    dt: Annotated[Time, Gt(0)] | None = None
    record_interval: Annotated[Time, Gt(0)] | None = None
    max_steps: Annotated[Count, Gt(0)] = 100_000_000
    start_height: Annotated[Length, Gt(0), Le(10)] | None = None
    start_posture: Literal["standing", "packed"] = "standing"
    belly_contact: bool = False

    @property
    def planned_drive(self) -> str:
        """The drive of a planned walk: ``prescribed`` where none is named."""
        return self.drive or "prescribed"

    @property
    def time_step(self) -> float:
        """The time step [s]; until a run has chosen it, the usual one."""
        return USUAL_STEP if self.dt is None else self.dt

    @property
    def record_steps(self) -> int:
        """Number of time steps from one recorded sample to the next."""
        interval = self.record_interval or USUAL_STEP
        return max(1, round(interval / self.time_step))

    @property
    def can_lie(self) -> bool:
        """True if the trunk can lie on the ground."""
        return self.belly_contact or self.start_posture == "packed"
