"""Numbers that record what is computed with them.

Given to the readable equations in place of floats or arrays, alone or in arrays of objects, they
leave behind a graph in which equal expressions are one node and nothing is multiplied by zero.
"""

from __future__ import annotations

from typing import Any

import numpy as np

Operand = Any
"""A recorded number, or any real number."""

COMMUTATIVE = frozenset({"+", "*"})
FUNCTIONS = frozenset({"cos", "sin", "arctan2"})
"""What is evaluated a block at a time, between two loops of plain arithmetic."""

UFUNCS = {
    "add": "+",
    "subtract": "-",
    "multiply": "*",
    "divide": "/",
    "negative": "neg",
    "sqrt": "sqrt",
    "maximum": "max",
    "minimum": "min",
    "cos": "cos",
    "sin": "sin",
    "arctan2": "arctan2",
}


class Number:
    """One node of the graph.

    Attributes:
        op: What was computed; ``constant`` and ``input`` are leaves.
        args: Operands, or the value or name of a leaf.
        stage: How many functions of ``FUNCTIONS`` stand before it on the longest way from an
            input; -1 for what is the same for all samples.
    """

    __slots__ = ("args", "op", "stage", "tape")

    def __init__(self, tape: Tape, op: str, args: tuple[Any, ...], stage: int) -> None:
        self.tape, self.op, self.args, self.stage = tape, op, args, stage

    @property
    def operands(self) -> tuple[Number, ...]:
        """The numbers that it was computed from; none for a leaf."""
        return () if self.op in {"constant", "input"} else self.args

    def __add__(self, other: Operand) -> Any:
        return self._binary("+", self, other)

    def __radd__(self, other: Operand) -> Any:
        return self._binary("+", other, self)

    def __sub__(self, other: Operand) -> Any:
        return self._binary("-", self, other)

    def __rsub__(self, other: Operand) -> Any:
        return self._binary("-", other, self)

    def __mul__(self, other: Operand) -> Any:
        return self._binary("*", self, other)

    def __rmul__(self, other: Operand) -> Any:
        return self._binary("*", other, self)

    def __truediv__(self, other: Operand) -> Any:
        return self._binary("/", self, other)

    def __rtruediv__(self, other: Operand) -> Any:
        return self._binary("/", other, self)

    def __neg__(self) -> Number:
        return self.tape.record("neg", self)

    def __pow__(self, exponent: int) -> Number:
        power = self
        for _ in range(exponent - 1):
            power = power * self
        return power

    def _binary(self, op: str, left: Operand, right: Operand) -> Any:
        # An array takes the operation over, entry by entry.
        if isinstance(left, np.ndarray) or isinstance(right, np.ndarray):
            return NotImplemented
        return self.tape.record(op, left, right)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **_: Any) -> Any:
        if any(isinstance(value, np.ndarray) for value in inputs):
            boxed = (v if isinstance(v, np.ndarray) else np.array(v, object) for v in inputs)
            return getattr(ufunc, method)(*boxed)
        return self.tape.record(UFUNCS[ufunc.__name__], *inputs)


class Tape:
    """All numbers of one recording, each different one once."""

    def __init__(self) -> None:
        self._numbers: dict[tuple[Any, ...], Number] = {}

    def input(self, name: str, *, varies: bool) -> Number:
        """A new number of this name; ``varies`` if it differs from sample to sample."""
        return self._number("input", (name,), 0 if varies else -1)

    def constant(self, value: float) -> Number:
        """A number that is known now."""
        return self._number("constant", (float(value),), -1)

    def record(self, op: str, *operands: Operand) -> Number:
        """The number that an operation gives, in its simplest form."""
        args = tuple(v if isinstance(v, Number) else self.constant(v) for v in operands)
        folded = self._folded(op, args)
        if folded is not None:
            return folded
        if op in COMMUTATIVE and (op, args[::-1]) in self._numbers:
            args = args[::-1]
        stage = max(v.stage for v in args)
        return self._number(op, args, stage + 1 if op in FUNCTIONS else stage)

    def _number(self, op: str, args: tuple[Any, ...], stage: int) -> Number:
        return self._numbers.setdefault((op, args), Number(self, op, args, stage))

    def _folded(self, op: str, args: tuple[Number, ...]) -> Number | None:
        """Something simpler of the same value, finite numbers taken for granted."""
        a, b = args[0], args[-1]
        if op == "neg":
            if a.op == "constant":
                return self.constant(-a.args[0])
            return a.args[0] if a.op == "neg" else None
        if op == "/" and b.op == "constant":
            mantissa, _ = np.frexp(b.args[0])
            # Multiplying by the inverse is exact for powers of two alone.
            return self.record("*", a, 1 / b.args[0]) if abs(mantissa) == 0.5 else None
        if op not in {"+", "-", "*"}:
            return None
        if a.op == b.op == "constant":
            x, y = a.args[0], b.args[0]
            return self.constant(x * y if op == "*" else x + y if op == "+" else x - y)
        return self._product(a, b) if op == "*" else self._sum(op, a, b)

    def _product(self, a: Number, b: Number) -> Number | None:
        for value, other in ((a, b), (b, a)):
            if value.op == "constant" and value.args[0] in (0.0, 1.0, -1.0):
                return (
                    self.constant(0.0)
                    if not value.args[0]
                    else other
                    if value.args[0] > 0
                    else -other
                )
            if value.op == "neg":
                return -(value.args[0] * other)
        return None

    def _sum(self, op: str, a: Number, b: Number) -> Number | None:
        if b.op == "constant" and b.args[0] == 0:
            return a
        if a.op == "constant" and a.args[0] == 0:
            return b if op == "+" else -b
        if b.op == "neg":
            return a - b.args[0] if op == "+" else a + b.args[0]
        if a.op == "neg" and op == "+":
            return b - a.args[0]
        return None
