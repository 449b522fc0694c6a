"""Torque over speed of the joints within the envelope of their servos, and paths of the feet."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np

from phasmid import kinematics
from phasmid.recording.channels import JOINTS
from phasmid.reporting.numbers import torque_and_speed
from phasmid.reporting.panels import Axes, Entry, Panels, listed_legs
from phasmid.reporting.run import Run, Source
from phasmid.reporting.style import FAINT, LIMIT_COLOUR, Figure, Layout, leg_colour
from phasmid.reporting.time_figures import Legs, leg_entries
from phasmid.servo.motor import Motor

MOST_MARKS = 20_000
"""Most samples of a joint that are drawn, besides those beyond the envelope."""

ADVICE_LINE: dict[str, Any] = {"color": FAINT, "linestyle": (0, (2.2, 1.6))}
BODY_LINE: dict[str, Any] = {"color": FAINT, "linewidth": 1.1, "linestyle": (0, (4, 1.6))}

Limits: TypeAlias = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
"""From speeds [rad/s] to the lowest and highest torques at them [N·m]; the last axes are joints."""


def envelope_figure(runs: Sequence[Run], legs: Legs, layout: Layout) -> Figure:
    """Draw torque over speed of the coxae, femora and tibiae of one run.

    Raises:
        InvalidInput: No torques have speeds beside them.
    """
    run = runs[0]
    drawing = Panels(layout, [2.9], columns=3)
    tau, qd, name = torque_and_speed(run)
    for joint, axis in enumerate(drawing.axes):
        _draw_joint(axis, run, joint, tau[..., joint], qd[..., joint], legs)
        axis.set_title(JOINTS[joint])
        axis.set_xlabel("speed [rad/s]")
    model = " by the model" if name.endswith("_model") else ""
    drawing.axes[0].set_ylabel(f"torque{model} [N·m]")
    blank: Entry = ("", {"color": "none"})
    entries = [
        *leg_entries(run, legs),
        *[blank] * (-len(legs) % 3),
        ("steady limit of the servo", {"color": LIMIT_COLOUR}),
        ("continuous torque", ADVICE_LINE),
    ]
    notes = [*run.caption, _shares(run, tau, qd)]
    return drawing.complete("Torque and speed of the servos", notes, entries, columns=3)


def servo_limits(source: Source, joint: Any = slice(None)) -> tuple[Limits, str]:
    """Return the torque limits of an experiment's servos at steady speed, and their conditions.

    The ideal servo, one whose stall current is not known, and those of joints that differ follow
    the straight line of their drive.

    Args:
        source: Its robot and drive are used.
        joint: The limits are those of all legs at this joint, 0 to 2, else of all joints, (L, 3).
    """
    servo, drive = source.robot.servo, source.experiment.solver.drive
    has_law = servo.stall_current is not None and source.robot.has_equal_servos
    if not has_law or drive in {"ideal-servo", "torque"}:
        arrays = source.robot.arrays
        own = arrays.stall_torque[:, joint], arrays.no_load_speed[:, joint]
        return lambda speed: ideal_limits(*own, speed), "line from stall to no-load speed"
    motor, share, voltage, stall = (
        servo.motor,
        servo.torque_limit,
        servo.voltage,
        servo.stall_torque,
    )
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


def ideal_limits(
    stall: np.ndarray, fastest: np.ndarray, speed: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and highest torque of ideal servos [N·m].

    They lie on a line from stall to no-load speed while it drives, at stall torque while it brakes.

    Args:
        stall: Stall torques [N·m].
        fastest: No-load speeds [rad/s].
        speed: At the output [rad/s], of a shape that broadcasts with theirs.
    """

    def highest(w: np.ndarray) -> np.ndarray:
        share = 1 - np.maximum(w, 0.0) / fastest
        torque: np.ndarray = stall * np.maximum(share, 0.0)
        return torque

    return -highest(-speed), highest(speed)


def beyond(source: Source, tau: np.ndarray, qd: np.ndarray, joint: Any = slice(None)) -> np.ndarray:
    """Return which samples exceed the servos' steady limits, of the torques' shape."""
    lowest, highest = servo_limits(source, joint)[0](qd)
    # A servo at its limit is on it up to round-off.
    slack = 1e-6 * source.robot.arrays.stall_torque[:, joint]
    return np.asarray((tau < lowest - slack) | (tau > highest + slack))


def _shares(run: Run, tau: np.ndarray, qd: np.ndarray) -> str:
    words = servo_limits(run)[1]
    outside = 100 * float(beyond(run, tau, qd).mean())
    above = 100 * float((np.abs(tau) > run.joint_continuous_torque).mean())
    return f"{words} · {outside:.2g} % of samples beyond it, {above:.2g} % above continuous"


