"""Torque over speed of the joints, within the envelope of their servos."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from phasmid.errors import InvalidInput
from phasmid.recording import Recording
from phasmid.recording.channels import JOINTS
from phasmid.reporting.figure_layout import (
    Axes,
    Entry,
    check_legs,
    leg_name,
    name_row,
    panel_figure,
)
from phasmid.reporting.required_channels import how_to_get
from phasmid.reporting.runs import Run, shared_caption
from phasmid.reporting.source import Source, channel
from phasmid.reporting.style import FAINT, LIMIT_COLOUR, Figure, leg_colour, styled
from phasmid.robot import Servo
from phasmid.robot.motor import Motor

PAIRS = (("joint_torque", "joint_velocity"), ("joint_torque_model", "joint_velocity_target"))
NEEDS = (("joint_torque", "joint_torque_model"), ("joint_velocity", "joint_velocity_target"))

MOST_MARKS = 20_000
"""Most samples of a joint that are drawn, besides those beyond the envelope."""

ADVICE_DASH = (0, (2.2, 1.6))

Limits: TypeAlias = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
"""From speed [rad/s] to the lowest and the highest torque at it [N·m]."""


def envelope_figure(runs: Sequence[Run], legs: tuple[int, ...]) -> Figure:
    """Draw torque over speed of coxae, femora and tibiae, in their servos' envelope.

    Args:
        runs: A row of panels each.
        legs: Leg numbers, from 1.

    Raises:
        InvalidInput: There is no such leg or no such channel.
    """
    for run in runs:
        check_legs(legs, run.source)
    found = [torque_and_speed(run.recording) for run in runs]
    alone = len(runs) == 1
    notes = [*shared_caption(runs), _shares(runs[0], *found[0][:2]) if alone else ""]
    with styled():
        rows = [2.75 if alone else 2.45] * len(runs)
        title = "Torque and speed of the servos"
        drawing = panel_figure(title, notes, rows, columns=3, space=0.10, gap=0.42)
        for run, axes, (tau, qd, name) in zip(runs, drawing.rows(), found, strict=True):
            for joint, axis in enumerate(axes):
                _draw_joint(axis, run, tau, qd, legs, joint)
                axis.set_title(JOINTS[joint])
            if not alone:
                name_row(axes[0], f"{run.label} · {_shares(run, tau, qd)}")
            model = " by the model" if name.endswith("_model") else ""
            axes[0].set_ylabel(f"torque{model} [N·m]")
        for axis in axes:
            axis.set_xlabel("speed [rad/s]")
        blank: Entry = ("", {"color": "none"})
        entries: list[Entry] = [
            (leg_name(runs[0].source, leg), {"color": leg_colour(leg - 1)}) for leg in legs
        ]
        entries += [blank] * (-len(legs) % 3)
        entries += [
            ("steady limit of the servo", {"color": LIMIT_COLOUR}),
            ("continuous torque", {"color": FAINT, "linestyle": ADVICE_DASH}),
            blank,
        ]
        drawing.add_legend(entries, columns=3, lines_below=0 if alone else 1)
    return drawing.figure


def torque_and_speed(recording: Recording) -> tuple[np.ndarray, np.ndarray, str]:
    """Return torques [N·m], speeds [rad/s], shape (N, L, 3), and the name of the torques' channel.

    They are the recorded ones, or else those of the model and the plan.

    Raises:
        InvalidInput: The recording has no such pair.
    """
    for torques, speeds in PAIRS:
        tau, qd = channel(recording, torques), channel(recording, speeds)
        if tau is not None and qd is not None:
            return tau, qd, torques
    lacking = "joint_torque" if channel(recording, "joint_torque") is None else "joint_velocity"
    raise InvalidInput(
        f"the recording has no {lacking}; torque over speed needs it.", hint=how_to_get(lacking)
    )


def servo_limits(source: Source) -> tuple[Limits, str]:
    """Return the torque limits of an experiment's servos at steady speed, and their conditions.

    Servos that move the joints by their own law have the scenario's voltage and torque limit.
    Under another drive they are taken at the voltage of their data sheet; the ideal servo, and one
    whose stall current is not known, follows the straight line that its drive follows.
    """
    servo, drive = source.robot.servo, source.scenario.simulation.drive
    if servo.stall_current is None or drive in {"ideal-servo", "torque"}:
        return lambda speed: ideal_limits(servo, speed), "line from stall to no-load speed"
    if drive == "servo":
        table = source.scenario.servo
        servo, voltage = table.set_up(servo), table.supply(servo)
    else:
        servo, voltage = replace(servo, torque_limit=1.0), servo.rated_voltage
    motor, share, stall = servo.motor, servo.torque_limit, servo.stall_at(voltage)
    words = f"limit at {voltage:g} V" + (f", {100 * share:g} % output" if share < 1 else "")
    return lambda speed: motor_limits(motor, share * voltage, stall, speed), words


def motor_limits(
    motor: Motor, voltage: float, stall: float, speed: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and highest torque of a geared motor at steady speeds.

    Under the voltage u the motor has the torque m = k (u - k w) / R. The gears' friction
    c1 |m| + c0 and b w oppose the motion: they are lost while the servo drives its load, and help
    it while the load drives the servo, and so at standstill, where it holds, within the
    stall torque.

    Args:
        motor: The motor.
        voltage: Largest at its winding, of both signs [V].
        stall: Stall torque [N·m].
        speed: At the output [rad/s], any shape.

    Returns:
        Torques on the joint [N·m], of the speed's shape.
    """
    highest, lowest = (_highest(motor, voltage, sign * speed) for sign in (1, -1))
    return -np.minimum(lowest, stall), np.minimum(highest, stall)


