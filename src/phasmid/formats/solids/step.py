"""STEP files out: an assembly with names, hierarchy and colours."""

from __future__ import annotations

import copy
import re
from io import BytesIO
from typing import Any

from phasmid.formats.solids.assembly import Assembly, location
from phasmid.formats.solids.library import build123d


def step_text(assembly: Assembly) -> bytes:
    """Write an assembly as STEP: the robot, its ``body`` and legs, their links, and their parts.

    Each distinct part is written once and placed as often as it is needed.

    Raises:
        PhasmidError: build123d is not installed.
    """
    b = build123d()
    groups: dict[str, list[Any]] = {}
    for link, path in group_paths(assembly).items():
        parts = []
        for placed in assembly.links[link]:
            # A shallow copy shares the solid.
            part = copy.copy(placed.solid.shape)
            part.label, part.color = placed.solid.name, b.Color(*placed.solid.material.color)
            parts.append(part.move(location(placed.X_link_part)))
        leg, _, joint = path.rpartition("/")
        group = b.Compound(label=joint, children=parts).move(location(assembly.poses[link]))
        groups.setdefault(leg, []).append(group)
    trunk = groups.pop("")
    legs = [b.Compound(label=leg, children=links) for leg, links in groups.items()]
    file = BytesIO()
    b.export_step(b.Compound(label=plain_name(assembly.name), children=[*trunk, *legs]), file)
    return file.getvalue()


def group_paths(assembly: Assembly) -> dict[str, str]:
    """Return the path in the STEP file of each link's parts, such as ``right_front/coxa``."""
    taken = {"body"}
    legs: dict[str, str] = {}
    for link in assembly.links:
        leg = link.rpartition(".")[0]
        if leg and leg not in legs:
            legs[leg] = unique(plain_name(leg), taken)
    split = {link: link.rpartition(".") for link in assembly.links}
    return {
        link: f"{legs[leg]}/{joint}" if leg else joint for link, (leg, _, joint) in split.items()
    }


def plain_name(name: str) -> str:
    """Return a name in letters that every reader of STEP files knows."""
    return re.sub(r"[^A-Za-z0-9_-]", "_", name)


def unique(path: str, taken: set[str]) -> str:
    """Reserve a path; add a number if it is taken."""
    name, number = path, 1
    while name in taken:
        number += 1
        name = f"{path}_{number}"
    taken.add(name)
    return name
