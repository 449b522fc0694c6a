"""Python source of straight-line loops, from recorded numbers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from phasmid.batch.recorder import FUNCTIONS, Number

SYMBOLS = {"+": "{} + {}", "-": "{} - {}", "*": "{} * {}", "/": "{} / {}", "neg": "-{}"}
CALLS = {"sqrt": "math.sqrt({})", "max": "max({}, {})", "min": "min({}, {})"}
COSTLY = frozenset({"/", "sqrt"})

WIDEST = 60
"""An expression longer than this is given a name."""


@dataclass
class Rows:
    """Where in a block's scratch space each number stands."""

    of: dict[Number, int] = field(default_factory=dict)
    count: int = 0

    def take(self, numbers: Iterable[Number] = ()) -> int:
        """The next rows, for these numbers; returns the first."""
        first = self.count
        for number in numbers:
            self.of[number] = self.count
            self.count += 1
        return first

    def skip(self, width: int) -> int:
        """The next rows, for nothing in particular; returns the first."""
        first, self.count = self.count, self.count + width
        return first


class Lines:
    """Statements that compute numbers, each shared one once."""

    def __init__(self, known: dict[Number, str], wanted: Iterable[Number]) -> None:
        self.text: list[str] = []
        self._known = dict(known)
        self._uses: dict[Number, int] = {}
        self._names = 0
        for number in wanted:
            self._count(number)

    def value(self, number: Number, *, inside: bool = False) -> str:
        """An expression for a number, after the statements that it needs."""
        if number in self._known:
            return self._known[number]
        if number.op == "constant":
            return repr(number.args[0])
        operands = [self.value(v, inside=number.op in SYMBOLS) for v in number.args]
        text = (SYMBOLS | CALLS)[number.op].format(*operands)
        if self._uses[number] > 1 or len(text) > WIDEST:
            name = f"v{self._names}"
            self._names += 1
            self.text.append(f"{name} = {text}")
            self._known[number] = name
            return name
        return f"({text})" if inside and number.op in SYMBOLS else text

    def _count(self, number: Number) -> None:
        self._uses[number] = self._uses.get(number, 0) + 1
        if self._uses[number] > 1 or number in self._known or number.op == "constant":
            return
        for operand in number.operands:
            self._count(operand)


def block_source(name: str, rows: Rows, outputs: dict[int, Number]) -> tuple[str, list[Number]]:
    """A function that computes rows of a block from others, with constants ``k``.

    Args:
        name: Of the function.
        rows: Where the inputs stand; takes more for what lies between.
        outputs: The numbers to compute, by the rows to put them.

    Returns:
        The source, and the numbers that ``k`` must hold.
    """
    live = list(_live(outputs.values()))
    needed = [v for number in live for v in number.operands] + list(outputs.values())
    constants = [v for v in dict.fromkeys(needed) if v.stage < 0 and v.op != "constant"]
    known = {number: f"k{i}" for i, number in enumerate(constants)}
    lines = [f"def {name}(k, w):"] + [f"    k{i} = k[{i}]" for i in range(len(constants))]

    # What a later loop needs is kept in a row if it cost much, and else computed again.
    kept = {v for number in live if number.op in FUNCTIONS for v in number.operands}
    passed = {v for number in live for v in number.operands if number.stage > v.stage}
    kept |= {v for v in passed if v.op in COSTLY and v.stage >= 0}
    for stage in range(1 + max(number.stage for number in live)):
        lines += _calls([v for v in live if v.op in FUNCTIONS and v.stage == stage], rows)
        given = known | {v: f"w[{at(row)} + i]" for v, row in rows.of.items()}
        results = {row: v for row, v in outputs.items() if max(v.stage, 0) == stage}
        for number in live:
            if number in kept and number.stage == stage and number not in rows.of:
                results[rows.take([number])] = number
        lines += _loop(results, given)
    return "\n".join(lines) + "\n", constants


def coefficients_source(name: str, numbers: list[Number]) -> str:
    """A function that computes a block's constants from inputs ``c``, for all legs at once."""
    known = {v: str(v.args[0]) for v in _live(numbers, fixed=True) if v.op == "input"}
    body = Lines(known, numbers)
    values = [body.value(number) for number in numbers]
    lines = [f"def {name}(c):", *(f"    {line}" for line in body.text), "    return ["]
    return "\n".join([*lines, *(f"        {value}," for value in values), "    ]"]) + "\n"


def at(row: int) -> str:
    """The name of a row's place in the scratch space."""
    return f"R{row}"


def _live(wanted: Iterable[Number], *, fixed: bool = False) -> Iterator[Number]:
    """All numbers that the wanted ones need, operands first; fixed ones if asked for."""
    seen: set[Number] = set()
    stack = [(number, False) for number in reversed(list(wanted))]
    while stack:
        number, done = stack.pop()
        if done:
            yield number
            continue
        if number in seen or (number.stage < 0 and not fixed):
            continue
        seen.add(number)
        stack.append((number, True))
        stack += [(v, False) for v in reversed(number.operands)]


def _calls(functions: list[Number], rows: Rows) -> Iterator[str]:
    """Calls that evaluate functions of rows; a sine brings its cosine and the reverse."""
    for function in functions:
        places = ", ".join(at(rows.of[v]) for v in function.args)
        if function.op == "arctan2":
            yield f"    arctan2(w, {places}, {at(rows.take([function]))})"
        elif function not in rows.of:
            (angle,) = function.args
            sine, cosine = angle.tape.record("sin", angle), angle.tape.record("cos", angle)
            first = rows.take([sine, cosine])
            yield f"    sincos(w, {places}, {at(first)}, {at(first + 1)})"


def _loop(results: dict[int, Number], known: dict[Number, str]) -> Iterator[str]:
    """A loop over a block's samples that computes rows."""
    if results:
        body = Lines(known, results.values())
        stores = [f"w[{at(row)} + i] = {body.value(number)}" for row, number in results.items()]
        yield "    for i in range(BLOCK):"
        yield from (f"        {line}" for line in (*body.text, *stores))
