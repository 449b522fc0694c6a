"""Table of the masses of a robot's solids beside those of its file."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from phasmid.cad.assembly import Assembly, mass_properties
from phasmid.robot import JOINTS, Body, Link, Robot
from phasmid.robot.inertial import Inertial

HEAD = (
    "| link | numbers of | mass [g] | centre of mass x, y, z [mm] "
    "| inertia xx, yy, zz [g·mm²] | xy, xz, yz [g·mm²] |\n"
    "|---|---|---|---|---|---|"
)


def mass_table(robot: Robot, assembly: Assembly) -> str:
    """Each link of the robot's file and of its solids, line by line, as Markdown.

    Frames are the body's and those of Table 1; inertias are about the centre of mass. Legs whose
    file and solids agree to the digits shown stand once.
    """
    found = mass_properties(assembly)
    lines = [HEAD, *_pair("body", robot.body, found["body"])]
    seen = set()
    for leg in robot.legs:
        pairs = [
            "\n".join(_pair(joint, link, found[f"{leg.name}.{joint}"]))
            for joint, link in zip(JOINTS, leg.links, strict=True)
        ]
        if tuple(pairs) not in seen:
            seen.add(tuple(pairs))
            if len(seen) > 1:
                lines.append(f"| **{leg.name}** | | | | | |")
            lines += pairs
    solids = sum(link.mass for link in found.values())
    lines += [
        f"| whole robot | file | {1000 * robot.mass:.1f} | | | |",
        f"| | solids | {1000 * solids:.1f} | | | |",
    ]
    return "\n".join(lines) + "\n"


def _pair(name: str, given: Body | Link, made: Inertial) -> Iterator[str]:
    for title, source, mass in ((name, "file", given), ("", "solids", made)):
        com = ", ".join(_number(1e3 * float(c), 1) for c in mass.com)
        I = 1e9 * np.asarray(mass.inertia)
        across = ", ".join(_number(float(I[i, j]), 0) for i, j in ((0, 1), (0, 2), (1, 2)))
        own = ", ".join(_number(float(I[i, i]), 0) for i in range(3))
        yield f"| {title} | {source} | {1000 * mass.mass:.1f} | {com} | {own} | {across} |"


def _number(value: float, digits: int) -> str:
    # A rounded zero has no sign.
    return f"{round(value, digits) + 0.0:.{digits}f}".replace("-", "−")
