"""Tables of a scenario file, besides its terrain: values, units, bounds and defaults."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from annotated_types import Ge, Gt, Le, Lt
from jaxtyping import Float
from pydantic import BeforeValidator, Field, model_validator

from phasmid.errors import InvalidInput
from phasmid.experiment.contact_law import ContactKind, ContactLaw
from phasmid.gait import Gait, is_gait_file, read_gait
from phasmid.robot.similarity import Scale
from phasmid.robot.table import MOST_LEGS
from phasmid.servo import Servo
from phasmid.servo.servo import AMBIENT, both_directions
from phasmid.tables import (
    Angle,
    AngularVelocity,
    Count,
    Hint,
    Length,
    Mass,
    Number,
    Of,
    Table,
    Temperature,
    Time,
    Voltage,
)
from phasmid.units import STANDARD_GRAVITY, rounded_down


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


REFERENCE_PERIOD = 2.0
"""Period of ``phantomx-ax`` where the scenario gives none [s]: that of the paper."""


class StrideTable(Table):
    """``[stride]``: how the feet travel.

    Attributes:
        step_length: Forward displacement of the body during one stance [m].
        step_sideways: Displacement of the body to the left during one stance [m].
        step_turn: Turn of the body to the left during one stance [rad].
        step_height: Height to which a swinging foot lifts [m].
        period: Time of one cycle, in which every leg steps once [s]; absent: 2 s for
            ``phantomx-ax``, and proportional to the root of the leg length for other robots.
        samples: Samples of one cycle, both ends included.
        stance_law: ``straight``: feet on the ground do not move; ``coxa-only``: only the coxa
            joint moves in stance, so that feet slip.
        stance_timing: ``rest-to-rest``: the body stops whenever a foot lifts or lands;
            ``constant-speed``: it never stops.
        curve: Polynomial of all paths: the paper's quintic, or the cubic spline of its ref. [11].
        stance_radius: Distance of the neutral feet from their hips, seen from above [m]; absent:
            the robot's.
        body_height: Height of the hips over level ground [m]; absent: the robot's.
    """

    step_length: Length = 0.040
    step_sideways: Length = 0.0
    step_turn: Annotated[Angle, Ge(-np.pi), Le(np.pi)] = 0.0
    step_height: Annotated[Length, Ge(0)] = 0.030
    period: Annotated[Time, Gt(0)] | None = None
    samples: Annotated[Count, Ge(9), Le(100_000), Hint("samples = 41, as in the paper")] = 41
    stance_law: Literal["straight", "coxa-only"] = "straight"
    stance_timing: Literal["rest-to-rest", "constant-speed"] = "rest-to-rest"
    curve: Literal["quintic", "cubic-spline"] = "quintic"
    stance_radius: Annotated[Length, Gt(0), Le(2)] | None = None
    body_height: Annotated[Length, Gt(0), Le(2)] | None = None

    @property
    def step(self) -> Float[np.ndarray, "3"]:
        """Displacement of one step: forward [m], left [m], turn [rad]."""
        return np.array([self.step_length, self.step_sideways, self.step_turn])

    def scaled(self, factor: float) -> Self:
        """Return the stride with steps of another size."""
        steps = ("step_length", "step_sideways", "step_turn")
        return self.model_copy(update={name: factor * getattr(self, name) for name in steps})

    def planned(self, scale: Scale) -> Stride:
        """Return the stride of a robot of a scale, with its period rounded to 10 ms."""
        period = round(REFERENCE_PERIOD * scale.time, 2) if self.period is None else self.period
        return Stride.model_construct(**{**dict(self), "period": period})


class Stride(StrideTable):
    """A stride whose period is known.

    Attributes:
        period: Time of one cycle [s].
    """

    period: Annotated[Time, Gt(0)]


class FootingTable(Table):
    """``[footing]``: adaptation of a walk to ground that the plan follows.

    The lengths and angles are assumptions, for feet of some millimetres and servos that place them
    within one or two.

    Attributes:
        search_radius: Largest distance of a foothold from its place on level ground [m].
        foothold_margin: Radius around a foothold within which the ground must be even [m].
        steepest_foothold: Steepest slope on which a foot is placed [rad].
        deepest_foothold: Depth below both sides from which ground counts as a gap, on which no foot
            is placed [m].
        least_friction: Coefficient of friction below which ground is avoided.
        trunk_attitude: ``follow-terrain``: the trunk leans with the ground under its feet;
            ``level``: the trunk stays level.
        steepest_lean: Largest lean of the trunk [rad].
    """

    search_radius: Annotated[Length, Ge(0), Le(0.5)] = 0.040
    foothold_margin: Annotated[Length, Gt(0), Le(0.1)] = 0.010
    steepest_foothold: Annotated[Angle, Gt(0), Le(np.pi / 4)] = np.radians(30)
    deepest_foothold: Annotated[Length, Gt(0)] = 0.050
    least_friction: Annotated[Number, Ge(0)] = 0.3
    trunk_attitude: Literal["follow-terrain", "level"] = "follow-terrain"
    steepest_lean: Annotated[Angle, Ge(0), Le(np.pi / 4)] = np.radians(25)


class ModelTable(Table):
    """``[model]``: assumptions of analysis and simulation on the robot and its mechanics.

    Attributes:
        mass_model: ``as-given``, or ``mid-length``: centres of mass at mid-length and principal
            inertias only, as the printed Eq. 10 assumes.
        mounts: ``as-given``, or ``perpendicular``: all legs square to the direction of walking.
        body_acceleration: Whether the analysis counts the motion (``included``) or only gravity
            (``quasi-static``).
        force_model: How the analysis shares the load among the feet: ``minimum-norm`` of the
            forces, the paper's; ``weighted-minimum-norm``, where forces along the ground count
            more; ``minimum-torque`` of the joints; ``friction-cone``: the minimum norm of forces
            that do not pull or slip; ``smallest-largest-load``, within the same limits.
        tangential_weight: Of ``weighted-minimum-norm``: cost of a force along the ground beside
            that of a normal one.
        torque_limits: Whether ``friction-cone`` and ``smallest-largest-load`` also keep the
            standing legs' joints within the servo's stall torque.
        load_transfer: Time in which the load moves when a foot lands or lifts, centred on the
            event [s]; 0: at once.
        gravity: Acceleration of free fall [m/s²].
        payload: Mass that the robot carries at the centre of its trunk's upper side [kg].
    """

    mass_model: Literal["as-given", "mid-length"] = "as-given"
    mounts: Literal["as-given", "perpendicular"] = "as-given"
    body_acceleration: Literal["included", "quasi-static"] = "included"
    force_model: Literal[
        "minimum-norm",
        "weighted-minimum-norm",
        "minimum-torque",
        "friction-cone",
        "smallest-largest-load",
    ] = "minimum-norm"
    tangential_weight: Annotated[Number, Gt(0), Le(1e6)] = 10.0
    torque_limits: Literal["ignored", "counted"] = "ignored"
    load_transfer: Annotated[Time, Ge(0)] = 0.0
    gravity: Annotated[Number, Gt(0), Le(100)] = STANDARD_GRAVITY
    payload: Annotated[Mass, Ge(0), Le(100)] = 0.0


USUAL_STEP = 0.001
"""Time step where no part of an experiment needs a shorter one [s]."""


class SimulationTable(Table):
    """``[simulation]``: how the engine runs.

    Attributes:
        drive: ``prescribed``: joints follow the plan, at any torque, as in the paper;
            ``ideal-servo``: position servos with the torque and speed limits of the robot's servo;
            ``servo``: the robot's servo with its own law, motor, gears and heat; ``torque``: the
            torque of the planned motion by inverse dynamics plus a correction of errors, within the
            torque and speed limits of the robot's servo. Absent: ``prescribed`` for a planned walk;
            for a driven robot ``servo``, or ``ideal-servo`` where no stall current is known.
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
    def can_lie(self) -> bool:
        """True if the trunk can lie on the ground."""
        return self.belly_contact or self.start_posture == "packed"


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
        )


