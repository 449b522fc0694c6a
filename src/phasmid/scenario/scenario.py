"""One typed table describes one experiment."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any

from annotated_types import Ge, Gt, Le
from pydantic import ConfigDict, StringConstraints, model_validator

from phasmid.errors import InvalidGait, InvalidInput, advised, nearest
from phasmid.experiment import (
    Course,
    Experiment,
    Footing,
    Sensors,
    Solver,
    World,
    usual_drive,
)
from phasmid.experiment.course import StrideTable
from phasmid.experiment.solver import SETTLING_TIME, USUAL_STEP
from phasmid.formats.import_options import ImportOptions
from phasmid.gait import (
    GAIT_NAMES,
    Gait,
    check_gait_name,
    default_gait,
    gaits_of,
    load_gait,
    offsets_in_order,
)
from phasmid.recording.channels import MOST_RECORDED
from phasmid.robot import (
    Robot,
    load_robot,
    with_mass_model,
    with_mounts,
    with_neutral_foot,
    with_payload,
    with_servo,
    with_values,
)
from phasmid.robot.similarity import scale_of
from phasmid.scenario.tables import ContactTable, GaitTable, ModelTable, ServoTable
from phasmid.scenario.terrain import TerrainTable
from phasmid.servo import load_servo
from phasmid.tables import (
    Count,
    Hint,
    Locator,
    Table,
    Time,
    dotted,
    key_of,
    leaves,
    validate,
)
from phasmid.terrain import Flat, Ground
from phasmid.toml import is_file
from phasmid.units import rounded_down, split_unit

MOST_SAMPLES = 10_000_000
"""Most samples of a planned walk: above it the walk alone would fill the memory."""


class Scenario(Table):
    """One experiment: robot, gait, stride, ground and simulation.

    Values inside are SI; keys of files and of `replace` may end in a unit.

    Attributes:
        format: Version of this table.
        name: Short name, also of its result folder.
        description: Purpose of the experiment.
        robot: A preset, a robot file, or a `Robot`.
        duration: Length of the walk [s].
        gait: Which legs stand, when.
        stride: How the feet travel.
        footing: Adaptation of the walk to ground that the plan follows.
        model: Assumptions on the robot and its mechanics.
        simulation: How the engine runs.
        contact: Feet on the ground.
        terrain: The ground.
        servo: The servos, their settings and supply.
        sensors: Sensors of the robot and their quality.
        robot_import: How a robot is read from URDF, MJCF or STEP.
    """

    model_config = ConfigDict(arbitrary_types_allowed=True)

    format: Annotated[Count, Ge(1), Le(1), Hint("upgrade phasmid for newer files")] = 1
    name: Annotated[
        str,
        StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$"),
        Hint('name = "walk", of letters, digits, and . _ - between them, 64 at most'),
    ] = "walk"
    description: str = ""
    robot: str | Robot = "phantomx-paper"
    duration: Annotated[Time, Gt(0)] = 10.0
    gait: GaitTable = GaitTable()
    stride: StrideTable = StrideTable()
    footing: Footing = Footing()
    model: ModelTable = ModelTable()
    simulation: Solver = Solver()
    contact: ContactTable = ContactTable()
    terrain: TerrainTable = TerrainTable()
    servo: ServoTable = ServoTable()
    sensors: Sensors = Sensors()
    robot_import: ImportOptions = ImportOptions()

    @model_validator(mode="after")
    def _check_gait(self) -> Scenario:
        name = self.gait.name
        if name is not None and self.gait.offsets is None and name not in GAIT_NAMES:
            try:
                legs = len(self.base_robot().legs)
            except InvalidInput:
                # A robot that cannot be read is refused when the walk is planned.
                legs = 6
            check_gait_name(name, legs)
        return self

    @model_validator(mode="after")
    def _check_size(self) -> Scenario:
        dt, most = self.simulation.time_step, self.simulation.max_steps
        steps = (self.duration + SETTLING_TIME) / dt
        if steps > most:
            raise InvalidInput(
                f"{self.duration:g} s at {1000 * dt:g} ms is {steps:.3g} steps, with "
                f"{SETTLING_TIME:g} s to settle; the limit is {float(most):g}.",
                hint=self._shorter(),
            )
        if self.stride.period is not None:
            self._check_samples(self.stride.period)
        interval = self.simulation.record_interval
        count = 1.0 if interval is None else interval / dt
        is_whole = round(count) >= 1 and abs(count - round(count)) <= 1e-6
        if not is_whole and self.simulation.dt is not None:
            raise InvalidInput(
                f"record_interval is {interval:g} s; "
                f"it must be a whole number of steps of {dt:g} s.",
                hint=f"record_interval = {max(1, round(count)) * dt:.9g}",
            )
        if self.sensors.measured == "everything":
            self.sensors.check_interval(dt * self.simulation.record_steps)
        steps = self.simulation.record_steps
        recorded = self.duration / (dt * steps)
        if recorded > MOST_RECORDED:
            raise InvalidInput(
                f"{self.duration:g} s recorded every {1000 * dt * steps:g} ms is "
                f"{recorded:.3g} samples, about {recorded * 2.1e-6:.3g} GB; the limit is "
                f"{float(MOST_RECORDED):g}.",
                hint=self._shorter(),
            )
        return self

    def _shorter(self, period: float = math.inf) -> str:
        """Return a duration within all limits of a run's size, or a time step that allows one."""
        dt, period = self.simulation.time_step, self.stride.period or period
        longest = min(
            self.simulation.max_steps * dt - SETTLING_TIME,
            MOST_RECORDED * dt * self.simulation.record_steps,
            MOST_SAMPLES * period / self.stride.samples,
        )
        return f"duration = {rounded_down(longest)}" if longest > dt else f"dt = {USUAL_STEP}"

    def _check_samples(self, period: float) -> None:
        samples = self.duration / period * self.stride.samples
        if samples > MOST_SAMPLES:
            raise InvalidInput(
                f"{self.duration:g} s at {self.stride.samples} samples a cycle is {samples:.3g} "
                f"samples; the limit is {float(MOST_SAMPLES):g}.",
                hint=self._shorter(period),
            )

    def replace(self, **changes: Any) -> Scenario:
        """Return this scenario with other values.

        Args:
            **changes: Any field by its own name, such as ``duration=4``, ``gait="wave"`` or
                ``step_length=0.06`` (SI); with a unit also ``step_length_mm=60``. A whole table
                may be given by its name, and a value of the robot's file by its place, as in
                ``**{"robot.legs.*.tibia_mm": 60}``; ``*`` stands for all legs.

        Raises:
            InvalidInput: There is no such field, or the value is refused.
        """
        return self.changed(changes, lambda loc: (dotted(loc), ""))

    def changed(self, changes: Mapping[str, Any], locate: Locator) -> Scenario:
        """As `replace`, with other words in messages.

        Args:
            changes: Values by field name.
            locate: Returns the subject and the place of a value, by the field's path.
        """
        raw: dict[str, Any] = self.model_dump(exclude={"robot"}) | {"robot": self.robot}
        paths = {path[-1]: path for path in option_keys().values() if path != ("gait", "name")}
        if isinstance(changes.get("terrain"), str):
            # The kind of terrain, given by its name alone; its other fields stay.
            changes = {"kind" if k == "terrain" else k: v for k, v in changes.items()}
        of_robot = {k.removeprefix("robot."): v for k, v in changes.items() if _is_of_robot(k)}
        changes = {key: value for key, value in changes.items() if not _is_of_robot(key)}
        given: dict[str, str] = {}
        # The gait goes first, so that a duty factor given beside it is kept.
        for key, value in sorted(changes.items(), key=lambda item: item[0] != "gait"):
            stem = split_unit(key)[0]
            name = stem if stem in paths or stem in Scenario.model_fields else key
            if name in given:
                raise InvalidInput(f'"{given[name]}" and "{key}" are one field; one must go.')
            given[name] = key
            if key == "servo" and (value is None or isinstance(value, str)):
                # The servo, given by its name alone; its settings stay.
                table = raw[key]
            elif name in Scenario.model_fields:
                table = raw
                if key == "gait" and (value is None or isinstance(value, str)):
                    value = {"name": value}
            elif name in paths:
                table = raw[paths[name][0]]
            else:
                guess = nearest(key, [*option_keys(), *Scenario.model_fields])
                raise InvalidInput(
                    f'a scenario has no field "{key}".', hint=f'"{guess}"' if guess else ""
                )
            table.pop(name, None)
            table[key] = value
        scenario = validate(Scenario, raw, locate)
        if of_robot:
            # The values count, also those of the servo.
            robot = with_values(scenario.base_robot(), of_robot)
            return scenario.replace(robot=robot, servo=None)
        return scenario

    def text(self) -> str:
        """Return this scenario as TOML, whose robot is the file ``robot.toml``."""
        # Lazy import: files of scenarios hold scenarios.
        from phasmid.scenario.file import scenario_to_toml

        return scenario_to_toml(self, "robot.toml")

    def load_robot(self) -> Robot:
        """Return the robot as supplied: with this scenario's variants, payload, stance and servos.

        Its servos have the settings and the supply of ``[servo]``.

        Raises:
            InvalidInput: The robot file is absent or not well formed.
            InvalidRobot: No machine could have these numbers.
        """
        robot = with_mass_model(self.base_robot(), self.model.mass_model)
        robot = with_mounts(robot, self.model.mounts)
        robot = with_payload(robot, self.model.payload)
        robot = replace(robot, servo=self.servo.set_up(robot.servo))
        return with_neutral_foot(robot, self.stride.stance_radius, self.stride.body_height)

    def driven(self) -> Scenario:
        """Return this scenario with the drive of a driven robot, as `Experiment.driven` has it."""
        return self.replace(drive=self.simulation.drive or usual_drive(self.base_robot()))

    def build(self) -> Experiment:
        """Return the experiment of this scenario, composed and checked.

        Raises:
            InvalidInput: A file is absent or not well formed, or the walk has too many samples.
            InvalidRobot: No machine could have the robot's numbers.
            InvalidGait: The gait does not fit the robot.
        """
        base, robot, terrain = self.base_robot(), self.load_robot(), self.load_terrain()
        scale = scale_of(base)
        stride = self.stride.planned(scale)
        self._check_samples(stride.period)
        world = World(
            terrain,
            Ground(Flat(), self.terrain.friction)
            if self.terrain.planned_on == "level"
            else terrain,
            self.terrain.kind,
            self.contact.law(scale),
            self.model.gravity,
        )
        gait = self.load_gait(len(robot.legs), robot.leg_names)
        return Experiment(
            name=self.name,
            duration=self.duration,
            robot=robot,
            file_robot=base,
            payload=self.model.payload,
            scale=scale,
            world=world,
            course=Course(gait, stride, self.footing),
            solver=self.simulation,
            sensors=self.sensors,
            analysis=self.model,
            source=self,
        )

    def base_robot(self) -> Robot:
        """Return the robot as in its file, with the servo that this scenario names.

        It has no other variant of this scenario.

        Raises:
            InvalidInput: The robot file is absent or not well formed.
            InvalidRobot: No machine could have these numbers.
        """
        robot = self.robot
        if isinstance(robot, str):
            path = Path(robot)
            stamp = (path.absolute(), path.stat().st_mtime_ns) if is_file(path) else None
            robot = _robot(robot, stamp)
        name = self.servo.servo
        return robot if name is None else with_servo(robot, load_servo(name))

    def for_robot(self, robot: str | Robot) -> Scenario:
        """Return this scenario for another robot, whose gait, contact and period follow it.

        `replace` keeps a period, and contact numbers of ``phantomx-ax``, that the scenario states.
        A gait that is not the default of the scenario's own robot is kept. The scenario's own robot
        changes nothing.

        Args:
            robot: A preset, a robot file, or the robot.
        """
        if robot == self.robot:
            return self
        changes: dict[str, Any] = {"period": None, "contact_scale": "robot"}
        if self.gait.name is not None:
            own = default_gait(len(self.base_robot().legs)).name
            changes |= {"gait": None} if self.gait == GaitTable(name=own) else {}
        return self.replace(robot=robot, **changes)

    def load_terrain(self) -> Ground:
        """Return the ground of this scenario: height, normal and friction at every point.

        Raises:
            InvalidInput: The file of its height map is absent or not well formed.
        """
        return self.terrain.ground()

    def load_gait(self, leg_count: int = 6, leg_names: Sequence[str] = ()) -> Gait:
        """Return the gait of this scenario.

        A gait of the library with other numbers is no longer called by its name alone: with
        offsets of its own it is ``custom (β = 0.6)``, else ``tripod (β = 0.6)``.

        Args:
            leg_count: Number of legs of the robot.
            leg_names: Their names, in their order, for offsets by name; absent: the robot's own.

        Raises:
            InvalidGait: It is unknown, not well formed, or does not hold that robot up.
        """
        table = self.gait
        if table.offsets is None:
            gait = load_gait(table.name, leg_count) if table.name else default_gait(leg_count)
            if table.duty_factor is not None and table.duty_factor != gait.duty_factor:
                name = _with_duty_factor(gait.name, table.duty_factor)
                own = math.ceil(1000 * gait.duty_factor) / 1000
                with advised(f"duty_factor = {own:g}, that of the gait"):
                    gait = replace(gait, name=name, duty_factor=table.duty_factor)
            return gait if table.sway is None else replace(gait, sway=table.sway)
        if table.duty_factor is None:
            raise InvalidGait("the gait has offsets but no duty_factor.", hint="duty_factor = 0.5")
        offsets = table.offsets
        if isinstance(offsets, dict):
            names = leg_names or [leg.name for leg in self.base_robot().legs]
            offsets = offsets_in_order(offsets, names)
        if len(offsets) != leg_count:
            raise InvalidGait(
                f"gait.offsets has {len(offsets)} values; one per leg, {leg_count} in all."
            )
        gait = Gait(table.name or "own", table.duty_factor, offsets, table.sway or 0.0)
        is_library = table.name in GAIT_NAMES and gait == gaits_of(leg_count).get(table.name)
        if not is_library and table.name in (None, *GAIT_NAMES):
            return replace(gait, name=_with_duty_factor("custom", gait.duty_factor))
        return gait


def _with_duty_factor(name: str, duty_factor: float) -> str:
    return f"{name} (β = {duty_factor:.3g})"


def _is_of_robot(key: str) -> bool:
    """Return whether a key names a value of the robot's file."""
    return key.startswith("robot.")


@lru_cache(maxsize=16)
def _robot(source: str, stamp: object) -> Robot:
    """Read a robot's file, once for each of its changes."""
    del stamp
    return load_robot(source)


def option_keys() -> dict[str, tuple[str, ...]]:
    """Return the path of every field of a scenario by its key in files and options.

    The gait's own name is the key ``gait``, the terrain's kind the key ``terrain``.
    """
    own: dict[tuple[str, ...], str] = {("gait", "name"): "gait", ("terrain", "kind"): "terrain"}
    keys: dict[str, tuple[str, ...]] = {}
    for path, field in leaves(Scenario):
        key = own.get(path) or key_of(path[-1], field)
        if key != "format":
            keys[key] = path
    return keys