def _highest(motor: Motor, voltage: float, speed: np.ndarray) -> np.ndarray:
    given = motor.constant * (voltage - motor.constant * speed) / motor.resistance
    friction = motor.load_loss * np.abs(given) + motor.coulomb
    torque: np.ndarray = given + np.where(speed > 0, -friction, friction) - motor.viscous * speed
    return torque


def ideal_limits(servo: Servo, speed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and highest torque of the ideal servo [N·m].

    They lie on a line from stall to no-load speed while it drives, at stall torque while it brakes.

    Args:
        servo: The servo.
        speed: At the output [rad/s], any shape.
    """

    def highest(w: np.ndarray) -> np.ndarray:
        share = 1 - np.maximum(w, 0.0) / servo.no_load_speed
        torque: np.ndarray = servo.stall_torque * np.maximum(share, 0.0)
        return torque

    return -highest(-speed), highest(speed)


def beyond(source: Source, tau: np.ndarray, qd: np.ndarray) -> np.ndarray:
    """Return which samples exceed the servos' steady limits, of the torques' shape."""
    lowest, highest = servo_limits(source)[0](qd)
    # A servo at its limit is on it up to round-off.
    slack = 1e-6 * source.stall_torque
    outside: np.ndarray = (tau < lowest - slack) | (tau > highest + slack)
    return outside


def _shares(run: Run, tau: np.ndarray, qd: np.ndarray) -> str:
    words = servo_limits(run.source)[1]
    outside = 100 * float(beyond(run.source, tau, qd).mean())
    above = 100 * float((np.abs(tau) > run.source.continuous_torque).mean())
    return f"{words} · {outside:.2g} % of samples beyond it, {above:.2g} % above continuous"


def _draw_joint(
    axis: Axes,
    run: Run,
    tau: np.ndarray,
    qd: np.ndarray,
    legs: tuple[int, ...],
    joint: int,
) -> None:
    outside = beyond(run.source, tau, qd)
    every = -(-len(tau) // MOST_MARKS)
    for leg in legs:
        of = (slice(None), leg - 1, joint)
        kept = outside[of].copy()
        kept[::every] = True
        axis.plot(
            qd[of][kept],
            tau[of][kept],
            linestyle="",
            marker=".",
            markersize=2.2,
            markeredgewidth=0,
            color=leg_colour(leg - 1),
            alpha=0.5,
            # A hundred thousand marks are an image in vector files too.
            rasterized=True,
        )
    reach = 1.05 * max(run.source.no_load_speed, float(np.abs(qd).max(initial=0.0)))
    tiny = np.nextafter(0.0, 1.0)
    speed = np.concatenate([np.linspace(-reach, 0.0, 60), [tiny], np.linspace(0.0, reach, 60)[1:]])
    limits = servo_limits(run.source)[0]
    axis.plot(speed, limits(speed)[1], color=LIMIT_COLOUR, linewidth=1.2)
    speed = -speed[::-1]
    axis.plot(speed, limits(speed)[0], color=LIMIT_COLOUR, linewidth=1.2)
    advice = run.source.continuous_torque
    for level in (-advice, advice):
        axis.axhline(level, color=FAINT, linewidth=1.0, linestyle=ADVICE_DASH)
    axis.set_xlim(-reach, reach)
    # The limits of braking are far above those of driving, and would hide the marks.
    largest = max(1.25 * float(limits(np.array([tiny]))[1][0]), 1.1 * float(np.abs(tau).max()))
    low, high = axis.get_ylim() if axis.get_autoscaley_on() is False else (0.0, 0.0)
    axis.set_ylim(min(low, -largest), max(high, largest))
