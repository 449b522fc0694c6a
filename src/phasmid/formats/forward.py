"""The direction in which a file's robot walks: an option, checked against the names of its legs."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from phasmid.formats.chains import Chain
from phasmid.formats.findings import Findings
from phasmid.formats.legs import MIDDLE

AXES = {"x": 0.0, "y": 90.0, "-x": 180.0, "-y": -90.0}
"""Direction of each axis of the trunk, seen from above and from x [degrees]."""

AHEAD = {"front": 1, "mid": 0, "centre": 0, "center": 0, "rear": -1, "back": -1, "hind": -1}
"""Parts of names that say where along its way a leg is."""

LEFT = {"left": 1, "right": -1}
"""Parts of names that say on which side a leg is."""

SIDES = {"l": 1, "r": -1}
"""First letters of left and right, as words of their own."""

CLEAR = 0.6
"""Agreement of names and places, from -1 to 1, from which on names are believed."""

LETTERS = {"f": 1, "m": 0, "r": -1, "b": -1, "h": -1}
"""First letters of front, middle, rear, back and hind, beside one of left or right."""


def judge_forward(chains: Sequence[Chain], axis: str, findings: Findings) -> None:
    """Add a finding where names or places of the legs say that another axis points forward.

    Args:
        chains: The legs, in a trunk with x forward.
        axis: Axis of the file that was taken for forward, one of `AXES`.
        findings: Receives the finding.
    """
    said = np.array([_place_in_words(_names(chain)) for chain in chains])
    # A word counts where other legs have its opposite.
    said *= (said.min(axis=0) < 0) & (said.max(axis=0) > 0)
    hips = np.array([chain.hip for chain in chains])[:, :2]
    hips = hips - hips.mean(axis=0)
    first = chains[0].joints[0]
    best, agreement = _best_axis(hips, said)
    if agreement >= CLEAR and best != "x":
        other = _in_file(best, axis)
        what = (
            f"the names of the legs, such as {first.name}, say that {other} points forward; {axis} "
            "was taken."
        )
        findings.suspect("robot", what, first.where, f"--forward {other}")
    elif agreement < CLEAR and _best_axis(hips, said * [1, -1])[1] >= CLEAR:
        what = "the names of the legs call left what is on the right of their front."
        findings.suspect("robot", what, first.where, "swap the names for left and right, or front")
    elif not said.any() and _is_even(hips[:, 0]) and not _is_even(hips[:, 1]):
        other = _in_file("y", axis)
        what = f"its hips are in two rows along {other.removeprefix('-')}; {axis} is forward."
        findings.note("robot", what, first.where, f"--forward {other}, if that is its front")


def _best_axis(
    hips: Float[np.ndarray, "legs 2"], said: Float[np.ndarray, "legs 2"]
) -> tuple[str, float]:
    """Return the axis for which hips are where their names say, and how far they are, up to 1."""
    agreement = {}
    for name, degrees in AXES.items():
        c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        there = said * (hips @ [[c, -s], [s, c]])
        most = float(np.abs(there).sum())
        agreement[name] = float(there.sum()) / most if most else 0.0
    best = max(agreement, key=lambda name: agreement[name])
    return best, agreement[best]


def _is_even(offsets: Float[np.ndarray, " legs"]) -> bool:
    """Return whether as many hips are on either side of a plane, and none in it."""
    return bool((offsets > MIDDLE).sum() == (offsets < -MIDDLE).sum() == len(offsets) / 2)


def _in_file(best: str, axis: str) -> str:
    """Return the file's name of an axis of the turned trunk."""
    degrees = AXES[best] + AXES[axis]
    return next(name for name, own in AXES.items() if not math.remainder(own - degrees, 360))


def _names(chain: Chain) -> list[str]:
    """Return the words of a leg's names in lower case: parts between signs and capitals."""
    names = [joint.name for joint in chain.joints]
    names += [link.name for rigid in chain.links for link in rigid.links]
    words = []
    for name in names:
        spaced = re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", " ", name)
        words += [word.lower() for word in re.split(r"[^A-Za-z]+", spaced) if word]
    return words


def _place_in_words(words: Sequence[str]) -> tuple[float, float]:
    """Return how far ahead and left words say that a leg is: 1, 0 or -1 each."""
    ahead, left = [], []
    for word in words:
        ahead += [sign for part, sign in AHEAD.items() if part in word]
        left += [sign for part, sign in LEFT.items() if part in word]
        if word in SIDES:
            left.append(SIDES[word])
        elif len(word) == 2:
            # Side and place in either order: lf and fl are one leg, as are lr and rl.
            orders = (word, word[::-1])
            known = [two for two in orders if two[0] in SIDES and two[1] in LETTERS]
            for side, place in map(tuple, known[:1]):
                ahead.append(LETTERS[place])
                left.append(SIDES[side])
    return float(np.sign(sum(ahead))), float(np.sign(sum(left)))
