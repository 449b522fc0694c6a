"""Arrays as series of samples, worked on part by part, by one thread or several."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from phasmid.cores import cores
from phasmid.errors import InvalidInput

PART = 4096
"""Samples in a part that is copied, or computed by NumPy; whole blocks of a kernel."""


class Series:
    """One array: an entry per sample, or one for all.

    Attributes:
        shared: Whether all samples have the same entry.
        whole: Whether the entries of any samples can be had without copying.
    """

    def __init__(self, array: np.ndarray, lead: tuple[int, ...], entry: tuple[int, ...]) -> None:
        if not lead:
            lead, array = (1,), array.reshape(1, *entry) if array.shape == entry else array
        self._lead = lead
        full = (*self._lead, *entry)
        self._array = array if array.shape == full else np.broadcast_to(array, full)
        steps = zip(self._array.strides, self._lead, strict=False)
        self.shared = all(step == 0 or length == 1 for step, length in steps)
        # A broadcast array may call itself contiguous only where nothing was repeated.
        self._flat = self._array.reshape(-1, *entry) if self._array.flags.c_contiguous else None
        self.whole = self.shared or self._flat is not None

    def part(self, start: int, stop: int) -> np.ndarray:
        """Entries of some samples, contiguous, shape (stop - start or 1, *entry)."""
        if self.shared:
            return np.ascontiguousarray(self._array[(0,) * len(self._lead)])[None]
        if self._flat is not None:
            return self._flat[start:stop]
        return np.ascontiguousarray(self._array[self._places(start, stop)])

    def target(self, start: int, stop: int) -> np.ndarray:
        """Contiguous space for the entries of some samples; ``put`` brings them home."""
        if self._flat is not None:
            return self._flat[start:stop]
        return np.empty((stop - start, *self._array.shape[len(self._lead) :]))

    def put(self, start: int, stop: int, entries: np.ndarray) -> None:
        """Set the entries of some samples."""
        if self._flat is None:
            self._array[self._places(start, stop)] = entries
        elif not np.may_share_memory(self._flat, entries):
            self._flat[start:stop] = entries

    def _places(self, start: int, stop: int) -> tuple[slice | np.ndarray, ...]:
        if len(self._lead) == 1:
            return (slice(start, stop),)
        return np.unravel_index(np.arange(start, stop), self._lead)


def in_parts(
    work: Callable[[int, int], int | None], count: int, threads: int | None, *, largest: int | None
) -> int | None:
    """Call a function for parts of all samples.

    Args:
        work: Takes where a part starts and stops; returns the first sample that has no solution.
        count: Number of samples.
        threads: How many parts may be worked on at the same time; as many as this
            process may use cores if None.
        largest: Samples in a part at most; as many as give each thread one part if None.

    Returns:
        The first of the samples without a solution, if there are any.

    Raises:
        InvalidInput: The number of threads is none.
    """
    if threads is None:
        threads = cores()
    if not _is_count(threads):
        raise InvalidInput(
            f"threads is {threads!r}; it must be a whole number of at least 1, "
            "or None for all cores."
        )
    share = PART * -(-count // (PART * int(threads)))
    size = min(share, largest or share)
    parts = [(start, min(start + size, count)) for start in range(0, count, size or 1)]
    if threads == 1 or len(parts) < 2:
        found: Iterator[int | None] = (work(*part) for part in parts)
        return next((sample for sample in found if sample is not None), None)
    with ThreadPoolExecutor(min(int(threads), len(parts))) as pool:
        found = pool.map(lambda part: work(*part), parts)
        return min((sample for sample in found if sample is not None), default=None)


def _is_count(value: object) -> bool:
    return isinstance(value, int | np.integer) and not isinstance(value, bool) and int(value) >= 1
