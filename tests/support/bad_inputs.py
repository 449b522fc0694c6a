"""Bad inputs that commands refuse in one sentence with status 2: costly, or as the program sees it.

What a reader says of a file is a matter of the reader's own tests. `make slow` runs these inputs
as commands, with a limit of memory; a test runs them in its own process.
"""

import re
from collections.abc import Iterator
from importlib import resources
from pathlib import Path
from typing import NamedTuple

from phasmid import load_robot, plan, simulate
from phasmid.formats import save_robot
from phasmid.motion.trajectory import joint_names
from phasmid.recording import save_recording
from phasmid.scenario import load_scenario

PRESETS = resources.files("phasmid.robot") / "presets"
ROBOT = (PRESETS / "phantomx-paper.toml").read_text(encoding="utf-8")
SERVO = 'servo = {{ name = "a", stall_torque = {0}, no_load_speed_rpm = 59, stiffness = 20 }}'
KINDS, EXPORTED = ("target", "measured"), ("position_target", "position_measured")
DEEP = "/".join("a" for _ in range(1500))
JOINTS = joint_names(load_robot("phantomx-paper"))

SENTENCE = re.compile(r"phasmid: [^\n]{1,1700}\n(  in   [^\n]{1,1700}\n)?(  try  [^\n]{1,1700}\n)?")
"""One sentence, and where it stands and what to try."""


class BadInput(NamedTuple):
    """A command line with files that it reads.

    Attributes:
        name: What is bad, unlike that of any other.
        arguments: Of phasmid.
        files: Contents by name, relative to the folder in which the command runs.
    """

    name: str
    arguments: tuple[str, ...]
    files: dict[str, bytes]


def refused_rightly(status: int, printed: str) -> bool:
    """Whether a command's end is that of bad input: its status and what it printed as errors."""
    return status == 2 and SENTENCE.fullmatch(printed) is not None


def with_files(line: str, file: str, contents: dict[str, str | bytes]) -> Iterator[BadInput]:
    """One input for each content of a file that a command line reads."""
    for name, content in contents.items():
        raw = content.encode() if isinstance(content, str) else content
        yield BadInput(f"{line}: {name}", tuple(line.split()), {file: raw})


def robots(folder: Path) -> Iterator[BadInput]:
    def changed(old: str, new: str) -> str:
        assert old in ROBOT
        return ROBOT.replace(old, new, 1)

    contents = {
        "hexadecimal beyond floats": changed("femur_mm = 82", f"femur_mm = 0x{'f' * 300}"),
        "nested tables": changed("femur_mm = 82", f"femur_mm = {'{a=' * 3000}"),
        "mass of an atom": changed("mass_g = 21.931", "mass_g = 1e-300"),
        "servo of a planet": changed('servo = "AX-12A"', SERVO.format("1e300")),
        "servo of an atom": changed('servo = "AX-12A"', SERVO.format("5e-324")),
        "not utf-8": b"\xff\xfe\x00\x01",
    }
    yield from with_files("check --robot a.toml", "a.toml", contents)
    save_robot(load_robot("phantomx-mk4"), folder / "robot.urdf")
    text = (folder / "robot.urdf").read_text(encoding="utf-8")
    turned = re.sub(r'lower="[^"]*" upper="[^"]*"', 'lower="1" upper="-1"', text, count=1)
    contents = {"limits the wrong way round": turned}
    yield from with_files("check --robot robot.urdf", "robot.urdf", contents)


def scenarios(_: Path) -> Iterator[BadInput]:
    contents = {
        "patches of text": "[terrain]\npatches = [" + "['a']," * 100_000 + "]",
        "20 000 tables": "".join(f"[a{i}]\n" for i in range(20_000)),
        "100 000 keys": "".join(f"a{i} = 1\n" for i in range(100_000)),
        "a coordinate beyond robots": "[terrain]\npatches = [[0, 1e300, 0, 1, 1]]",
    }
    yield from with_files("walk a.toml", "a.toml", contents)
    contents = {"300 000 commands": "command = [" + "{}," * 300_000 + "]"}
    yield from with_files("drive --commands a.toml", "a.toml", contents)


def tables(_: Path) -> Iterator[BadInput]:
    line = "walk --terrain height-map --height-map a.csv"
    contents = {"one column": b"1\n" * 2_000_000, "beyond single floats": b"0,0\n0,1e200\n"}
    yield from with_files(line, "a.csv", contents)
    heading, row = ",".join(["time", *JOINTS]), ",".join(["0", "0.3", "-1.9"] * 6)
    own = "time," + ",".join(f"{joint}.{kind}" for joint in JOINTS for kind in KINDS)
    exported = "time [s]," + ",".join(f"joint_{k}.{j} [rad]" for k in EXPORTED for j in JOINTS)
    contents = {
        "a heading alone": f"{heading}\n",
        "an exported heading alone": f"{exported}\n",
        "milliseconds since 1970": f"{heading}\n1.7e12,{row}\n1.7001e12,{row}",
        "a line of a megabyte": f"{heading}\n{'1' * 1_000_000}",
    }
    yield from with_files("walk --trajectory a.csv", "a.csv", contents)
    contents = {"a heading alone": f"{own}\n", "an exported heading alone": f"{exported}\n"}
    yield from with_files("identify --compare a.csv", "a.csv", contents)
    line = "identify a.csv --servo AX-12A --mass-g 100 --length-mm 100"
    contents = {"a heading alone": "time [s],target [deg],position [deg]\n"}
    yield from with_files(line, "a.csv", contents)


def options(folder: Path) -> Iterator[BadInput]:
    scenario = load_scenario("paper").replace(duration=0.02)
    save_recording(simulate(scenario, plan(scenario)), folder / "run.nc")
    good = {"a.nc": (folder / "run.nc").read_bytes()}
    for line in (
        f"report a.nc --out {DEEP}/a.csv",
        f"report a.nc --figures all --out {DEEP}/a.csv",
        f"export a.nc --out {DEEP}/a.csv",
        f"identify --compare a.nc --out {DEEP}/a.csv",
        f"check --foot-at 1 0.1,0,0 --out {DEEP}/a.png",
        f"walk --samples {'9' * 5000}",
        "walk --damping 1e300",
        "walk --contact-law simscape --stiffness 1e-300",
        "walk --friction-damping 5e-324",
        "walk --terrain rough --rough-length-mm 1e-300",
        "drive --waypoints 1,0,1e300",
        "walk --quiet=yes",
        "studio --port 99999",
    ):
        shown = line if len(line) < 60 else f"{line[:57]}..."
        yield BadInput(shown, tuple(line.split()), good if "a.nc" in line else {})


def bad_inputs(folder: Path) -> list[BadInput]:
    """Every bad input.

    Args:
        folder: Where whole files are made, of which some are damaged ones.
    """
    found = [one for kind in (robots, scenarios, tables, options) for one in kind(folder)]
    assert len({one.name for one in found}) == len(found)
    return found
