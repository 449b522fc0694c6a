"""Judgement of a servo's torque and speed."""

from __future__ import annotations

from phasmid.formats.findings import Finding, Severity
from phasmid.robot import Servo
from phasmid.units import STANDARD_GRAVITY

STRONGEST = 10.0
"""Torque, in weights of the robot at a leg's length, above which an effort is a placeholder:
the strongest walking machines have 1, the PhantomX 0.2."""

FASTEST = 50.0
"""No-load speed above which a number is a placeholder [rad/s]: hobby servos reach 13, the motors
of running quadrupeds 40."""


def judge_servo(servo: Servo, mass: float, length: float) -> tuple[Finding, ...]:
    """Find torques and speeds that are placeholders.

    Whether the servo holds the robot is `phasmid.forces.servo_verdict`.

    Args:
        servo: Of every joint.
        mass: Of the whole robot [kg].
        length: Of its longest leg [m].
    """
    found: list[Finding] = []
    times = servo.stall_torque / (mass * STANDARD_GRAVITY * length)
    if times > STRONGEST:
        what = (
            f"effort {servo.stall_torque:.4g} N·m would lift {times:.0f} such robots at a leg's "
            "length; it is hardly a servo's."
        )
        found.append(Finding(Severity.SUSPECT, "servos", what, hint=_NAMED))
    if servo.no_load_speed > FASTEST:
        what = (
            f"speed {servo.no_load_speed:.4g} rad/s is hardly a servo's; it should be at most "
            f"{FASTEST:g} rad/s."
        )
        found.append(Finding(Severity.SUSPECT, "servos", what, hint=_NAMED))
    return tuple(found)


_NAMED = "--servo-model AX-12A, to take all from a data sheet"
