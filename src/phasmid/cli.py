"""The command ``phasmid``: arguments in, the same verbs out, exit statuses.

Statuses: 0 done; 1 output impossible; 2 bad input or usage; 3 the run ended early (fell,
diverged); 70 our own mistake; 130 interrupted.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from phasmid.errors import InvalidInput, PhasmidError, nearest

if TYPE_CHECKING:
    from phasmid.robot import Robot
    from phasmid.scenario import Scenario

COMMANDS = {
    "walk": "plan, analyse and simulate a walk; write its data, figures and summary",
    "check": "is this robot or scenario file possible, and if not, why not",
}


class Parser(argparse.ArgumentParser):
    """An argument parser whose errors are ours."""

    def error(self, message: str) -> NoReturn:
        """Raise what argparse would print."""
        raise InvalidInput(f"{message}.", hint=f"{self.prog} --help")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command.

    Args:
        argv: Arguments; those of the process where None.

    Returns:
        The exit status.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            # An old terminal's encoding shall not turn a degree sign into a crash.
            stream.reconfigure(errors="replace")
    interrupted: list[int] = []
    try:
        with _noticed_interrupts(interrupted):
            return _run(arguments)
    except PhasmidError as error:
        print(f"phasmid: {error}", file=sys.stderr)
        return error.exit_status
    except KeyboardInterrupt:
        print("phasmid: stopped.", file=sys.stderr)
        return 130
    except BrokenPipeError:
        # Whoever read our output has gone; the interpreter must not flush into the pipe again.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except Exception:
        if interrupted:
            print("phasmid: stopped.", file=sys.stderr)
            return 130
        traceback.print_exc()
        print(
            "phasmid: this is a mistake of phasmid, not yours; please report it.", file=sys.stderr
        )
        return 70


@contextmanager
def _noticed_interrupts(noticed: list[int]) -> Iterator[None]:
    """Note each Ctrl-C before it raises: an interrupted import may end as an ImportError."""

    def handle(number: int, frame: Any) -> None:
        noticed.append(number)
        signal.default_int_handler(number, frame)

    try:
        before = signal.signal(signal.SIGINT, handle)
    except ValueError:
        # Only the main thread may do so; elsewhere no Ctrl-C arrives.
        yield
        return
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _run(arguments: list[str]) -> int:
    command = next((a for a in arguments if not a.startswith("-")), None)
    if command is not None and arguments[0] == command and command not in COMMANDS:
        guess = nearest(command, COMMANDS)
        hint = f"phasmid {guess}" if guess else f"phasmid {' or phasmid '.join(COMMANDS)}"
        raise InvalidInput(f'no command "{command}".', hint=hint)
    parser = _parser(command)
    options, unknown = parser.parse_known_args(_join_negative_numbers(arguments))
    if unknown:
        known = [flag for flag in _flags(parser) if flag.startswith("--")]
        guess = nearest(unknown[0].split("=")[0], known)
        kind = "option" if unknown[0].startswith("-") else "argument"
        raise InvalidInput(
            f'no {kind} "{unknown[0]}".',
            hint=guess if guess and guess != unknown[0] else f"phasmid {command or ''} --help",
        )
    if options.command is None:
        parser.print_help()
        return 0
    return int(options.run(options))


def _flags(parser: argparse.ArgumentParser) -> Iterator[str]:
    for action in parser._actions:
        yield from action.option_strings
        if isinstance(action, argparse._SubParsersAction):
            for inner in action.choices.values():
                yield from _flags(inner)


def _join_negative_numbers(arguments: list[str]) -> list[str]:
    """Join ``--option -1e-3``, which argparse would take for two options."""
    joined: list[str] = []
    for argument in arguments:
        option = joined[-1] if joined else ""
        if argument.startswith("-") and option.startswith("--") and "=" not in option:
            try:
                float(argument)
            except ValueError:
                pass
            else:
                joined[-1] = f"{option}={argument}"
                continue
        joined.append(argument)
    return joined


def _parser(command: str | None) -> Parser:
    parser = Parser(
        prog="phasmid",
        description="Model, simulate and control walking robots.",
        allow_abbrev=False,
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and stop")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")
    walk = commands.add_parser(
        "walk",
        help=COMMANDS["walk"],
        description=f"{COMMANDS['walk']}.",
        usage="phasmid walk [SCENARIO] [--out DIR] [--force] [--FIELD VALUE ...]",
        allow_abbrev=False,
    )
    walk.set_defaults(run=_walk)
    # The scenario's fields are looked up only where they are needed: it takes a while.
    if command == "walk":
        _add_walk_options(walk)
    check = commands.add_parser(
        "check", help=COMMANDS["check"], description=f"{COMMANDS['check']}.", allow_abbrev=False
    )
    check.add_argument("file", metavar="FILE", help="a robot or scenario file, or a preset")
    check.set_defaults(run=_check)
    return parser


class _Version(argparse.Action):
    def __call__(self, *_: Any, **__: Any) -> None:
        import phasmid

        print(f"phasmid {phasmid.__version__}")
        sys.exit(0)


def _add_walk_options(walk: argparse.ArgumentParser) -> None:
    from phasmid.robot import preset_names
    from phasmid.scenario import option_keys, scenario_names

    walk.add_argument(
        "scenario",
        nargs="?",
        default="paper",
        metavar="SCENARIO",
        help=f"a preset ({', '.join(scenario_names())}) or a file; default: paper",
    )
    walk.add_argument("--out", metavar="DIR", help="result folder; default: results/NAME")
    walk.add_argument("--force", action="store_true", help="replace the folder of an earlier run")
    walk.add_argument("--legs", metavar="1,2,...", help="legs that the summary lists; default: all")
    walk.add_argument("--no-figures", action="store_true", help="write data and summary only")
    walk.add_argument("--quiet", action="store_true", help="print only errors")
    fields = walk.add_argument_group(
        "fields of the scenario", "Each replaces what the scenario says."
    )
    for key, path in option_keys().items():
        words = _help_of(path)
        if key == "robot":
            words = f"a preset ({', '.join(preset_names())}) or a file"
        elif key == "gait":
            words = "tripod, wave, ripple, amble, or the name of your own"
        fields.add_argument(
            f"--{key.replace('_', '-')}",
            dest=f"field:{key}",
            metavar=_metavar(path),
            help=words,
        )


def _table_of(path: tuple[str, ...]) -> Any:
    from phasmid.scenario.scenario import Scenario

    table: Any = Scenario
    for part in path[:-1]:
        table = table.model_fields[part].annotation
    return table


def _metavar(path: tuple[str, ...]) -> str:
    from phasmid.tables import choices

    return "|".join(choices(_table_of(path).model_fields[path[-1]])) or "VALUE"


def _help_of(path: tuple[str, ...]) -> str:
    """What a field is, from the attributes of its table's docstring."""
    from phasmid import units
    from phasmid.tables import quantity

    table = _table_of(path)
    lines = [line.strip() for line in (table.__doc__ or "").splitlines()]
    start = next((i for i, s in enumerate(lines) if s.startswith(f"{path[-1]}: ")), None)
    if start is None:
        return ""
    words = [lines[start].partition(": ")[2]]
    for line in lines[start + 1 :]:
        if not line or line.split(":")[0].isidentifier():
            break
        words.append(line)
    carried = quantity(table.model_fields[path[-1]])
    text = " ".join(words).replace("``", "").replace("%", "%%")
    if carried:
        si, shown = units.SI[carried.dimension].symbol, units.UNITS[carried.unit].symbol
        text = text.replace(f"[{si}]", f"[{shown}]")
    return text


