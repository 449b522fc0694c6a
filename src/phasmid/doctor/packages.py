"""The Python packages that phasmid needs, and those that an extra brings."""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass
from importlib import metadata
from importlib.util import find_spec
from typing import NamedTuple

from phasmid.doctor.finding import Finding, State

RELEASE = re.compile(r"\d+(?:\.\d+)*")


@dataclass(frozen=True)
class Extra:
    """An extra of phasmid.

    Attributes:
        name: As pip is told it.
        purpose: What it is for.
        packages: The packages that it brings, by the names of their modules; empty for one that
            comes in several packages.
    """

    name: str
    purpose: str
    packages: dict[str, str]


VIDEO = {"av": "av"}

if sys.platform != "linux":
    VIDEO["glfw"] = "glfw"

EXTRAS = {
    one.name: one
    for one in (
        Extra("cad", "solids and STEP files", {"build123d": "build123d", "OCP": ""}),
        Extra("derivation", "the equations in symbols", {"sympy": "sympy"}),
        Extra(
            "ros",
            "recordings as ROS 2 messages",
            {"mcap": "mcap", "mcap_ros2": "mcap-ros2-support"},
        ),
        Extra(
            "studio",
            "the live page",
            {"starlette": "starlette", "uvicorn": "uvicorn", "websockets": "websockets"},
        ),
        Extra("video", "videos of walks", VIDEO),
    )
}


class Bound(NamedTuple):
    """Which versions of a package phasmid asks for.

    Attributes:
        versions: Such as ``>=13,<15``.
        needed: Whether nothing walks without the package.
    """

    versions: str
    needed: bool


def version_of(distribution: str) -> str:
    """The version of an installed package; empty where it is not installed."""
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return ""


def bounds() -> dict[str, Bound]:
    """What phasmid asks for, by package; nothing where it runs without being installed."""
    try:
        lines = metadata.requires("phasmid") or []
    except metadata.PackageNotFoundError:
        return {}
    found: dict[str, Bound] = {}
    for line in lines:
        wanted, _, marker = line.partition(";")
        name = re.match(r"[\w.-]+", wanted.strip())
        if name and (not marker or name[0] not in found):
            found[name[0]] = Bound(wanted.strip()[name.end() :].strip(), not marker)
    return found


def fits(version: str, bound: str) -> bool:
    """Whether a version keeps bounds such as ``>=13,<15``; others than these two are not judged."""
    here = _release(version)
    for part in bound.split(","):
        sign, limit = part.strip().rstrip("0123456789.").strip(), _release(part)
        if (sign == ">=" and here < limit) or (sign == "<" and here >= limit):
            return False
    return True


def _release(text: str) -> tuple[int, ...]:
    """The numbers of a version, without zeros at their end: 2.0 is 2."""
    found = RELEASE.search(text)
    numbers = [int(part) for part in found[0].split(".")] if found else []
    while numbers and numbers[-1] == 0:
        numbers.pop()
    return tuple(numbers)


def needed_packages() -> Finding:
    """Whether the packages without which nothing walks are there, in fitting versions."""
    topic = "packages"
    wanted = {name: bound for name, bound in bounds().items() if bound.needed}
    if not wanted:
        what = "phasmid runs from its source, and what it needs is not known"
        return Finding(topic, State.READY, what, needed=True)
    faults = {}
    for name, bound in sorted(wanted.items()):
        version = version_of(name)
        if not version:
            faults[name] = f"{name} is not installed"
        elif not fits(version, bound.versions):
            faults[name] = f"{name} is {version} and must be {bound.versions}"
    if faults:
        remedy = f"pip install --upgrade {' '.join(faults)}"
        return Finding(topic, State.BROKEN, "; ".join(faults.values()), remedy, needed=True)
    what = f"the {len(wanted)} packages that it needs, in fitting versions"
    return Finding(topic, State.READY, what, needed=True)


def extra(one: Extra) -> Finding:
    """Whether an extra is there; it is not loaded, which may take seconds."""
    for module, name in one.packages.items():
        if find_spec(module) is None:
            what = f"{one.purpose}: {name or module} is not installed"
            return Finding(one.name, State.ABSENT, what, f'pip install "phasmid[{one.name}]"')
    asked = bounds()
    here = {name: version_of(name) for name in one.packages.values() if name}
    for name, version in here.items():
        bound = asked.get(name, Bound("", False)).versions
        if version and not fits(version, bound):
            what = f"{one.purpose}: {name} is {version} and must be {bound}"
            remedy = f'pip install --upgrade "phasmid[{one.name}]"'
            return Finding(one.name, State.BROKEN, what, remedy)
    told = ", ".join(f"{name} {version}".strip() for name, version in here.items())
    return Finding(one.name, State.READY, f"{one.purpose}: {told}")
