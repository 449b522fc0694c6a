"""A kernel, or the readable equations in its place, over arrays."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from phasmid.batch import compiled, generated
from phasmid.batch.kernels import KERNELS
from phasmid.batch.series import PART, Series, in_parts

Arrays = Mapping[str, np.ndarray]


def evaluate(
    name: str,
    legs: Arrays,
    inputs: Arrays,
    outputs: Sequence[np.ndarray],
    lead: tuple[int, ...],
    readable: Callable[..., tuple[np.ndarray, ...]],
    *,
    trunk: Arrays | None = None,
    threads: int | None,
) -> int | None:
    """Fill the outputs of a kernel.

    Args:
        name: Of the kernel.
        legs: What it has to know of the legs, L of them along the first axis.
        inputs: Its inputs by name; axes: leading ones that broadcast to ``lead``, the legs where
            an input is one per leg, those of an entry.
        outputs: Arrays to fill, with the same axes: those per leg, then those per sample.
        lead: Leading axes.
        readable: The same in NumPy, from parts of the inputs by name to parts of the outputs and
            then the margin, if the kernel has one; each part has one leading axis.
        trunk: What it has to know of the trunk, with a first axis of one.
        threads: As in ``in_parts``.

    Returns:
        The first entry without a solution, counted over samples and legs, if there is one.
    """
    kernel = next(kernel for kernel in KERNELS if kernel.name == name)
    leg_count = len(legs["lengths"])

    entries = {key: (leg_count, *shape) for key, shape in kernel.leg_inputs.items()}
    entries = {**kernel.sample_inputs, **entries}
    given = {key: Series(inputs[key], lead, entry) for key, entry in entries.items()}
    found = [Series(array, lead, array.shape[len(lead) :]) for array in outputs]

    def in_numpy(start: int, stop: int) -> int | None:
        # The kernels do not warn of infinite angles either.
        with np.errstate(invalid="ignore", over="ignore"):
            results = readable(**{key: values.part(start, stop) for key, values in given.items()})
        for values, entries in zip(found, results, strict=False):
            values.put(start, stop, entries)
        if "margin" not in kernel.leg_outputs:
            return None
        missed = np.flatnonzero(~(results[-1] >= 0))
        return start * leg_count + int(missed[0]) if len(missed) else None

    def by_kernel(start: int, stop: int) -> int | None:
        parts = [values.part(start, stop) for values in given.values()]
        targets = [values.target(start, stop) for values in found]
        flat = []
        for part in (*parts, *targets):
            stride = part[0].size if len(part) == stop - start else 0
            flat += [part.reshape(-1), np.uint64(stride)]
        missed = int(function(*constants, *flat, np.uint64(0), np.uint64(stop - start)))
        for values, entries in zip(found, targets, strict=True):
            values.put(start, stop, entries)
        return None if missed == (stop - start) * leg_count else start * leg_count + missed

    count = int(np.prod(lead, dtype=int))
    if compiled.numba() is None:
        return in_parts(in_numpy, count, threads, largest=PART)
    function = compiled.machine_code(name)
    constants = [] if trunk is None else [_coefficients(f"{name}_before", trunk)]
    constants.append(_coefficients(f"{name}_leg", legs))
    whole = all(values.whole for values in (*given.values(), *found))
    return in_parts(by_kernel, count, threads, largest=None if whole else PART)


def _coefficients(block: str, known: Arrays) -> np.ndarray:
    """The constants of a block for each leg or trunk, shape (L, constants)."""
    columns = np.concatenate([v.reshape(len(v), -1) for v in known.values()], axis=1).T
    values = getattr(generated, f"{block}_coefficients")(columns)
    return np.stack(np.broadcast_arrays(columns[0], *values)[1:], axis=-1)