def _walk(options: argparse.Namespace) -> int:
    scenario = _scenario(options)
    from phasmid.motion import plan
    from phasmid.simulation import check_time_step, simulate

    walk = plan(scenario)
    check_time_step(scenario, walk.robot)
    legs = _legs(options.legs, walk.robot)
    from phasmid.reporting import check_folder, print_summary, report, summarise

    folder = Path(options.out or Path("results") / _folder_name(options, scenario))
    check_folder(folder, force=options.force)
    with _progress(scenario.duration, quiet=options.quiet) as progress:
        recording = simulate(scenario, walk, progress=progress)
    ending = recording.attrs["ending"]
    # Who stops a run wants its end, not its pictures.
    figures = not options.no_figures and ending != "STOPPED"
    report(recording, folder, force=options.force, figures=figures)
    if not options.quiet:
        print_summary(summarise(recording), legs=legs)
        written = "recording.nc, summary.json, scenario.toml, robot.toml"
        print(f"\nWritten to {folder}{os.sep}: {written}{', figures/' if figures else ''}")
    if ending != "COMPLETED":
        print(f"phasmid: {recording.attrs['ending_reason']}", file=sys.stderr)
    return {"COMPLETED": 0, "STOPPED": 130}.get(ending, 3)


def _folder_name(options: argparse.Namespace, scenario: Scenario) -> str:
    """The scenario's name, and what the options changed of it."""
    words = [scenario.name]
    for key, value in vars(options).items():
        if key.startswith("field:") and value is not None and key != "field:name":
            text = Path(value).stem if key == "field:robot" else value
            words.append(f"{key.removeprefix('field:').replace('_', '-')}-{text}")
    name = "_".join(words)
    plain = "".join(c if c.isascii() and (c.isalnum() or c in "._-") else "-" for c in name)
    return plain[:100]


