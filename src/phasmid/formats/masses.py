"""Masses and inertias by options, in place of a file's."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidRobot, located
from phasmid.formats.findings import Finding, Severity
from phasmid.formats.options import ImportOptions
from phasmid.robot import JOINTS, Part, Robot, load_robot
from phasmid.robot.inertial import Inertial
from phasmid.units import plain_number

SLENDER = 0.25
"""Width of a link without a mesh, of its length; that of the PhantomX's femur."""

THINNEST = 0.005
"""Least side of the box of a link [m]: a mesh may be flat, a link is not."""


@dataclass(frozen=True, eq=False)
class Weighed:
    """A link in its frame of Table 1, or the trunk in the body's, before validation.

    Attributes:
        subject: Of messages, such as ``link tibia_rf``.
        leg: Name of its leg; empty for the trunk.
        joint: ``coxa``, ``femur``, ``tibia``, or ``body``.
        length: From joint to joint; of the trunk, the mean distance of hips from its origin [m].
        size: Box of a trunk without meshes [m], shape (3,).
        inertial: Mass and inertia; None where there is none.
        parts: Its look, in this frame.
        where: File and line.
    """

    subject: str
    leg: str
    joint: str
    length: float
    size: Float[np.ndarray, "3"]
    inertial: Inertial | None
    parts: tuple[Part, ...]
    where: str


def weighed(
    links: Sequence[Weighed], options: ImportOptions, findings: list[Finding]
) -> list[Weighed]:
    """Apply the options to the masses and inertias of links.

    Args:
        links: All of a robot.
        options: ``masses`` and ``total_mass``.
        findings: Receives notes on the changes.

    Raises:
        InvalidInput: No preset and no file is called so.
        InvalidRobot: There is no mass to scale.
    """
    chosen = list(links)
    if options.masses == "geometry":
        chosen = [_spread(link) for link in _with_shares(chosen, options)]
        note = "every link keeps its mass, spread over its box; the file's inertias were not used."
        if options.total_mass is not None and not all(map(_has_mass, links)):
            count = sum(not _has_mass(link) for link in links)
            note = (
                f"{count} of {len(links)} links without a mass in the file: all "
                f"{plain_number(options.total_mass)} kg were shared among the links by the volume "
                f"of their boxes, and spread over these."
            )
    elif options.masses != "as-given":
        with located("option --masses"):
            donor = load_robot(options.masses)
        chosen = [_taken(link, donor) for link in chosen]
        note = (
            f"masses and inertias are those of {donor.name}, scaled to this robot's lengths; the "
            "file's were not used."
        )
    if options.masses != "as-given":
        findings.append(Finding(Severity.NOTE, "masses", note))
    if options.total_mass is None:
        return chosen
    total = sum(link.inertial.mass for link in chosen if link.inertial)
    if not total > 0:
        raise InvalidRobot("no link has a mass that could be scaled.", hint="--masses geometry")
    factor = options.total_mass / total
    if math.isclose(factor, 1.0, rel_tol=1e-12):
        return chosen
    findings.append(
        Finding(
            Severity.NOTE,
            "masses",
            f"were scaled by {plain_number(factor)}, from {plain_number(total)} kg to "
            f"{plain_number(options.total_mass)} kg.",
        )
    )
    return [_scaled(link, factor) for link in chosen]


def _has_mass(link: Weighed) -> bool:
    return bool(link.inertial and link.inertial.mass)


def _with_shares(links: list[Weighed], options: ImportOptions) -> list[Weighed]:
    """Links with masses; where one has none, the total is shared by the volume of their boxes."""
    if options.total_mass is None or all(map(_has_mass, links)):
        return links
    volumes = [float(np.prod(high - low)) for low, high in map(box_of, links)]
    return [
        replace(
            link,
            inertial=Inertial(
                options.total_mass * volume / sum(volumes), np.zeros(3), np.zeros((3, 3))
            ),
        )
        for link, volume in zip(links, volumes, strict=True)
    ]


def box_of(link: Weighed) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Lowest and highest corner of a link's meshes, or of a rod or box in their place."""
    if link.parts:
        corners = np.concatenate([part.vertices for part in link.parts])
        low, high = corners.min(axis=0), corners.max(axis=0)
    elif link.joint == "body":
        low, high = -link.size / 2, link.size / 2
    else:
        half = SLENDER * link.length / 2
        low, high = np.array([0.0, -half, -half]), np.array([link.length, half, half])
    thin = np.maximum(0.0, THINNEST - (high - low)) / 2
    return low - thin, high + thin


def _spread(link: Weighed) -> Weighed:
    """The link as a solid box of its own mass."""
    if link.inertial is None:
        return link
    low, high = box_of(link)
    a, b, c = (high - low) ** 2
    inertia = np.diag([b + c, a + c, a + b]) * link.inertial.mass / 12
    return replace(link, inertial=Inertial(link.inertial.mass, (low + high) / 2, inertia))


def _taken(link: Weighed, donor: Robot) -> Weighed:
    """The link with the donor's mass, its shape scaled to this length."""
    if link.joint == "body":
        body = donor.body
        span = float(np.mean(np.linalg.norm(donor.arrays.p_body_hip, axis=1)))
        mass, com, inertia, ratio = body.mass, body.com, body.inertia, link.length / span
    else:
        leg = donor.leg(link.leg) if link.leg in donor.leg_names else donor.legs[0]
        piece = leg.links[JOINTS.index(link.joint)]
        mass, com, inertia = piece.mass, piece.com, piece.inertia
        ratio = link.length / piece.length
    return replace(link, inertial=Inertial(mass, ratio * com, ratio**2 * inertia))


def _scaled(link: Weighed, factor: float) -> Weighed:
    if link.inertial is None:
        return link
    mass, com, inertia = link.inertial.mass, link.inertial.com, link.inertial.inertia
    return replace(link, inertial=Inertial(factor * mass, com, factor * inertia))
