"""Bad inputs of every command and kind of file, each to be refused in one sentence with status 2.

`make slow` runs all of them as commands; a test runs some of each kind in its own process.
"""

from __future__ import annotations

import io
import re
import struct
import zlib
from collections.abc import Iterable, Iterator
from functools import cache
from importlib import resources
from pathlib import Path
from typing import NamedTuple

import numpy as np

from phasmid import load_robot, plan, simulate
from phasmid.formats import save_robot
from phasmid.motion.trajectory import joint_names
from phasmid.recording import load_recording, save_recording
from phasmid.scenario import load_scenario

PRESETS = resources.files("phasmid.robot") / "presets"
ROBOT = (PRESETS / "phantomx-paper.toml").read_text(encoding="utf-8")
SERVO = 'servo = {{ name = "a", stall_torque = {0}, no_load_speed_rpm = 59, stiffness = 20 }}'
KINDS, EXPORTED = ("target", "measured"), ("position_target", "position_measured")
DEEP = "/".join("a" for _ in range(1500))
DIGITS, DOTTED, NESTED = "9" * 5000, "a." * 20_000, "[" * 20_000

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


@cache
def whole_files(folder: Path) -> dict[str, bytes]:
    """Files that are read without complaint, of which damaged ones are made."""
    robot = load_robot("phantomx-mk4")
    for name in ("robot.urdf", "robot.xml"):
        save_robot(robot, folder / name)
    scenario = load_scenario("paper").replace(duration=0.02)
    simulate(scenario, plan(scenario), log=folder / "run.mcap")
    save_recording(load_recording(folder / "run.mcap"), folder / "run.nc")
    names = ("robot.urdf", "robot.xml", "run.mcap", "run.nc")
    return {name: (folder / name).read_bytes() for name in names}


def robots(whole: dict[str, bytes]) -> Iterator[BadInput]:
    def toml(name: str, old: str, new: str) -> BadInput:
        assert old in ROBOT
        content = ROBOT.replace(old, new, 1).encode()
        return BadInput(f"robot toml: {name}", ("check", "--robot", "r.toml"), {"r.toml": content})

    yield toml("nan length", "femur_mm = 82", "femur_mm = nan")
    yield toml("digits", "femur_mm = 82", f"femur_mm = {DIGITS}")
    yield toml("hexadecimal beyond floats", "femur_mm = 82", f"femur_mm = 0x{'f' * 300}")
    yield toml("dotted header", "[leg.links.coxa]", f"[{DOTTED}x]")
    yield toml("nested tables", "femur_mm = 82", f"femur_mm = {'{a=' * 3000}")
    yield toml("limits of many turns", "coxa_deg = [-75, 75]", "coxa = [-75, 75]")
    yield toml("mass of an atom", "mass_g = 21.931", "mass_g = 1e-300")
    yield toml("length of a planet", "femur_mm = 82", "femur_mm = 1e11")
    yield toml("servo of a planet", 'servo = "AX-12A"', SERVO.format("1e300"))
    yield toml("servo of an atom", 'servo = "AX-12A"', SERVO.format("5e-324"))
    shared = "\n".join(f"k{i} = 1" for i in range(2000))
    legs = "\n".join(f"[legs.k{i}]" for i in range(1000))
    many = {"a.toml": f"[leg]\n{shared}\n{legs}".encode()}
    yield BadInput("robot toml: values times legs", ("check", "--robot", "a.toml"), many)
    for name, content in {
        "not utf-8": b"\xff\xfe\x00\x01",
        "two megabytes": b"#" * 2_000_000,
    }.items():
        files = {"a.toml": content}
        yield BadInput(f"robot toml: {name}", ("walk", "--robot", "a.toml"), files)

    def changed(kind: str, name: str, old: str, new: str) -> BadInput:
        file = {"urdf": "robot.urdf", "mjcf": "robot.xml"}[kind]
        content = whole[file].replace(old.encode(), new.encode(), 1)
        assert content != whole[file], name
        return BadInput(f"{kind}: {name}", ("check", "--robot", file), {file: content})

    limits = 'lower="-0.9599310885968813" upper="0.9599310885968813"'
    yield changed("urdf", "limits the wrong way round", limits, 'lower="1" upper="-1"')
    yield changed("urdf", "entities", "<robot", '<!DOCTYPE r [<!ENTITY a "b">]>\n<robot')
    yield changed("urdf", "a mass of text", '<mass value="', '<mass value="heavy')
    for name, content in {
        "deep": "<robot name='a'>" + "<link name='a'>" * 50_000,
        "a loop": "<robot name='a'><link name='a'/><link name='b'/>"
        "<joint name='x' type='fixed'><parent link='a'/><child link='b'/></joint>"
        "<joint name='y' type='fixed'><parent link='b'/><child link='a'/></joint></robot>",
        "a mesh elsewhere": "<robot name='a'><link name='a'><visual><geometry>"
        "<mesh filename='../../etc/passwd'/></geometry></visual></link></robot>",
    }.items():
        yield BadInput(
            f"urdf: {name}", ("check", "--robot", "a.urdf"), {"a.urdf": content.encode()}
        )

    around = 'range="-0.9599310885968813 0.9599310885968813"'
    yield changed("mjcf", "limits the wrong way round", around, 'range="1 -1"')
    yield changed("mjcf", "entities", "<mujoco", '<!DOCTYPE r [<!ENTITY a "b">]>\n<mujoco')
    yield changed(
        "mjcf", "includes itself", "</worldbody>", '<include file="robot.xml"/></worldbody>'
    )
    yield changed(
        "mjcf", "includes elsewhere", "</worldbody>", '<include file="/etc/passwd"/></worldbody>'
    )
    for name, content in {"deep": "<mujoco><worldbody>" + "<body>" * 20_000}.items():
        yield BadInput(f"mjcf: {name}", ("check", "--robot", "a.xml"), {"a.xml": content.encode()})

    step = b"ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n"
    for name, files in {
        "no sidecar": {"a.step": step},
        "sidecar of digits": {"a.step": step, "a.step.toml": f"a = {DIGITS}".encode()},
    }.items():
        yield BadInput(f"step: {name}", ("check", "--robot", "a.step"), files)
    for name, arguments in {
        "a file that is absent": ("check", "--robot", "absent.urdf"),
        "a name of 9999 letters": ("check", "--robot", "a" * 9999),
        "an unknown format": ("export", "--robot", "phantomx-paper", "--out", "a.stl"),
        "an unknown servo": ("check", "--robot", "phantomx-paper", "--servo-model", "AX-12B"),
    }.items():
        yield BadInput(f"robot: {name}", arguments, {})


