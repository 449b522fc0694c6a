"""Whatever happens to a file, its reader soon ends with its content or a sentence.

``FUZZ_FILES=2000 pytest tests/formats/test_fuzz.py`` reads 2000 damaged files per reader.
"""

import io
import os
import random
import re
import sys
import time
import warnings
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from formats.test_urdf_in import LEG
from formats.tetrahedron import CORNERS, FACES, binary_stl
from formats.trees import files_of
from formats.wild_model import BESIDE, WILD
from phasmid.errors import PhasmidError
from phasmid.formats import import_robot, load_robot
from phasmid.formats.meshes import read_meshes
from phasmid.kinematics import joint_angles
from phasmid.motion import load_trajectory
from phasmid.motion.trajectory import joint_names
from phasmid.robot import Appearance, Part, robot_to_toml
from phasmid.robot.glb import glb, read_glb
from phasmid.terrain import read_heights

FILES = int(os.environ.get("FUZZ_FILES", "20"))

MOST_SECONDS = 2.0
"""Processor time of one file."""

MOST_BYTES = 500_000_000
"""Memory beyond what the tests have taken before."""

NUMBERS = (b"nan", b"-inf", b"1e400", b"-", b"", b"0", b"-1", b"9" * 400, b"1e300", b"1 2 3 4")
"""What takes the place of a number in a text."""

WORDS = (0, 1, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0x7FC00000, 0x7F800000, 0x10000000)
"""Four bytes that counts, sizes and floats should not be."""

PART = Part(CORNERS, FACES, (0.2, 0.4, 0.6, 1.0), "shell")
ROBOT = load_robot("phantomx-paper")
SHOWN = replace(ROBOT, appearance=Appearance.of({"body": (PART,), "coxa": (PART,)}))
URDF, MJCF = files_of(SHOWN, ".urdf"), files_of(SHOWN, ".xml")
BALL = trimesh.creation.icosphere(subdivisions=3)
STAND = joint_angles(ROBOT.arrays, ROBOT.arrays.neutral_foot).ravel()
ANGLES = np.column_stack([np.arange(41) * 0.05, np.tile(STAND, (41, 1))])
HEIGHTS = np.random.default_rng(1).uniform(0, 0.02, (6, 8))


def written(write, *arguments, **options):
    """The bytes that a function writes into a file."""
    file = io.BytesIO()
    write(file, *arguments, **options)
    return file.getvalue()


def as_csv(table, heading=""):
    return written(np.savetxt, table, delimiter=",", header=heading, comments="")


GREY = Image.fromarray((5000 * HEIGHTS).astype(np.uint8))
TRAJECTORY, MAP = partial(load_trajectory, robot=ROBOT), partial(read_heights, white=0.02)

READERS = {
    "a.urdf": (import_robot, [URDF.pop("robot.urdf"), LEG.encode()]),
    "a.xml": (import_robot, [MJCF.pop("robot.xml"), WILD.encode()]),
    "a.toml": (load_robot, [robot_to_toml(ROBOT).encode()]),
    "a.glb": (read_glb, [glb({"body": (PART,), "left.coxa": (PART, PART)})]),
    "a.obj": (read_meshes, [BALL.export(file_type="obj").encode()]),
    "a.stl": (
        read_meshes,
        [binary_stl(CORNERS[FACES]), BALL.export(file_type="stl_ascii").encode()],
    ),
    "a.ply": (
        read_meshes,
        [BALL.export(file_type="ply"), BALL.export(file_type="ply", encoding="ascii")],
    ),
    "walk.csv": (TRAJECTORY, [as_csv(ANGLES, ",".join(["time", *joint_names(ROBOT)]))]),
    "walk.npy": (TRAJECTORY, [written(np.save, ANGLES)]),
    "map.csv": (MAP, [as_csv(HEIGHTS)]),
    "map.npy": (MAP, [written(np.save, HEIGHTS)]),
    "map.png": (MAP, [written(GREY.save, format="png")]),
}
"""Readers and undamaged files by a file's name."""


def damaged(content, seed):
    """Damage a file, by the same seed in the same way on every machine."""
    draw = random.Random(seed)
    kinds = ["bits", "word", "end", "span", "nested"]
    if b"\0" not in content[:2000]:
        # A text that stays well formed reaches what reads it behind the parser.
        kinds += ["number", "order"] * 4
    at = draw.randrange(len(content))
    match draw.choice(kinds):
        case "bits":
            raw = bytearray(content)
            for place in draw.choices(range(len(raw)), k=draw.randint(1, 20)):
                raw[place] ^= 1 << draw.randrange(8)
            return bytes(raw)
        case "word":
            # Counts and sizes stand near the beginning.
            at %= draw.choice([100, 2000])
            return content[:at] + draw.choice(WORDS).to_bytes(4, "little") + content[at + 4 :]
        case "span":
            end = at + draw.randint(1, 300)
            return content[:at] + content[at:end] * draw.choice([0, 2, 1000]) + content[end:]
        case "nested":
            opening = draw.choice(re.findall(rb"<\w+[^<>/]*>|\[+|\{", content) or [b"<a>"])[:100]
            return content.replace(opening, opening * draw.choice([2, 100, 5000]), 1)
        case "number":
            one = draw.choice(list(re.finditer(rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?", content)))
            return content[: one.start()] + draw.choice(NUMBERS) + content[one.end() :]
        case "order":
            pieces = re.split(draw.choice([rb"(\n)", rb"(\W)"]), content)
            a, b = draw.randrange(len(pieces)), draw.randrange(len(pieces))
            pieces[a], pieces[b] = pieces[b], pieces[a]
            return b"".join(pieces)
    return content[:at]


@pytest.fixture
def _little_memory():
    import resource

    pages = int(Path("/proc/self/statm").read_text().split()[0])
    before = resource.getrlimit(resource.RLIMIT_AS)
    most = pages * resource.getpagesize() + MOST_BYTES
    resource.setrlimit(resource.RLIMIT_AS, (most, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, before)


@pytest.mark.skipif(sys.platform != "linux", reason="the limits are Linux's own")
@pytest.mark.usefixtures("_little_memory")
@pytest.mark.parametrize("name", READERS)
def test_a_damaged_file_is_read_or_refused_in_a_sentence(name, tmp_path):
    read, whole = READERS[name]
    for file, content in {**URDF, **MJCF, **BESIDE, "a.stl": binary_stl(CORNERS[FACES])}.items():
        (tmp_path / file).parent.mkdir(exist_ok=True)
        (tmp_path / file).write_bytes(content)
    path = tmp_path / name
    for content in whole:
        path.write_bytes(content)
        read(path)
    for seed in range(FILES):
        path.write_bytes(damaged(whole[seed % len(whole)], seed))
        begin = time.process_time()
        try:
            with warnings.catch_warnings():
                # A warning would reach the user as well.
                warnings.simplefilter("error")
                read(path)
        except PhasmidError as error:
            text = str(error)
            assert error.what, seed
            assert len(text) < 2000, seed
            assert text.replace("\n", "").isprintable(), seed
        assert time.process_time() - begin < MOST_SECONDS, seed