Ticks = Annotated[Number, Ge(0), Le(254)]
Pair = Annotated[
    Annotated[tuple[Ticks, Ticks], BeforeValidator(both_directions)] | None,
    Hint("a number of ticks, or two of them, such as [1, 2]"),
]


class ServoTable(Table):
    """``[servo]``: settings of the robot's servos; those that are absent are the servo's own.

    Supply and torque limit count with every drive, the air for heat and its verdict. The others
    concern ``drive = "servo"``.

    Attributes:
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

    voltage: Annotated[Voltage, Gt(0), Le(100)] | None = None
    ambient_temperature: Annotated[Temperature, Ge(-50), Le(100)] = AMBIENT
    torque_limit: Annotated[Number, Gt(0), Le(1)] | None = None
    compliance_margin: Pair = None
    compliance_slope: Pair = None
    punch: Annotated[Number, Ge(0), Le(1023)] | None = None
    p_gain: Annotated[Number, Ge(0), Le(16383)] | None = None
    d_gain: Annotated[Number, Ge(0), Le(16383)] | None = None

    def set_up(self, servo: Servo) -> Servo:
        """Return a servo with these settings in place of its own, at this supply, in this air."""
        settings = self.model_dump(exclude={"voltage"}, exclude_none=True)
        sources = dict(servo.sources) | dict.fromkeys(settings.keys() & servo.sources, "scenario")
        supply = servo.supply if self.voltage is None else self.voltage
        return replace(servo, **settings, sources=sources, supply=supply)


SENSORS = ("joint", "imu", "foot")
"""Sensors, by the beginning of their options' names."""