def scenarios(_: dict[str, bytes]) -> Iterator[BadInput]:
    for name, text in {
        "duration of digits": f"duration = {DIGITS}",
        "an inline table of dots": f"x = {{ {DOTTED}a = 1 }}",
        "a long time step": "[simulation]\ndt = 0.5",
        "patches of text": "[terrain]\npatches = [" + "['a']," * 100_000 + "]",
        "a map that claims much": "[terrain]\nkind='height-map'\nheight_map='map:999999x9:zz'",
        "20 000 tables": "".join(f"[a{i}]\n" for i in range(20_000)),
        "100 000 keys": "".join(f"a{i} = 1\n" for i in range(100_000)),
        "a coordinate beyond robots": "[terrain]\npatches = [[0, 1e300, 0, 1, 1]]",
    }.items():
        yield BadInput(f"scenario: {name}", ("walk", "a.toml"), {"a.toml": text.encode()})
    for name, text in {
        "200 000 offsets": "duty_factor = 0.5\noffsets = [" + "0," * 200_000 + "]",
        "never three feet": "duty_factor = 0.1\noffsets = [0, 0.5, 0, 0.5, 0, 0.5]",
        "dots": f"{DOTTED}a = 1",
    }.items():
        yield BadInput(f"gait: {name}", ("gaits", "--gait", "a.toml"), {"a.toml": text.encode()})
    for name, text in {
        "50 m/s": "[[command]]\nahead = 50",
        "nan": "[[command]]\nahead = nan",
        "300 000 commands": "command = [" + "{}," * 300_000 + "]",
    }.items():
        yield BadInput(
            f"commands: {name}", ("drive", "--commands", "a.toml"), {"a.toml": text.encode()}
        )


