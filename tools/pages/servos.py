"""The servo catalogue: tables of docs/servos.md."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

from phasmid.servo import Servo, load_servo, servo_names

RPM, DEGREE = math.pi / 30, math.pi / 180

COLUMNS: dict[str, tuple[str, Callable[[Servo], str]]] = {
    "supply [V]": ("rated_voltage", lambda one: f"{one.rated_voltage:g}"),
    "stall torque [N·m]": ("stall_torque", lambda one: f"{one.rated_stall_torque:.3g}"),
    "no-load speed [rpm]": (
        "no_load_speed",
        lambda one: f"{one.rated_no_load_speed / RPM:.3g}",
    ),
    "stall current [A]": ("stall_current", lambda one: f"{one.stall_current:.3g}"),
    "armature [g·m²]": ("armature", lambda one: f"{1000 * one.armature:.3g}"),
    "friction [N·m]": ("friction", lambda one: f"{one.friction:.2g}"),
    "viscous [mN·m·s]": ("viscous_friction", lambda one: f"{1000 * one.viscous_friction:.2g}"),
    "stiffness [N·m/rad]": ("stiffness", lambda one: f"{one.stiffness:.3g}"),
    "delay [ms]": ("delay", lambda one: f"{1000 * one.delay:.2g}"),
    "backlash [°]": ("backlash", lambda one: f"{one.backlash / DEGREE:.2g}"),
}
"""Columns of numbers: field, and its text."""

MARKS = {"data sheet": "", "identified": " **i**", "assumed": " *a*"}
"""Marks of a number by the kind of its source."""


def numbers() -> str:
    """Return the table of numbers, each marked as identified or assumed, or of a data sheet."""
    rows = ["| servo | " + " | ".join(COLUMNS) + " |", "|---|" + "---|" * len(COLUMNS)]
    for servo in map(load_servo, servo_names()):
        cells = [
            text(servo) + MARKS[servo.sources[field].partition(" (")[0]]
            for field, text in COLUMNS.values()
        ]
        rows.append("| " + " | ".join([servo.name, *cells]) + " |")
    return "\n".join(rows)


def sources() -> str:
    """Return the table of sources: data sheet, who identified what, and assumed numbers."""
    rows = ["| servo | data sheet | identified | assumed |", "|---|---|---|---|"]
    for servo in map(load_servo, servo_names()):
        found: dict[str, list[str]] = {"data sheet": [], "identified": [], "assumed": []}
        publication = dict.fromkeys(found, "")
        for name in filter(servo.sources.__contains__, servo.numbers):
            kind, _, rest = servo.sources[name].partition(" (")
            found[kind].append(name.replace("_", " "))
            publication[kind] = rest.removesuffix(")")
        identified = ", ".join(found["identified"])
        if identified:
            identified += f": {publication['identified']}"
        cells = [publication["data sheet"], identified, ", ".join(found["assumed"])]
        rows.append("| " + " | ".join([servo.name, *cells]) + " |")
    return "\n".join(rows)


def main() -> None:
    """Write the tables."""
    page = Path(__file__).parents[2] / "docs" / "servos.md"
    text = page.read_text("utf-8")
    for table in (numbers(), sources()):
        start = text.index(table.partition("\n")[0])
        text = text[:start] + table + text[text.index("\n\n", start) :]
    page.write_text(text, "utf-8")
