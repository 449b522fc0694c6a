"""Simulation of a scenario."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Ge, Gt, Le

from phasmid.tables import Count, Length, Number, Table, Time


class SimulationTable(Table):
    """``[simulation]``: how the engine runs.

    Attributes:
        drive: ``prescribed``: joints follow the plan, whatever torque it takes (the paper's way);
            ``ideal-servo``: position servos with the torque and speed limits of the robot's servo;
            ``servo``: the robot's servo with its own law, motor, gears and heat; ``torque``: what
            the planned motion takes by inverse dynamics, and more against errors, within the
            torque and speed limits of the robot's servo. Absent: ``prescribed`` for a planned walk;
            for a driven robot ``servo``, or ``ideal-servo`` where no stall current is known.
        position_gain: Of ``torque``: angular acceleration against an error of a joint's angle
            [1/s²]; the joint's inertia is that of the robot standing on half of its legs.
        speed_gain: Of ``torque``: the same against an error of its speed [1/s]; absent: damped
            critically, twice the root of the position's.
        dt: Time step [s].
        record_interval: Time between recorded samples [s], a whole number of steps; absent: every
            step, or every millisecond where steps are shorter.
        max_steps: Longest run that is not refused [steps].
        start_height: Height of the body frame at the start [m], from where the robot drops onto its
            feet; absent: where the plan has it.
        start_posture: Of a robot that a controller drives: ``standing`` on its feet, or ``packed``:
            on its belly with its legs folded.
        belly_contact: Whether the trunk's underside can lie on the ground; without it a trunk that
            touches the ground ends the run. A robot that starts packed always can.
    """

    drive: Literal["prescribed", "ideal-servo", "servo", "torque"] | None = None
    position_gain: Annotated[Number, Gt(0), Le(1e5)] = 900.0
    speed_gain: Annotated[Number, Ge(0), Le(1e3)] | None = None
    dt: Annotated[Time, Gt(0)] = 0.001
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
    def can_lie(self) -> bool:
        """True if the trunk can lie on the ground."""
        return self.belly_contact or self.start_posture == "packed"
