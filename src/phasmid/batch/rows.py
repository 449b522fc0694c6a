"""What is done to the rows of a block: filled, emptied, and sine, cosine and arc tangent.

``generate`` copies the source of these functions into ``generated.py``, where numba compiles
them. ``w`` is a block's scratch space, flat; the other arguments say where in it rows begin. They
are unsigned, since numba counts signed ones from the end when negative, and then no loop becomes
vector instructions.
"""

# mypy: disable-error-code="no-untyped-def, no-untyped-call"
import math

import numpy as np

BLOCK = np.uint64(64)
"""Samples in a block: its rows fit the cache nearest to the core."""

LARGEST_ANGLE = 1e5
"""Up to here multiples of a quarter turn are exact products of 17 and 33 bits [rad]."""

LARGEST_SIDE = 1e150
"""Up to here sides of a triangle can be added and divided."""

ROUNDING = 1.5 * 2.0**52
"""Added to a number, it leaves the nearest whole number in the lowest bits."""

SIGN = np.int64(-(2**63))
"""The bit that makes a number negative."""


ONE, TWO, THREE = np.uint64(1), np.uint64(2), np.uint64(3)


def prefetch(values, index):
    """Ask for a number of an array ahead of its use; only machine code can (``compiled``)."""


def ahead(values, first, stride, part, parts):
    """Ask for one of equal parts of the next block: memory then works while the core computes."""
    share = stride // parts * BLOCK
    begin = (first + BLOCK) * stride + part * share
    for i in range(np.uint64(0), share, np.uint64(8)):
        prefetch(values, begin + i)


def gather(values, begin, stride, width, w, row, count):
    """Put entries of ``width`` numbers, ``stride`` apart, into as many rows, and zeros behind."""
    if stride == THREE and width == THREE:
        # Side by side and of a known width they are loaded as vectors and shuffled.
        for i in range(count):
            w[row + i] = values[begin + THREE * i]
            w[row + BLOCK + i] = values[begin + THREE * i + ONE]
            w[row + TWO * BLOCK + i] = values[begin + THREE * i + TWO]
    else:
        for k in range(width):
            for i in range(count):
                w[row + k * BLOCK + i] = values[begin + k + stride * i]
    for k in range(width):
        for i in range(count, BLOCK):
            w[row + k * BLOCK + i] = 0.0


def scatter(w, row, values, begin, stride, width, count):
    """The way back from rows to entries."""
    if stride == THREE and width == THREE:
        for i in range(count):
            values[begin + THREE * i] = w[row + i]
            values[begin + THREE * i + ONE] = w[row + BLOCK + i]
            values[begin + THREE * i + TWO] = w[row + TWO * BLOCK + i]
    else:
        for k in range(width):
            for i in range(count):
                values[begin + k + stride * i] = w[row + k * BLOCK + i]


def first_below_zero(w, row, count):
    """Where a row is first negative or not a number; ``count`` if nowhere."""
    for i in range(count):
        if not w[row + i] >= 0.0:
            return i
    return count


def sincos(w, x, sine, cosine):
    """Sine and cosine of angles.

    The polynomials, also below, interpolate at Chebyshev's points and were computed in 60 digits.
    """
    beyond = 0
    for i in range(BLOCK):
        angle = abs(w[x + i])
        beyond |= 0 if angle <= LARGEST_ANGLE else 1
        shifted = angle * 0.6366197723675814 + ROUNDING
        quarter = np.float64(shifted).view(np.int64)
        turns = shifted - ROUNDING
        # A quarter turn in three parts, so that nothing is lost where the angle is near a multiple.
        r = angle - turns * 1.5707963267341256 - turns * 6.077100506303966e-11
        r = r - turns * 2.0222662487959506e-21
        z = r * r
        s = -2.5051092507061385e-08 + z * 1.59153232122714e-10
        s = 0.0083333333333307 + z * (-0.00019841269836387345 + z * (2.755731591191116e-06 + z * s))
        s = r + r * z * (-0.16666666666666666 + z * s)
        c = 2.087612165887116e-09 + z * -1.1380876948169717e-11
        c = 2.4801587298533456e-05 + z * (-2.755731715246704e-07 + z * c)
        c = 0.041666666666666664 + z * (-0.0013888888888887241 + z * c)
        c = 1.0 - (0.5 * z - z * z * c)
        odd = quarter & 1
        near = np.float64(c if odd else s).view(np.int64)
        far = np.float64(s if odd else c).view(np.int64)
        minus = np.float64(w[x + i]).view(np.int64) & SIGN
        w[sine + i] = np.int64(near ^ minus ^ ((quarter & 2) << 62)).view(np.float64)
        w[cosine + i] = np.int64(far ^ (((quarter + 1) & 2) << 62)).view(np.float64)
    if beyond:
        for i in range(BLOCK):
            w[sine + i] = math.sin(w[x + i])
            w[cosine + i] = math.cos(w[x + i])


def arctan2(w, y, x, angle):
    """Angle of the vectors (x, y)."""
    beyond = 0
    for i in range(BLOCK):
        across, along = abs(w[y + i]), abs(w[x + i])
        beyond |= 0 if along <= LARGEST_SIDE else 1
        beyond |= 0 if across <= LARGEST_SIDE else 1
        steep = across > along
        short, long = (along, across) if steep else (across, along)
        # Beyond an eighth of a half turn, the angle to the diagonal is the smaller one.
        diagonal = short > 0.41421356237309503 * long
        top = short - long if diagonal else short
        bottom = short + long if diagonal else long
        t = top / (bottom if bottom != 0.0 else 1.0)
        z = t * t
        p = 0.03911053674347613 + z * -0.019029290809743138
        p = 0.058573396761385246 + z * (-0.05081236164642543 + z * p)
        p = 0.07692176510795928 + z * (-0.06664417824186955 + z * p)
        p = 0.11111111008107874 + z * (-0.09090904289128517 + z * p)
        p = 0.1999999999999509 + z * (-0.14285714284577217 + z * p)
        # What pi / 4 and its multiples lose in rounding is added to the small part.
        lost = 3.061616997868383e-17 if diagonal else 0.0
        a = t + (t * z * (-0.3333333333333333 + z * p) + lost)
        a = a + (0.7853981633974483 if diagonal else 0.0)
        a = 1.5707963267948966 - (a - 6.123233995736766e-17) if steep else a
        behind = math.copysign(1.0, w[x + i]) < 0.0
        a = 3.141592653589793 - (a - 1.2246467991473532e-16) if behind else a
        w[angle + i] = math.copysign(a, w[y + i])
    if beyond:
        for i in range(BLOCK):
            w[angle + i] = math.atan2(w[y + i], w[x + i])
