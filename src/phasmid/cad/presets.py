"""``python -m phasmid.cad.presets`` draws the robots that come with phasmid anew, as meshes."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from phasmid.cad.meshes import meshes
from phasmid.cad.model import build
from phasmid.robot import load_robot, preset_names
from phasmid.robot.glb import glb


def write_presets(folder: Path) -> list[Path]:
    """Write ``NAME.glb`` of every preset into a folder; returns the files."""
    paths = []
    for name in preset_names():
        path = folder / f"{name}.glb"
        path.write_bytes(glb(meshes(build(load_robot(name)))))
        paths.append(path)
    return paths


if __name__ == "__main__":
    for path in write_presets(Path(str(resources.files("phasmid.robot") / "presets"))):
        print(f"{path.name}: {path.stat().st_size / 1000:.0f} kB")  # noqa: T201
