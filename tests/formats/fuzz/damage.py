"""Damages files: the same seed damages a file in the same way on every machine."""

from __future__ import annotations

import random
import re
from collections.abc import Callable

NUMBERS = (b"nan", b"-inf", b"1e400", b"-", b"", b"0", b"-1", b"9" * 400, b"1e300", b"1 2 3 4")
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


def _span(content: bytes, draw: random.Random) -> bytes:
    """A span left out, or repeated up to a thousand times."""
    start = draw.randrange(len(content) + 1)
    end = min(start + draw.randint(1, 300), len(content))
    return content[:start] + content[start:end] * draw.choice([0, 2, 1000]) + content[end:]


def _number(content: bytes, draw: random.Random) -> bytes:
    found = list(re.finditer(rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?", content))
    if not found:
        return content
    one = draw.choice(found)
    return content[: one.start()] + draw.choice(NUMBERS) + content[one.end() :]


def _lines(content: bytes, draw: random.Random) -> bytes:
    """Two lines, or two words, change places."""
    pieces = re.split(draw.choice([rb"(\n)", rb"(\W)"]), content)
    a, b = draw.randrange(len(pieces)), draw.randrange(len(pieces))
    pieces[a], pieces[b] = pieces[b], pieces[a]
    return b"".join(pieces)


def _nested(content: bytes, draw: random.Random) -> bytes:
    opening = re.findall(rb"<\w+[^<>/]*>|\[+|\{", content) or [b"<a>"]
    one = draw.choice(opening[:2000])[:100]
    at = max(content.find(one), 0)
    return content[:at] + one * draw.choice([2, 100, 5000]) + content[at:]


DAMAGES: tuple[Callable[[bytes, random.Random], bytes], ...] = (
    _bits,
    _word,
    _truncated,
    _span,
    _number,
    _lines,
    _nested,
)
