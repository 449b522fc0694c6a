"""Tables of a scenario file, besides its terrain: values, units, bounds and defaults."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

from annotated_types import Ge, Gt, Le, Lt
from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from phasmid.experiment.analysis import Analysis
from phasmid.experiment.contact_law import ContactKind, ContactLaw
from phasmid.gait import Gait, is_gait_file, read_gait
from phasmid.robot.similarity import Scale
from phasmid.robot.table import MOST_LEGS
from phasmid.servo import Servo
from phasmid.servo.catalogue import known_name
from phasmid.servo.servo import AMBIENT, both_directions
from phasmid.tables import (
    Hint,
    Length,
    Mass,
    Number,
    Of,
    Table,
    Temperature,
    Voltage,
)
from phasmid.units import STANDARD_GRAVITY


class GaitTable(Table):
    """``gait = "wave"``, a gait file, or a table of its own numbers.

    Attributes:
        name: A gait of the library, a gait file, or any name where offsets are given; absent: the
            first of the library for the robot's number of legs.
        duty_factor: Fraction of the cycle during which each foot is on the ground.
        offsets: For each leg the fraction of the cycle at which it lifts, in the legs' order, or
            by the legs' names.
        sway: Lateral displacement of the body away from lifted feet, as a fraction of their
            distance from the centre of all feet; absent: that of the library's gait, or none.
    """

    name: str | None = None
    duty_factor: Number | None = None
    offsets: (
        Annotated[tuple[Number, ...], Field(max_length=MOST_LEGS)]
        | Annotated[dict[str, Number], Field(max_length=MOST_LEGS)]
        | None
    ) = None
    sway: Number | None = None

    @model_validator(mode="before")
    @classmethod
    def _from_name(cls, raw: Any) -> Any:
        if isinstance(raw, Gait):
            return _fields(raw, tuple(float(offset) for offset in raw.offsets))
        if isinstance(raw, str | Path):
            raw = {"name": str(raw)}
        if isinstance(raw, Mapping) and raw.get("offsets") is None:
            name = raw.get("name")
            if isinstance(name, str) and is_gait_file(name):
                # The scenario carries the numbers, and repeats without the file.
                gait, legs = read_gait(Path(name))
                offsets = tuple(float(offset) for offset in gait.offsets)
                by_leg = dict(zip(legs, offsets, strict=True)) if legs else offsets
                given = {k: v for k, v in raw.items() if k != "name" and v is not None}
                return _fields(gait, by_leg) | given
        return raw


def _fields(gait: Gait, offsets: tuple[float, ...] | dict[str, float]) -> dict[str, Any]:
    fields = {"name": gait.name, "duty_factor": gait.duty_factor, "offsets": offsets}
    return fields | ({"sway": gait.sway} if gait.sway else {})


class ModelTable(Analysis):
    """``[model]``: assumptions on the robot and its mechanics, and options of the analysis.

    Attributes:
        mass_model: ``as-given``, or ``mid-length``: centres of mass at mid-length and principal
            inertias only, as the printed Eq. 10 assumes.
        mounts: ``as-given``, or ``perpendicular``: all legs square to the direction of walking.
        gravity: Acceleration of free fall [m/s²].
        payload: Mass that the robot carries at the centre of its trunk's upper side [kg].
    """

    mass_model: Literal["as-given", "mid-length"] = "as-given"
    mounts: Literal["as-given", "perpendicular"] = "as-given"
    gravity: Annotated[Number, Gt(0), Le(100)] = STANDARD_GRAVITY
    payload: Annotated[Mass, Ge(0), Le(100)] = 0.0


SOFTEST = 1.0
"""Least stiffness of a contact point [N/m]: on a softer one a small robot sinks in deeper than its
legs are long."""

STIFFEST = 1e9
"""Largest stiffness of a contact point [N/m]: steel on steel has about 1e8."""

MOST_DAMPING = 1e6
"""Damping of a contact point [N·s/m]: three times the critical one of 100 kg on the stiffest."""

STIFFNESS = 1e4
"""Stiffness of a contact point under ``phantomx-ax`` [N/m]: the default of the paper's library."""

DAMPING = {"spring-damper": 30.0, "mujoco": 30.0, "simscape": 100.0}
"""Damping of each law under ``phantomx-ax`` [N·s/m]; the engine's own law has none."""

FRICTION_DAMPING = 500.0
"""Friction damping of a contact point under ``phantomx-ax`` [N·s/m]."""

TIP_WIDTH = 0.004
"""Side of the square of a foot's contact points of ``phantomx-ax`` [m]."""

POINT_RADIUS = 0.0005
"""Radius of a contact point of ``phantomx-ax`` [m]."""