def png(width: int, height: int) -> bytes:
    """An image that claims a size and holds nothing."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        )

    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", b"") + chunk(b"IEND", b"")


def npy(array: np.ndarray) -> bytes:
    """An array as a file."""
    file = io.BytesIO()
    np.save(file, array, allow_pickle=True)
    return file.getvalue()


def grounds(_: dict[str, bytes]) -> Iterator[BadInput]:
    for name, content in {
        "a.csv: one column": b"1\n" * 2_000_000,
        "a.csv: beyond single floats": b"0,0\n0,1e200\n",
        "a.npy: claims much": npy(np.zeros((2, 2))).replace(b"(2, 2), }    ", b"(90000, 90000)}"),
        "a.png: claims much": png(100_000, 100_000),
    }.items():
        file = name.partition(":")[0]
        arguments = ("walk", "--terrain", "height-map", "--height-map", file)
        yield BadInput(f"height map {name}", arguments, {file: content})
    yield BadInput(
        "height map: absent", ("walk", "--terrain", "height-map", "--height-map", "b.png"), {}
    )


def trajectories(_: dict[str, bytes]) -> Iterator[BadInput]:
    robot = load_robot("phantomx-paper")
    heading = "time," + ",".join(joint_names(robot))
    stand = ",".join(["0", "0.3", "-1.9"] * 6)

    def table(*times: str, row: str = stand) -> bytes:
        return "\n".join([heading, *(f"{time},{row}" for time in times)]).encode()

    for name, content in {
        "a.csv: a heading alone": table(),
        "a.csv: milliseconds since 1970": table("1.7e12", "1.7001e12"),
        "a.csv: not utf-8": b"\xff\xfe" + table("0", "1"),
        "a.csv: a line of a megabyte": heading.encode() + b"\n" + b"1" * 1_000_000,
        "a.npy: cut off": npy(np.zeros((500, 19)))[:900],
        "a.nc: text": b"not a recording",
    }.items():
        file = name.partition(":")[0]
        yield BadInput(f"trajectory {name}", ("walk", "--trajectory", file), {file: content})
    yield BadInput("trajectory: absent", ("walk", "--trajectory", "a.csv"), {})


def logs(_: dict[str, bytes]) -> Iterator[BadInput]:
    joints = joint_names(load_robot("phantomx-paper"))
    own = "time," + ",".join(f"{joint}.{kind}" for joint in joints for kind in KINDS)
    exported = "time [s]," + ",".join(f"joint_{k}.{j} [rad]" for k in EXPORTED for j in joints)
    bench = "time [s],target [deg],position [deg]"
    servo = ("identify", "a.csv", "--servo", "AX-12A", "--mass-g", "100", "--length-mm", "100")
    for name, heading, command in (
        ("own", own, ("identify", "--compare", "a.csv")),
        ("exported", exported, ("identify", "--compare", "a.csv")),
        ("exported, to walk", exported, ("walk", "--trajectory", "a.csv")),
        ("bench", bench, servo),
    ):
        content = {"a.csv": f"{heading}\n".encode()}
        yield BadInput(f"log: a heading alone, {name}", command, content)


def recordings(whole: dict[str, bytes]) -> Iterator[BadInput]:
    nc, rec = whole["run.nc"], whole["run.mcap"]

    def flipped(content: bytes, share: float) -> bytes:
        place = int(share * len(content))
        return content[:place] + bytes([content[place] ^ 16]) + content[place + 1 :]

    damaged = {
        "a.nc: a flipped bit": flipped(nc, 0.5),
        "a.mcap: a flipped bit in its head": flipped(rec, 0.0),
    }
    for name, content in damaged.items():
        file = name.partition(":")[0]
        yield BadInput(f"recording {name}, report", ("report", file), {file: content})
    for command in (("report", "a.nc", "--figures", "all"), ("export", "a.nc"), ("replay", "a.nc")):
        files = {"a.nc": flipped(nc, 0.3)}
        yield BadInput(f"recording: a flipped bit, {command[0]}", command, files)
    good = {"a.nc": nc}
    for line in (
        "report a.nc",
        "report a.nc --figures all",
        "export a.nc",
        "identify --compare a.nc",
    ):
        command = (*line.split(), "--out", f"{DEEP}/a.csv")
        yield BadInput(f"recording: {line} into 1500 folders", command, good)
    for name, arguments in {
        "absent": ("report", "b.nc"),
        "an unknown figure": ("report", "a.nc", "--figures", "joint-torqe"),
        "an unknown format": ("export", "a.nc", "--out", "a.xlsx"),
        "an unknown channel": ("export", "a.nc", "--channels", "torque"),
    }.items():
        yield BadInput(f"recording: {name}", arguments, good)


def options(_: dict[str, bytes]) -> Iterator[BadInput]:
    for line in (
        f"walk --duration {'9' * 400}",
        "walk --step-length-mm 400",
        f"walk --samples {DIGITS}",
        f"walk --legs {DIGITS}",
        f"walk --offsets [{DIGITS}]",
        f"walk --offsets {NESTED}",
        "walk --damping 1e300",
        "walk --contact-law simscape --stiffness 1e-300",
        "walk --stiffness 1e9",
        "walk --friction-damping 5e-324",
        "walk --terrain rough --rough-length-mm 1e-300",
        "drive --waypoints 1,0,1e300",
        f"walk --out {DEEP}/a",
        f"check --foot-at 1 0.1,0,0 --out {DEEP}/a.png",
        "walk --quiet=yes",
        "drive --velocity 0.1,0,0 --waypoints 1,0",
        "drive --velocity 0.1,0,0 --fault x",
        "walk --contact-law simscape --terrain stairs",
        "studio --port 99999",
        "gaits --lost 1,2,3,4",
        "export --out walk.txt",
        "export --out walk.h --terrain stairs",
    ):
        shown = line if len(line) < 60 else f"{line[:57]}..."
        yield BadInput(f"options: {shown}", tuple(line.split(" ")), {})


KINDS = {
    "robots": robots,
    "scenarios": scenarios,
    "grounds": grounds,
    "trajectories": trajectories,
    "logs": logs,
    "recordings": recordings,
    "options": options,
}


def bad_inputs(folder: Path, kinds: Iterable[str] = tuple(KINDS)) -> list[BadInput]:
    """Every bad input of some kinds.

    Args:
        folder: Where whole files are made, of which some are damaged ones.
        kinds: Keys of `KINDS`.
    """
    whole = whole_files(folder)
    found = [one for kind in kinds for one in KINDS[kind](whole)]
    assert len({one.name for one in found}) == len(found)
    return found
