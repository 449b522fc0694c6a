"""Learning task: robot, physics, actions, observations, commands, rewards and randomisation."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from annotated_types import Ge, Gt, Le
from pydantic import ConfigDict, field_serializer, field_validator

from phasmid.arguments import checked
from phasmid.errors import located
from phasmid.robot import Robot, robot_to_toml
from phasmid.robot.file import robot_from_table
from phasmid.scenario import Scenario, with_robot
from phasmid.tables import (
    Angle,
    AngularVelocity,
    Count,
    Length,
    Mass,
    Number,
    Table,
    Time,
    Velocity,
    dotted,
    in_file,
    in_si,
    validate,
)
from phasmid.toml import find_file, parse_toml, preset_names, read_toml

Share = Annotated[Number, Ge(0), Le(1)]
Positive = Annotated[Number, Gt(0)]
Weight = Number


class ActionTable(Table):
    """``[action]``: meaning of a policy's actions.

    Attributes:
        kind: ``joint-offsets``: joint position targets around the neutral stance;
            ``command-corrections``: changes of the commands of the locomotion controller, which
            walks the robot; see ``[corrections]``.
        scale: Offset of a joint's target from the neutral stance at an action of 1.
        speed_share: Largest speed of the targets, as a share of the servo's no-load speed.
    """

    kind: Literal["joint-offsets", "command-corrections"] = "joint-offsets"
    scale: Annotated[Angle, Gt(0)] = 0.6
    speed_share: Annotated[Number, Gt(0)] = 0.95


class CorrectionTable(Table):
    """``[corrections]``: changes of the controller's commands at an action of 1.

    Attributes:
        speed: Share by which the commanded velocity grows; at -1 it shrinks by as much.
        step_height: Change of the step height, which is ``step_height`` of ``[gait]`` at 0.
        forward: Shift of the body.
        height: Rise of the body.
        roll: Roll of the body.
        pitch: Pitch of the body.
    """

    speed: Share = 0.3
    step_height: Annotated[Length, Ge(0)] = 0.025
    forward: Annotated[Length, Ge(0)] = 0.02
    height: Annotated[Length, Ge(0)] = 0.02
    roll: Annotated[Angle, Ge(0)] = 0.1
    pitch: Annotated[Angle, Ge(0)] = 0.15


CORRECTIONS = tuple(CorrectionTable.model_fields)
"""Names of the corrections, in the order of the actions."""


class ObservationTable(Table):
    """``[observation]``: optional parts of the actor's observation.

    Attributes:
        clock: Whether sine and cosine of the gait's phase are observed.
        contacts: Whether the contact of each foot is observed.
        history: Number of observations, the latest first.
    """

    clock: bool = True
    contacts: bool = False
    history: Annotated[Count, Ge(1), Le(50)] = 1


class CommandTable(Table):
    """``[commands]``: velocities of the body, in body axes, drawn at random.

    Attributes:
        forward: Largest velocity forward and backward.
        left: Largest velocity to either side.
        yaw: Largest yaw rate.
        single_share: Share of the commands in one of the three directions alone.
        zero_share: Share of the commands that are zero.
        interval: Time between commands.
    """

    forward: Annotated[Velocity, Ge(0)] = 0.12
    left: Annotated[Velocity, Ge(0)] = 0.1
    yaw: Annotated[AngularVelocity, Ge(0)] = 0.5
    single_share: Share = 0.4
    zero_share: Share = 0.1
    interval: Annotated[Time, Gt(0)] = 4.0


class GaitTable(Table):
    """``[gait]``: clock and reference motion.

    Attributes:
        name: Gait whose stance phases and foot paths the reference has; absent: the first gait of
            the robot's number of legs, ``tripod`` for six.
        period: Duration of a cycle.
        step_height: Height to which a foot lifts.
    """

    name: str | None = None
    period: Annotated[Time, Gt(0)] = 0.8
    step_height: Annotated[Length, Gt(0)] = 0.03


class RewardTable(Table):
    """``[rewards]``: weights of the terms, whose sum is the reward of a control period.

    Attributes:
        velocity: exp(-e²/s²) of the error e of the period's mean velocity over ground; s is
            ``velocity_scale``.
        yaw_rate: The same of the yaw rate; s is ``yaw_scale``.
        reference: exp(-mean e²/s²) of the joints' distances from the reference motion; s is
            ``reference_scale``.
        clock: Share of the feet whose contact is that of the gait's clock.
        vertical_velocity: Square of the vertical velocity [m²/s²].
        tilt_rate: Square of the roll and pitch rates [rad²/s²].
        tilt: Square of the horizontal part of the gravity direction in body axes.
        height: Square of the body's distance from its height in the neutral stance [m²].
        torque: Mean square of the joints' torques over the stall torque.
        power: Positive mechanical power of the joints [W].
        action_rate: Mean square of the change of the action.
        slip: Speed of the feet along the ground while they touch it, summed [m/s].
        symmetry: Mean square of the difference between the duty factors of left and right legs.
        standing: Mean square of the joint velocities while the command is zero [rad²/s²].
        fall: 1 in the period in which the robot falls.
        velocity_scale: Velocity error at which ``velocity`` is 1/e.
        yaw_scale: Yaw rate error at which ``yaw_rate`` is 1/e.
        reference_scale: Root mean square distance at which ``reference`` is 1/e.
    """

    velocity: Weight = 1.0
    yaw_rate: Weight = 0.5
    reference: Weight = 0.0
    clock: Weight = 0.0
    vertical_velocity: Weight = 0.0
    tilt_rate: Weight = 0.0
    tilt: Weight = 0.0
    height: Weight = 0.0
    torque: Weight = 0.0
    power: Weight = 0.0
    action_rate: Weight = 0.0
    slip: Weight = 0.0
    symmetry: Weight = 0.0
    standing: Weight = 0.0
    fall: Weight = 0.0
    velocity_scale: Annotated[Velocity, Gt(0)] = 0.05
    yaw_scale: Annotated[AngularVelocity, Gt(0)] = 0.25
    reference_scale: Annotated[Angle, Gt(0)] = 0.15


TERMS = tuple(name for name in RewardTable.model_fields if not name.endswith("_scale"))
"""Names of the reward terms, in the order of the columns of rewards."""


class RandomisationTable(Table):
    """``[randomisation]``: what is drawn anew for each episode, uniformly.

    Ranges are pairs, sizes stand for a range to both sides of zero. Absent: no randomisation.

    Attributes:
        friction: Range of the coefficient of friction; absent: 0.7, as of a scenario.
        mass: Size, as a share, by which masses and inertias of all bodies change together.
        payload: Largest payload on the trunk [g in files].
        centre_of_mass: Size of the shift of the trunk's centre of mass along each axis.
        strength: Size, as a share, by which the motors' torques change, for each joint.
        gain: Size, as a share, by which the servos' gains change.
        latency: Largest delay of the targets on top of the servos' own.
        joint_offset: Size of the error of each joint's zero.
        joint_noise: Size of the error of each reading of a joint's angle.
        gyro_noise: Size of the error of each reading of the gyro.
        gravity_noise: Size of the error of each reading of the gravity direction.
        push: Largest change of the body's horizontal velocity by a push.
        push_interval: Time between pushes.
    """

    friction: tuple[Number, Number] = (0.7, 0.7)
    mass: Share = 0.0
    payload: Annotated[Mass, Ge(0)] = 0.0
    centre_of_mass: Annotated[Length, Ge(0)] = 0.0
    strength: Share = 0.0
    gain: Share = 0.0
    latency: Annotated[Time, Ge(0)] = 0.0
    joint_offset: Annotated[Angle, Ge(0)] = 0.0
    joint_noise: Annotated[Angle, Ge(0)] = 0.0
    gyro_noise: Annotated[AngularVelocity, Ge(0)] = 0.0
    gravity_noise: Annotated[Number, Ge(0)] = 0.0
    push: Annotated[Velocity, Ge(0)] = 0.0
    push_interval: Annotated[Time, Gt(0)] = 5.0


class TerrainTable(Table):
    """``[terrain]``: tiles of rising difficulty, with a level platform in the middle of each.

    A robot begins on a tile of its level. It rises by a level after an episode in which it walked
    80 % of the commanded way, and falls by one after less than half of it, or a fall.

    Attributes:
        kinds: Kinds of ground; none: level ground.
        levels: Levels of difficulty, from level ground to the largest sizes.
        first_levels: Levels on which robots begin.
        tile: Side of a tile.
        platform: Distance from a tile's centre to where its ground begins.
        cell: Distance of the samples of the height field.
        stairs: Largest rise of a step.
        slope: Steepest slope.
        blocks: Largest difference between the heights of blocks.
        waves: Largest height of waves.
        gaps: Largest width of gaps.
    """

    kinds: tuple[Literal["stairs", "slope", "blocks", "waves", "gaps"], ...] = ()
    levels: Annotated[Count, Ge(1), Le(100)] = 10
    first_levels: Annotated[Count, Ge(1)] = 3
    tile: Annotated[Length, Gt(0.5), Le(20)] = 3.0
    platform: Annotated[Length, Gt(0)] = 0.35
    cell: Annotated[Length, Gt(0.001)] = 0.02
    stairs: Annotated[Length, Ge(0)] = 0.06
    slope: Annotated[Angle, Ge(0), Le(0.7)] = 0.45
    blocks: Annotated[Length, Ge(0)] = 0.1
    waves: Annotated[Length, Ge(0)] = 0.06
    gaps: Annotated[Length, Ge(0)] = 0.08


class DamageTable(Table):
    """``[damage]``: servos that fail during an episode; their joints are limp from then on.

    Attributes:
        dead_servo: Share of the episodes in which one servo dies.
        lost_leg: Share of the episodes in which all servos of a leg die.
        latest: Latest time at which they die.
    """

    dead_servo: Share = 0.0
    lost_leg: Share = 0.0
    latest: Annotated[Time, Ge(0)] = 5.0


class Task(Table):
    """A learning task.

    Attributes:
        robot: A preset, a robot file, or a `Robot`; the file of a policy keeps one as the
            text of its file, without meshes.
        fidelity: ``fast``: time steps of 4 ms, one sphere per foot, motors without inner law;
            ``full``: the model of `phasmid.drive`, with time steps of 1 ms, four points per foot,
            and the servo's law, gears, backlash and heat.
        rate: Control periods per second [1/s].
        duration: Length of an episode, after which it is truncated.
    """

    model_config = ConfigDict(arbitrary_types_allowed=True)

    robot: str | Robot = "phantomx-ax"
    fidelity: Literal["fast", "full"] = "fast"
    rate: Positive = 50.0
    duration: Annotated[Time, Gt(0)] = 20.0
    action: ActionTable = ActionTable()
    corrections: CorrectionTable = CorrectionTable()
    observation: ObservationTable = ObservationTable()
    commands: CommandTable = CommandTable()
    gait: GaitTable = GaitTable()
    rewards: RewardTable = RewardTable()
    randomisation: RandomisationTable = RandomisationTable()
    terrain: TerrainTable = TerrainTable()
    damage: DamageTable = DamageTable()

    @field_validator("robot")
    @classmethod
    def _read_robot(cls, robot: str | Robot) -> str | Robot:
        if isinstance(robot, Robot) or "\n" not in robot:
            return robot
        return robot_from_table(parse_toml(robot, "the task's robot"), Path("robot.toml"), robot)

    @field_serializer("robot")
    def _write_robot(self, robot: str | Robot) -> str:
        return robot_to_toml(robot) if isinstance(robot, Robot) else robot

    def scenario(self) -> Scenario:
        """Return the default scenario with the task's robot.

        Raises:
            InvalidInput: The robot's file is absent or not well formed.
            InvalidRobot: No machine could have its numbers.
        """
        return with_robot(Scenario().replace(robot=self.robot))

    def replace(self, **changes: Any) -> Task:
        """Return this task with other values.

        Args:
            **changes: Fields by name; the values of a table, given as a dictionary, replace its
                own and leave its other values.

        Raises:
            InvalidInput: There is no such field, or the value is refused.
        """
        raw = self.model_dump() | {"robot": self.robot}
        for name, value in changes.items():
            table = getattr(self, name, None)
            if isinstance(table, Table) and isinstance(value, Mapping):
                raw[name] |= in_si(type(table), value)
            else:
                raw[name] = value
        return validate(Task, raw, lambda loc: (dotted(loc), ""))


def task_names() -> tuple[str, ...]:
    """Return the names of the tasks that come with phasmid."""
    return preset_names("phasmid.learning")


@checked
def load_task(source: str | Path = "walk") -> Task:
    """Load a task from a preset or a file.

    Args:
        source: Name of a preset, such as ``walk``, or path of a ``.toml`` file. A robot file that
            it names is looked for beside it.

    Raises:
        InvalidInput: There is no such preset or file, or it is not well formed.
    """
    path = find_file(source, "phasmid.learning", "task")
    raw, content = read_toml(path)
    with located(path.name):
        task = validate(Task, raw, in_file(path, content))
    if isinstance(task.robot, str) and Path(task.robot).suffix:
        return task.model_copy(update={"robot": str(path.parent / task.robot)})
    return task
