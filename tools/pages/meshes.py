"""Meshes of the robots that come with phasmid; needs the extra cad."""

from importlib import resources
from pathlib import Path

from phasmid.formats.solids import build, meshes
from phasmid.robot import load_robot, preset_names
from phasmid.robot.glb import glb

FOLDER = Path(str(resources.files("phasmid.robot") / "presets"))


def main() -> None:
    """Write the meshes."""
    for name in preset_names():
        (FOLDER / f"{name}.glb").write_bytes(glb(meshes(build(load_robot(name)))))
