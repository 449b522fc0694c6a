"""Damages files: the same seed damages a file in the same way on every machine."""

from __future__ import annotations

import random
import re
from collections.abc import Callable

NUMBERS = (
    b"nan",
    b"-inf",
    b"1e400",
    b"-",
    b"",
    b"0",
    b"-1",
    b"1e-320",
    b"9" * 400,
    b"1e300",
    b"4294967296",
    b"0x10",
    b"1 2 3 4",
    b"\xff",
)
"""What takes the place of a number in a text."""

WORDS = (0, 1, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0x7FC00000, 0x7F800000, 0x10000000)
"""Four bytes that counts, sizes and floats should not be."""


def damaged(content: bytes, seed: int) -> bytes:
    """A copy with one to three damages, most often one."""
    draw = random.Random(seed)
    # Damages that leave a text well formed reach what reads it behind the parser.
    damages = DAMAGES if b"\0" in content[:2000] else DAMAGES + (_number, _lines) * 3
    for _ in range(draw.choice([1, 1, 1, 2, 3])):
        content = draw.choice(damages)(content, draw)
    return content


def _bits(content: bytes, draw: random.Random) -> bytes:
    raw = bytearray(content)
    for _ in range(draw.randint(1, 20) if raw else 0):
        raw[draw.randrange(len(raw))] ^= 1 << draw.randrange(8)
    return bytes(raw)


def _word(content: bytes, draw: random.Random) -> bytes:
    # Counts and sizes stand near the beginning.
    at = draw.randrange(min(len(content), draw.choice([100, 2000, 10**9])) + 1)
    return content[:at] + draw.choice(WORDS).to_bytes(4, "little") + content[at + 4 :]


def _truncated(content: bytes, draw: random.Random) -> bytes:
    return content[: draw.randrange(len(content) + 1)]


def _span(content: bytes, draw: random.Random) -> tuple[int, int]:
    start = draw.randrange(len(content) + 1)
    return start, min(start + draw.randint(1, 300), len(content))


def _cut_out(content: bytes, draw: random.Random) -> bytes:
    start, end = _span(content, draw)
    return content[:start] + content[end:]


def _repeated(content: bytes, draw: random.Random) -> bytes:
    start, end = _span(content, draw)
    times = draw.choice([2, 2, 10, 1000])
    return content[:start] + content[start:end] * times + content[end:]


def _noise(content: bytes, draw: random.Random) -> bytes:
    at = draw.randrange(len(content) + 1)
    return content[:at] + draw.randbytes(draw.randint(1, 50)) + content[at:]


def _number(content: bytes, draw: random.Random) -> bytes:
    found = list(re.finditer(rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?", content))
    if not found:
        return content
    one = draw.choice(found)
    return content[: one.start()] + draw.choice(NUMBERS) + content[one.end() :]


def _lines(content: bytes, draw: random.Random) -> bytes:
    lines = content.split(b"\n")
    a, b = draw.randrange(len(lines)), draw.randrange(len(lines))
    what = draw.randrange(3)
    if what == 0:
        del lines[a]
    elif what == 1:
        lines.insert(a, lines[b])
    else:
        lines[a], lines[b] = lines[b], lines[a]
    return b"\n".join(lines)


def _tokens(content: bytes, draw: random.Random) -> bytes:
    tokens = re.split(rb"(\W)", content)
    a, b = draw.randrange(len(tokens)), draw.randrange(len(tokens))
    tokens[a], tokens[b] = tokens[b], tokens[a]
    return b"".join(tokens)


def _nested(content: bytes, draw: random.Random) -> bytes:
    opening = re.findall(rb"<\w+[^<>/]*>|\[+|\{", content) or [b"<a>"]
    one = draw.choice(opening[:2000])[:100]
    at = content.find(one) + 1 and draw.choice([content.find(one), content.rfind(one)])
    return content[:at] + one * draw.choice([2, 100, 5000]) + content[at:]


DAMAGES: tuple[Callable[[bytes, random.Random], bytes], ...] = (
    _bits,
    _word,
    _truncated,
    _cut_out,
    _repeated,
    _noise,
    _number,
    _lines,
    _tokens,
    _nested,
)