FORCE_NOISE = 0.1
"""Noise of the normal force of a foot of ``phantomx-ax`` [N]."""

TOUCHING_FORCE = 0.5
"""Normal force from which a foot of ``phantomx-ax`` counts as touching [N]."""


class SensorsTable(Table):
    """``[sensors]``: rate, delay and noise of the robot's sensors.

    The defaults are those of an AX-12A on its bus and of a small inertial sensor such as the
    MPU-6050, with its ranges at power-on; noises are standard deviations of one sample.

    Attributes:
        measured: Whether a recording also contains sensor readings (``everything``), or only true
            values (``nothing``).
        body_state: Pose by which a driven robot follows waypoints: the true one, or the one
            estimated by legs and inertial sensor, which controllers observe too.
        sensor_seed: Seed of all noise and biases.
        joint_rate: Readings of each joint's angle and load a second [1/s]. At 1 Mbit/s and the
            default return delay of 0.5 ms, reading 18 servos in turn takes 13 ms.
        joint_delay: Time from a reading to its arrival [s].
        encoder_step: Angle from one tick of the joints' encoders to the next [rad]; 0: exact.
        load_step: Share of full output by which the load reading steps; an AX-12A has 1023 steps.
        imu_rate: Readings of gyro, accelerometer and orientation a second [1/s].
        imu_delay: Time from a reading to its arrival [s].
        gyro_noise: Standard deviation of each axis [rad/s].
        gyro_bias: Standard deviation of each axis' constant error [rad/s]; assumed: what is left
            of the chip's 20 deg/s after taking the mean at rest.
        gyro_range: Largest reading of the gyro [rad/s].
        accelerometer_noise: Standard deviation of each axis [m/s²]: 400 µg/√Hz at 100 Hz.
        accelerometer_bias: Standard deviation of each axis' constant error [m/s²]; assumed.
        accelerometer_range: Largest reading of the accelerometer [m/s²].
        orientation_noise: Standard deviation of the orientation's error about each axis [rad];
            assumed.
        foot_rate: Readings of each foot's force and contact a second [1/s].
        foot_delay: Time from a reading to its arrival [s].
        foot_force_noise: Standard deviation of the normal force [N]; absent: 0.1 N for
            ``phantomx-ax``, scaled with the weight per leg for other robots; assumed.
        contact_threshold: Normal force from which a foot counts as in contact [N]; absent: 0.5 N
            for ``phantomx-ax``, scaled with the weight per leg for other robots; assumed.
        depth: Depth sensor of a driven robot: ``none``; ``camera`` at the trunk's front, pitched
            down; ``lidar`` on a mast, with all directions; ``exact``: the true ground on a lattice
            of 20 mm within 0.5 m, at once. The sensor works with any value of `measured`.
        depth_rate: Readings of the depth sensor per second [1/s].
        depth_delay: Time from a reading to its arrival [s].
        depth_noise: Standard deviation of each range, relative to it: half of the 2 % by which a
            RealSense D405 may err at 0.5 m.
        depth_dropout: Fraction of the rays without a reading; assumed.
        depth_drift: Standard deviation of the mounting angles' random walk after a minute [rad];
            assumed.
        depth_range: Longest range of the depth sensor [m].
    """

    measured: Literal["nothing", "everything"] = "nothing"
    body_state: Literal["true", "estimated"] = "true"
    sensor_seed: Annotated[Count, Ge(0), Le(2**63 - 1)] = 0
    joint_rate: Annotated[Number, Gt(0), Le(1e6)] = 50.0
    joint_delay: Annotated[Time, Ge(0), Le(10)] = 0.013
    encoder_step: Annotated[Angle, Ge(0), Le(math.pi)] = math.radians(300 / 1024)
    load_step: Annotated[Number, Ge(0), Le(1)] = 1 / 1023
    imu_rate: Annotated[Number, Gt(0), Le(1e6)] = 100.0
    imu_delay: Annotated[Time, Ge(0), Le(10)] = 0.005
    gyro_noise: Annotated[AngularVelocity, Ge(0)] = math.radians(0.05)
    gyro_bias: Annotated[AngularVelocity, Ge(0)] = math.radians(0.1)
    gyro_range: Annotated[AngularVelocity, Gt(0)] = math.radians(250)
    accelerometer_noise: Annotated[Number, Ge(0)] = 0.004 * STANDARD_GRAVITY
    accelerometer_bias: Annotated[Number, Ge(0)] = 0.05
    accelerometer_range: Annotated[Number, Gt(0)] = 2 * STANDARD_GRAVITY
    orientation_noise: Annotated[Angle, Ge(0), Le(1)] = math.radians(0.5)
    foot_rate: Annotated[Number, Gt(0), Le(1e6)] = 100.0
    foot_delay: Annotated[Time, Ge(0), Le(10)] = 0.005
    foot_force_noise: Annotated[Number, Ge(0)] | None = None
    contact_threshold: Annotated[Number, Gt(0)] | None = None
    depth: Literal["none", "camera", "lidar", "exact"] = "none"
    depth_rate: Annotated[Number, Gt(0), Le(1e3), Of("camera", "lidar", "exact")] = 20.0
    depth_delay: Annotated[Time, Ge(0), Le(10), Of("camera", "lidar")] = 0.05
    depth_noise: Annotated[Number, Ge(0), Le(0.2), Of("camera", "lidar")] = 0.01
    depth_dropout: Annotated[Number, Ge(0), Le(1), Of("camera", "lidar")] = 0.05
    depth_drift: Annotated[Angle, Ge(0), Le(0.2), Of("camera", "lidar")] = math.radians(0.2)
    depth_range: Annotated[Length, Gt(0), Le(1.5), Of("camera", "lidar")] = 1.5

    def force_noise(self, scale: Scale) -> float:
        """Return the noise of the normal force of a robot of a scale [N]."""
        given = self.foot_force_noise
        return FORCE_NOISE * scale.force if given is None else given

    def touching_force(self, scale: Scale) -> float:
        """Return the normal force from which a foot of a robot of a scale touches [N]."""
        given = self.contact_threshold
        return TOUCHING_FORCE * scale.force if given is None else given

    def check_interval(self, interval: float, sensors: Iterable[str] = SENSORS) -> None:
        """Refuse samples so rare that a reading would fall between two of them.

        Args:
            interval: From one recorded sample to the next [s].
            sensors: Those that are to read, each the beginning of its options' names.

        Raises:
            InvalidInput: A sensor reads more often; old values would pass for new ones.
        """
        names = [f"{sensor}_rate" for sensor in sensors]
        # A millionth: times of samples are sums of steps.
        quick = [name for name in names if interval * getattr(self, name) > 1 + 1e-6]
        if quick:
            raise InvalidInput(
                f"{quick[0]} is {getattr(self, quick[0]):g} readings a second and a sample is "
                f"recorded every {1000 * interval:g} ms; old values would pass for new readings.",
                hint=", ".join(f"{name} = {rounded_down(1 / interval)}" for name in quick),
            )
