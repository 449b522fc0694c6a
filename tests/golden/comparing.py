"""Compare the answers of two versions bit by bit."""

from __future__ import annotations

import numpy as np

from golden.running import Answers, Channel


def compare(ours: Answers, theirs: Answers, *, names_only: bool = False) -> list[str]:
    """Return each difference in one line: where, from which time on, and how large.

    What differs first comes first, so that the cause stands above its effects.

    Args:
        ours: Answers of one version.
        theirs: Of the other.
        names_only: Whether the numbers may differ, as those of the wall clock do.
    """
    lines = []
    for kind, own, other in (
        ("channel", set(ours.channels), set(theirs.channels)),
        ("text", set(ours.texts), set(theirs.texts)),
    ):
        lines += [f"{kind} {label}: only here" for label in sorted(own - other)]
        lines += [f"{kind} {label}: only there" for label in sorted(other - own)]
    common = [] if names_only else sorted(set(ours.channels) & set(theirs.channels))
    pairs = [(label, _difference(ours.channels[label], theirs.channels[label])) for label in common]
    found = sorted((found[0], f"{label}: {found[1]}") for label, found in pairs if found)
    lines += [line for _, line in found]
    for label in sorted(set(ours.texts) & set(theirs.texts)):
        own, other = (answers.texts[label].splitlines() for answers in (ours, theirs))
        for number in range(max(len(own), len(other))):
            here, there = (part[number] if number < len(part) else "" for part in (own, other))
            if here != there:
                lines.append(f"{label}, line {number + 1}: {here!r}, there {there!r}")
                break
    return lines


def _difference(ours: Channel, theirs: Channel) -> tuple[float, str] | None:
    """Return from which time on two channels differ, and how; None where all bits are equal."""
    if ours.dims != theirs.dims:
        return -np.inf, f"dimensions {ours.dims}, there {theirs.dims}"
    a, b = np.ascontiguousarray(ours.values), np.ascontiguousarray(theirs.values)
    shapes = "" if a.shape == b.shape else f"; shape {a.shape}, there {b.shape}"
    if shapes and (ours.time is None or theirs.time is None or a.shape[1:] != b.shape[1:]):
        return -np.inf, shapes.removeprefix("; ")
    # Of runs of different lengths the common part is compared.
    a, b = a[: len(b)] if a.ndim else a, b[: len(a)] if b.ndim else b
    differs = a.view(np.uint64) != b.view(np.uint64)
    if not differs.any():
        return (np.inf, f"equal up to its end{shapes}") if shapes else None
    with np.errstate(invalid="ignore"):
        distance = np.abs(a - b)[differs]
    finite = distance[np.isfinite(distance)]
    size = f"at most {finite.max():.3g}" if finite.size else "absent values"
    size += f" of {np.nanmax(np.abs(b)):.3g}" if np.isfinite(b).any() else ""
    if ours.time is None:
        return np.inf, f"{differs.sum()} of {differs.size} numbers differ, {size}"
    first = float(ours.time[differs.reshape(len(differs), -1).any(axis=1).argmax()])
    return first, f"differs from {first:.6g} s on, {size}{shapes}"