def _draw_joint(
    axis: Axes, run: Run, joint: int, tau: np.ndarray, qd: np.ndarray, legs: Legs
) -> None:
    """Draw torques [N·m] over speeds [rad/s] of one joint of each leg, shape (N, L)."""
    kept = beyond(run, tau, qd, joint)
    kept[:: -(-len(tau) // MOST_MARKS)] = True
    # A hundred thousand marks are an image in vector files too.
    marks: dict[str, Any] = {"linestyle": "", "marker": ".", "markersize": 2.2, "rasterized": True}
    for leg in (leg - 1 for leg in legs):
        marks |= {"markeredgewidth": 0, "color": leg_colour(leg), "alpha": 0.5}
        axis.plot(qd[kept[:, leg], leg], tau[kept[:, leg], leg], **marks)
    # The joints share an axis.
    fastest = float(run.robot.arrays.no_load_speed.max())
    reach = 1.05 * max(fastest, float(np.abs(qd).max(initial=0.0)))
    tiny = np.nextafter(0.0, 1.0)
    speed = np.concatenate([np.linspace(-reach, 0.0, 60), [tiny], np.linspace(0.0, reach, 60)[1:]])
    limits = servo_limits(run, joint)[0]
    # One line for all legs that are alike.
    for way, side in ((speed, 1), (-speed[::-1], 0)):
        lines = np.unique(limits(way[:, None])[side], axis=1)
        axis.plot(way, lines, color=LIMIT_COLOUR, linewidth=1.2)
    for level in np.unique(run.joint_continuous_torque[:, joint]):
        for sign in (-1, 1):
            axis.axhline(sign * level, linewidth=1.0, **ADVICE_LINE)
    axis.set_xlim(-reach, reach)
    # The limits of braking are far above those of driving, and would hide the marks.
    largest = max(1.25 * float(limits(np.array([[tiny]]))[1].max()), 1.1 * float(np.abs(tau).max()))
    low, high = axis.get_ylim() if axis.get_autoscaley_on() is False else (0.0, 0.0)
    axis.set_ylim(min(low, -largest), max(high, largest))


def foot_path_figure(runs: Sequence[Run], legs: Legs, layout: Layout) -> Figure:
    """Draw foot paths of one run in body axes (left) and in the world, from above and aside."""
    run = runs[0]
    drawing = Panels(layout, [3.3, 2.3], columns=2, share_x=False, share_y=False)
    _draw_paths(drawing.axes, run, legs)
    entries = [*leg_entries(run, legs), ("body", BODY_LINE)]
    title = f"Foot paths of {listed_legs(legs)}"
    return drawing.complete(title, run.caption, entries, columns=4)


def feet_in_body(run: Run) -> np.ndarray:
    """Return the feet in the body frame [m], shape (N, L, 3)."""
    names = ("foot_position", "body_position", "body_orientation")
    feet, body, orientation = (run.recording[name].values for name in names)
    R_world_body = kinematics.quaternion_rotation(orientation)
    return np.asarray(np.einsum("nji,nlj->nli", R_world_body, feet - body[:, None, :]))


def _draw_paths(axes: Sequence[Axes], run: Run, legs: Legs) -> None:
    in_body = feet_in_body(run)
    in_world = np.asarray(run.recording["foot_position"].values)
    body = np.asarray(run.recording["body_position"].values)
    above_body, above_world, side_body, side_world = axes
    for above, side, feet in (
        (above_body, side_body, in_body),
        (above_world, side_world, in_world),
    ):
        for leg in legs:
            x, y, z = 1000 * feet[:, leg - 1].T
            # Seen from the right, legs of both sides may overlap: the first are wider.
            width = 2.6 if 2 * leg <= len(run.robot.legs) else 1.1
            line: dict[str, Any] = {"color": leg_colour(leg - 1), "linewidth": width}
            above.plot(x, y, **line)
            side.plot(x, z, **line)
    above_body.plot(0.0, 0.0, marker="+", markersize=8, color=FAINT, linestyle="")
    above_world.plot(1000 * body[:, 0], 1000 * body[:, 1], **BODY_LINE)
    names = ("body axes, above", "world, above", "body axes, side", "world, side")
    for axis, name in zip(axes, names, strict=True):
        axis.set_title(name)
        axis.set_xlabel("x, forward [mm]")
        axis.margins(x=0.05, y=0.1)
    above_body.set_ylabel("y, left [mm]")
    side_body.set_ylabel("z, up [mm]")
    for axis in (above_body, above_world):
        axis.set_aspect("equal", adjustable="datalim")