class ContactTable(Table):
    """``[contact]``: four points on each foot, and the law by which the ground holds them.

    Numbers that are absent follow the robot's weight per leg w and its leg length l, so that large
    and small robots sink in and creep alike: stiffness as w/l, damping as w/√l, lengths as l. The
    values below are those of ``phantomx-ax``.

    Attributes:
        contact_law: ``spring-damper``: a linear spring and damper per point; ``mujoco``: the
            engine's own soft contact with its own numbers; ``simscape``: the law of the paper's
            library, a one-sided damper and stick-slip friction, in a simulator of its own, of
            prescribed joints on level ground.
        contact_scale: Robot whose weight and leg length scale the numbers that are absent: the
            ``robot``, as in its file and at standard gravity; or ``phantomx-ax``, as in the paper.
        stiffness: Stiffness of each of a foot's four contact points [N/m]; absent: 1e4, scaled.
        damping: Damping of each of a foot's four contact points [N·s/m]; absent: the law's own,
            scaled: 30 for ``spring-damper``, 100 for ``simscape``, whose points damp only while
            they sink in. With 50 and more of ``spring-damper``, feet that slide for long chatter.
        friction_damping: Law ``spring-damper``: tangential damping of each sticking point [N·s/m];
            absent: 500, scaled. A loaded foot creeps with its tangential force over this damping.
            Larger values reduce creep and preserve internal forces between the feet.
        kinetic_friction: Law ``simscape``: coefficient of friction of a sliding foot, at most that
            of the ground, which is the static one.
        friction_threshold: Law ``simscape``: speed below which a foot sticks, by creeping [m/s].
        impedance: Law ``spring-damper``, the engine's d: a point's force also resists its
            acceleration, with a mass of d/(1 - d) times that with which the foot resists a push.
        tip_width: Side of the square on which the four points of a foot lie [m]; absent: 4 mm,
            scaled.
    """

    contact_law: ContactKind = "spring-damper"
    contact_scale: Literal["robot", "phantomx-ax"] = "robot"
    stiffness: Annotated[
        Annotated[Number, Ge(SOFTEST), Le(STIFFEST)] | None, Of("spring-damper", "simscape")
    ] = None
    damping: Annotated[
        Annotated[Number, Gt(0), Le(MOST_DAMPING)] | None, Of("spring-damper", "simscape")
    ] = None
    friction_damping: Annotated[
        Annotated[Number, Gt(0), Le(MOST_DAMPING)] | None, Of("spring-damper")
    ] = None
    kinetic_friction: Annotated[Number, Ge(0), Le(10), Of("simscape")] = 0.5
    friction_threshold: Annotated[Number, Gt(0), Of("simscape")] = 1e-3
    impedance: Annotated[Number, Gt(0.01), Lt(0.99), Of("spring-damper")] = 0.2
    tip_width: Annotated[Length, Gt(0), Le(0.1)] | None = None

    def law(self, scale: Scale) -> ContactLaw:
        """Return the law with the numbers of a robot of a scale."""
        if self.contact_scale == "phantomx-ax":
            scale = Scale()

        def number(given: float | None, reference: float, ratio: float) -> float:
            return reference * ratio if given is None else given

        return ContactLaw(
            self.contact_law,
            number(self.stiffness, STIFFNESS, scale.stiffness),
            number(self.damping, DAMPING[self.contact_law], scale.damping),
            number(self.friction_damping, FRICTION_DAMPING, scale.damping),
            self.impedance,
            number(self.tip_width, TIP_WIDTH, scale.length),
            POINT_RADIUS * scale.length,
            self.kinetic_friction,
            self.friction_threshold,
        )


Ticks = Annotated[Number, Ge(0), Le(254)]
Pair = Annotated[
    Annotated[tuple[Ticks, Ticks], BeforeValidator(both_directions)] | None,
    Hint("a number of ticks, or two of them, such as [1, 2]"),
]


class ServoTable(Table):
    """``servo = "MX-28"``, or ``[servo]`` with settings; absent ones are the servo's own.

    Servo, supply and torque limit count with every drive, the air for heat and its verdict. The
    others concern ``drive = "servo"``.

    Attributes:
        servo: Servo of the catalogue at all joints, such as ``MX-28``; absent: the robot's own.
        voltage: Supply of the servos [V]; absent: the servo's rated voltage.
        ambient_temperature: Temperature of the air, and of the servos at the start [°C].
        torque_limit: Largest output, as a fraction of the full output.
        compliance_margin: Position error up to which the output is zero [ticks]; two numbers for
            errors towards smaller and towards larger angles.
        compliance_slope: Error beyond the margin at which the output is full [ticks], or two
            numbers; rounded down to a power of two from 2 to 128.
        punch: Output at the margin, in 1/1023 of the full output.
        p_gain: Output per position error of a servo with a PID law, in its maker's units.
        d_gain: Output per rate of that error, in its maker's units.
    """

    servo: Annotated[str, AfterValidator(known_name)] | None = None
    voltage: Annotated[Voltage, Gt(0), Le(100)] | None = None
    ambient_temperature: Annotated[Temperature, Ge(-50), Le(100)] = AMBIENT
    torque_limit: Annotated[Number, Gt(0), Le(1)] | None = None
    compliance_margin: Pair = None
    compliance_slope: Pair = None
    punch: Annotated[Number, Ge(0), Le(1023)] | None = None
    p_gain: Annotated[Number, Ge(0), Le(16383)] | None = None
    d_gain: Annotated[Number, Ge(0), Le(16383)] | None = None

    @model_validator(mode="before")
    @classmethod
    def _from_name(cls, raw: Any) -> Any:
        return {"servo": raw} if isinstance(raw, str) else raw

    def set_up(self, servo: Servo) -> Servo:
        """Return a servo with these settings in place of its own, at this supply, in this air."""
        settings = self.model_dump(exclude={"servo", "voltage"}, exclude_none=True)
        sources = dict(servo.sources) | dict.fromkeys(settings.keys() & servo.sources, "scenario")
        supply = servo.supply if self.voltage is None else self.voltage
        return replace(servo, **settings, sources=sources, supply=supply)
