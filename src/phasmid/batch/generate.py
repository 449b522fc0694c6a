"""Writes ``generated.py``: run ``python -m phasmid.batch.generate`` after changing an equation."""

from __future__ import annotations

import hashlib
import inspect
import math
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from phasmid.batch import rows as rows_module
from phasmid.batch.kernels import KERNELS, Block, Kernel, Shapes
from phasmid.batch.recorder import Number, Tape
from phasmid.batch.source import Rows, at, block_source, coefficients_source

HEADER = '''"""What numba compiles. Made by ``python -m phasmid.batch.generate``; do not edit.

All of it is in one file, since numba's cache looks at the file of the outermost function alone.
How it is compiled counts as well: SHA-256 of compiled.py is
{fingerprint}.
"""

# ruff: noqa: ARG001, D103, E501
# fmt: off
# mypy: ignore-errors
'''


def generated_source() -> str:
    """The text of ``generated.py``."""
    # Read, not imported: as text its options and its prefetch have a fingerprint.
    how = Path(__file__).with_name("compiled.py").read_text(encoding="utf-8")
    header = HEADER.format(fingerprint=hashlib.sha256(how.encode()).hexdigest())
    docstring = inspect.getsource(rows_module).index("import math")
    common = inspect.getsource(rows_module)[docstring:]
    parts = [_kernel_source(kernel) for kernel in KERNELS]
    count = max(total for _, total in parts)
    places = ", ".join(at(i) for i in range(count))
    rows = f"({places}) = (\n    np.uint64(i) * BLOCK for i in range({count})\n)\n"
    return "\n\n".join([f"{header}\n{common}\n{rows}", *(text for text, _ in parts)])


def _kernel_source(kernel: Kernel) -> tuple[str, int]:
    """Source of a kernel, and how many rows it needs."""
    shapes = {
        **kernel.sample_inputs,
        **kernel.between,
        **kernel.sample_outputs,
        **kernel.leg_inputs,
        **kernel.leg_outputs,
    }
    places: dict[str, int] = {}
    taken = 0
    for name, shape in shapes.items():
        places[name] = taken
        taken += math.prod(shape)
    sources: list[str] = []
    total = taken
    for suffix, block in (("before", kernel.before), ("leg", kernel.each), ("after", kernel.after)):
        if block is not None:
            rows = Rows(count=taken)
            sources += _block(f"{kernel.name}_{suffix}", block, shapes, places, rows)
            total = max(total, rows.count)
    return "\n\n".join([*sources, "\n".join(_driver(kernel, places, total)) + "\n"]), total


def _block(
    name: str, block: Block, shapes: Shapes, places: dict[str, int], rows: Rows
) -> Iterator[str]:
    tape = Tape()
    constants, start = {}, 0
    for key, shape in block.constants.items():
        size = math.prod(shape)
        numbers = [tape.input(f"c[{start + i}]", varies=False) for i in range(size)]
        constants[key], start = _shaped(numbers, shape), start + size
    inputs = {}
    for key in block.inputs:
        size = math.prod(shapes[key])
        numbers = [tape.input(f"{key}[{i}]", varies=True) for i in range(size)]
        rows.of.update((number, places[key] + i) for i, number in enumerate(numbers))
        inputs[key] = _shaped(numbers, shapes[key])
    outputs = {}
    for key, value in block.compute(constants, inputs).items():
        for i, number in enumerate(np.ravel(np.array(value, dtype=object))):
            recorded = number if isinstance(number, Number) else tape.constant(number)
            outputs[places[key] + i] = recorded
    source, coefficients = block_source(name, rows, outputs)
    yield coefficients_source(f"{name}_coefficients", coefficients)
    yield source


def _shaped(numbers: list[Number], shape: tuple[int, ...]) -> np.ndarray | Number:
    return np.array(numbers, dtype=object).reshape(shape) if shape else numbers[0]


def _driver(kernel: Kernel, places: dict[str, int], total: int) -> Iterator[str]:
    """The loop over samples and legs; it returns the first entry without a solution, if any.

    An array comes flat, with the numbers from one sample to the next: 0 if all share one.
    """
    given = {**kernel.sample_inputs, **kernel.leg_inputs}
    found = {name: shape for name, shape in kernel.leg_outputs.items() if name != "margin"}
    found |= kernel.sample_outputs
    constants = ["k_before"] * bool(kernel.before) + ["k_legs"]
    flat = [word for name in (*given, *found) for word in (name, f"{name}_stride")]

    def get(name: str, place: str) -> str:
        return f"gather({name}, {place}, w, {at(places[name])}, count)"

    def put(name: str, place: str) -> str:
        return f"scatter(w, {at(places[name])}, {name}, {place}, count)"

    def each(names: Shapes, move: Callable[[str, str], str], legs: bool) -> Iterator[str]:
        # After each array its next entries are asked for: memory takes only so many requests at
        # the same time.
        indent, part = (" " * 12, "leg, legs") if legs else (" " * 8, "np.uint64(0), np.uint64(1)")
        for name, shape in names.items():
            if name != "margin":
                width, stride = f"np.uint64({math.prod(shape)})", f"{name}_stride"
                begin = f"first * {stride}" + (f" + leg * {width}" if legs else "")
                yield indent + move(name, f"{begin}, {stride}, {width}")
                yield f"{indent}ahead({name}, first, {stride}, {part})"

    yield f"def {kernel.name}({', '.join([*constants, *flat])}, start, stop):"
    yield f"    w = np.empty({total} * np.int64(BLOCK))"
    yield "    legs = np.uint64(k_legs.shape[0])"
    yield "    missed = stop * legs"
    yield "    for first in range(start, stop, BLOCK):"
    yield "        count = min(BLOCK, stop - first)"
    yield from each(kernel.sample_inputs, get, False)
    if kernel.before:
        yield f"        {kernel.name}_before(k_before[0], w)"
    yield "        for leg in range(legs):"
    yield from each(kernel.leg_inputs, get, True)
    yield f"            {kernel.name}_leg(k_legs[leg], w)"
    yield from each(kernel.leg_outputs, put, True)
    if "margin" in kernel.leg_outputs:
        yield f"            at = first_below_zero(w, {at(places['margin'])}, count)"
        yield "            if at < count:"
        yield "                missed = min(missed, (first + at) * legs + leg)"
        yield "        if missed < stop * legs:"
        yield "            return missed"
    if kernel.after:
        yield f"        {kernel.name}_after(k_before[0], w)"
    yield from each(kernel.sample_outputs, put, False)
    yield "    return missed"


if __name__ == "__main__":
    Path(__file__).with_name("generated.py").write_text(generated_source(), encoding="utf-8")