def _scenario(options: argparse.Namespace) -> Scenario:
    """The scenario that the options ask for."""
    from phasmid.scenario import load_scenario, option_keys
    from phasmid.tables import dotted

    scenario = load_scenario(options.scenario)
    given = {
        key.removeprefix("field:"): value
        for key, value in vars(options).items()
        if key.startswith("field:") and value is not None
    }
    flags = {option_keys()[key]: f"--{key.replace('_', '-')}" for key in given}

    def locate(loc: tuple[str | int, ...]) -> tuple[str, str]:
        for path, flag in flags.items():
            if loc[: len(path)] == path:
                return flag + dotted(loc[len(path) :]), ""
        return dotted(loc), options.scenario

    return scenario.changed({key: _value(key, text) for key, text in given.items()}, locate)


def _value(key: str, text: str) -> Any:
    """An option's text as a number, a list of numbers, or text."""
    if key == "offsets":
        return [_number(part) for part in text.split(",")]
    return text if key in {"name", "description", "robot", "gait"} else _number(text)


def _number(text: str) -> int | float | str:
    try:
        return int(text)
    except ValueError:
        pass
    try:
        number = float(text)
    except ValueError:
        return text
    # 1e3 samples are a whole number of them.
    return int(number) if number.is_integer() and abs(number) < 1e15 else number


def _legs(text: str | None, robot: Robot) -> tuple[int, ...] | None:
    if text is None:
        return None
    legs = []
    for part in text.split(","):
        if not (part.strip().isascii() and part.strip().isdigit()):
            raise InvalidInput(
                f'--legs is "{text}"; it must be leg numbers with commas between.',
                hint="--legs 1,2,3",
            )
        robot.leg(int(part))
        legs.append(int(part))
    return tuple(legs)


@contextmanager
def _progress(duration: float, *, quiet: bool) -> Iterator[Any]:
    """A bar on a terminal; nothing where the output is piped."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("walking"),
        BarColumn(),
        TextColumn("{task.completed:.1f} of {task.total:.1f} s"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("walk", total=duration)
        yield lambda done: bar.update(task, completed=done)


def _check(options: argparse.Namespace) -> int:
    from phasmid.robot import load_robot, preset_names
    from phasmid.scenario import load_scenario
    from phasmid.toml import read_toml

    source = options.file
    if source in preset_names():
        return _check_robot(load_robot(source))
    if Path(source).suffix == ".toml" or Path(source).exists():
        raw, _ = read_toml(Path(source))
        if {"legs", "leg", "body"} & set(raw):
            return _check_robot(load_robot(source))
    return _check_scenario(load_scenario(source))


def _check_robot(robot: Robot) -> int:
    import numpy as np

    from phasmid.errors import InfeasibleWalk
    from phasmid.kinematics import joint_angles, longest_stride
    from phasmid.units import STANDARD_GRAVITY

    print(
        f"robot {robot.name}: {len(robot.legs)} legs, {robot.mass:.3f} kg "
        f"({robot.mass * STANDARD_GRAVITY:.2f} N), servo {robot.servo.name}"
    )
    print(f"  body {1000 * robot.body.mass:.1f} g")
    for number, leg in enumerate(robot.legs, 1):
        lengths = " / ".join(f"{1000 * length:.4g}" for length in leg.lengths)
        q = np.degrees(joint_angles(leg, leg.neutral_foot))
        x, y, z = 1000 * leg.mount_position
        print(
            f"  {number} {leg.name:<13} {lengths} mm, hip at ({x:.4g}, {y:.4g}, {z:.4g}) mm, "
            f"neutral at {', '.join(f'{a:.1f}' for a in q)}°, "
            f"{' / '.join(f'{1000 * link.mass:.1f}' for link in leg.links)} g"
        )
    ahead, side = longest_stride(robot), longest_stride(robot, np.pi / 2)
    print(f"  longest stride: {1000 * ahead:.0f} mm ahead, {1000 * side:.0f} mm sideways")
    if ahead <= 0:
        raise InfeasibleWalk(
            "the neutral feet cannot be reached within the joint limits.",
            hint="another neutral_foot_mm, or wider joint_limits",
        )
    print("possible.")
    return 0


def _check_scenario(scenario: Scenario) -> int:
    import numpy as np

    from phasmid.motion import plan
    from phasmid.simulation import check_time_step

    walk = plan(scenario)
    check_time_step(scenario, walk.robot)
    speed = float(np.abs(walk.qd).max())
    print(
        f"scenario {scenario.name}: {walk.robot.name}, {walk.gait.name} gait, "
        f"{scenario.duration:g} s, {len(walk.time)} samples"
    )
    print(
        f"  planned way: {1000 * walk.trunk.position[-1, 0]:.1f} mm ahead, "
        f"{1000 * walk.trunk.position[-1, 1]:.1f} mm to the left, "
        f"{np.degrees(walk.trunk.yaw[-1]):.1f}° turn"
    )
    print(
        f"  fastest joint: {speed:.2f} rad/s; the servo {walk.robot.servo.name} allows "
        f"{walk.robot.servo.no_load_speed:.2f} rad/s"
    )
    print(f"  smallest support margin: {1000 * float(walk.support_margin.min()):.1f} mm")
    print("possible.")
    return 0
