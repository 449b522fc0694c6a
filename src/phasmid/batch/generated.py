"""What numba compiles. Made by ``python -m phasmid.batch.generate``; do not edit.

All of it is in one file, since numba's cache looks at the file of the outermost function alone.
How it is compiled counts as well: SHA-256 of compiled.py is
1e88e322c70d0c0ff189ef04c842352fe2f4546642e63ef7e1a88e1ab50a955a.
"""

# ruff: noqa: ARG001, D103, E501
# fmt: off
# mypy: ignore-errors

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

(R0, R1, R2, R3, R4, R5, R6, R7, R8, R9, R10, R11, R12, R13, R14, R15, R16, R17, R18, R19, R20, R21, R22, R23, R24, R25, R26, R27, R28, R29, R30, R31, R32, R33, R34, R35, R36, R37, R38, R39, R40, R41, R42, R43, R44, R45, R46, R47, R48, R49, R50, R51, R52, R53, R54, R55, R56, R57, R58, R59) = (
    np.uint64(i) * BLOCK for i in range(60)
)


def leg_torque_leg_coefficients(c):
    v0 = c[5] * c[10]
    v1 = c[5] * c[11]
    v2 = c[6] * c[13]
    v3 = c[6] * c[14]
    v4 = (c[4] * c[9]) * c[9]
    v5 = c[24] + ((((c[4] * c[7]) * c[7]) + ((c[4] * c[8]) * c[8])) + v4)
    v6 = v0 * c[10]
    v7 = v1 * c[11]
    v8 = (c[5] * c[12]) * c[12]
    v9 = (v6 + v7) + v8
    v10 = (c[25] + v9) - v6
    v11 = c[6] * (c[2] * c[2])
    v12 = ((c[29] + v9) - v7) + v11
    v13 = c[26] - (v0 * c[11])
    v14 = v2 * c[13]
    v15 = v3 * c[14]
    v16 = c[6] * c[15]
    v17 = v16 * c[15]
    v18 = (v14 + v15) + v17
    v19 = (c[34] + v18) - v14
    v20 = (c[38] + v18) - v15
    v21 = c[35] - (v2 * c[14])
    return [
        v0 + (c[6] * c[2]),
        v1,
        c[1],
        c[2],
        v2,
        v3,
        (v5 - v4) + ((c[5] + c[6]) * (c[1] * c[1])),
        v10,
        v12,
        2.0 * v13,
        v19,
        v20,
        2.0 * v21,
        (c[27] - (v0 * c[12])) - (c[2] * v16),
        c[30] - (v1 * c[12]),
        c[36] - (v2 * c[15]),
        c[39] - (v3 * c[15]),
        v10 - v12,
        v13,
        v19 - v20,
        v21,
        ((c[33] + v9) - v8) + v11,
        c[0],
        (c[42] + v18) - v17,
    ]


def leg_torque_leg(k, w):
    k0 = k[0]
    k1 = k[1]
    k2 = k[2]
    k3 = k[3]
    k4 = k[4]
    k5 = k[5]
    k6 = k[6]
    k7 = k[7]
    k8 = k[8]
    k9 = k[9]
    k10 = k[10]
    k11 = k[11]
    k12 = k[12]
    k13 = k[13]
    k14 = k[14]
    k15 = k[15]
    k16 = k[16]
    k17 = k[17]
    k18 = k[18]
    k19 = k[19]
    k20 = k[20]
    k21 = k[21]
    k22 = k[22]
    k23 = k[23]
    for i in range(BLOCK):
        w[R12 + i] = w[R1 + i] + w[R2 + i]
    sincos(w, R1, R13, R14)
    sincos(w, R12, R15, R16)
    for i in range(BLOCK):
        v0 = (k0 * w[R14 + i]) - (k1 * w[R13 + i])
        v1 = k2 + (k3 * w[R14 + i])
        v2 = (k4 * w[R16 + i]) - (k5 * w[R15 + i])
        v3 = w[R13 + i] * w[R13 + i]
        v4 = w[R14 + i] * w[R14 + i]
        v5 = (k6 + (2.0 * ((k2 * v0) + (v1 * v2)))) + (((k7 * v3) + (k8 * v4)) + ((k9 * w[R13 + i]) * w[R14 + i]))
        v6 = w[R15 + i] * w[R15 + i]
        v7 = w[R16 + i] * w[R16 + i]
        v8 = ((k10 * v6) + (k11 * v7)) + ((k12 * w[R15 + i]) * w[R16 + i])
        v9 = (k13 * w[R13 + i]) + (k14 * w[R14 + i])
        v10 = (k15 * w[R15 + i]) + (k16 * w[R16 + i])
        v11 = w[R7 + i] + w[R8 + i]
        v12 = 2.0 * (((k17 * w[R13 + i]) * w[R14 + i]) + (k18 * (v4 - v3)))
        v13 = (k2 * ((k0 * w[R13 + i]) + (k1 * w[R14 + i]))) + ((k3 * w[R13 + i]) * v2)
        v14 = v12 - (2.0 * v13)
        v15 = 2.0 * (((k19 * w[R15 + i]) * w[R16 + i]) + (k20 * (v7 - v6)))
        v16 = v15 - ((2.0 * v1) * ((k4 * w[R15 + i]) + (k5 * w[R16 + i])))
        v17 = w[R4 + i] + w[R5 + i]
        v18 = ((((v5 + v8) * w[R6 + i]) + (v9 * w[R7 + i])) + (v10 * v11)) + (w[R3 + i] * ((v14 * w[R4 + i]) + (v16 * v17)))
        v19 = w[R4 + i] * w[R4 + i]
        v20 = v17 * v17
        v21 = (((k13 * w[R14 + i]) - (k14 * w[R13 + i])) * v19) + (((k15 * w[R16 + i]) - (k16 * w[R15 + i])) * v20)
        v22 = (w[R16 + i] * w[R14 + i]) + (w[R15 + i] * w[R13 + i])
        v23 = (w[R15 + i] * w[R14 + i]) - (w[R16 + i] * w[R13 + i])
        v24 = k3 * ((k4 * v22) - (k5 * v23))
        v25 = (((v9 * w[R6 + i]) + (k21 * w[R7 + i])) + (v24 * v11)) + (k22 * v0)
        v26 = k3 * ((k4 * v23) + (k5 * v22))
        v27 = w[R3 + i] * w[R3 + i]
        v28 = (((v10 * w[R6 + i]) + (v24 * w[R7 + i])) + (k23 * v11)) + (k22 * v2)
        v29 = v28 - (((v16 * v27) * 0.5) - (v26 * v19))
        w[R9 + i] = v18 + v21
        w[R10 + i] = (v25 + ((-(v26 * v20)) - ((v14 * v27) * 0.5))) + v29
        w[R11 + i] = v29


def leg_torque(k_legs, q, q_stride, qd, qd_stride, qdd, qdd_stride, torque, torque_stride, start, stop):
    w = np.empty(17 * np.int64(BLOCK))
    legs = np.uint64(k_legs.shape[0])
    missed = stop * legs
    for first in range(start, stop, BLOCK):
        count = min(BLOCK, stop - first)
        for leg in range(legs):
            gather(q, first * q_stride + leg * np.uint64(3), q_stride, np.uint64(3), w, R0, count)
            ahead(q, first, q_stride, leg, legs)
            gather(qd, first * qd_stride + leg * np.uint64(3), qd_stride, np.uint64(3), w, R3, count)
            ahead(qd, first, qd_stride, leg, legs)
            gather(qdd, first * qdd_stride + leg * np.uint64(3), qdd_stride, np.uint64(3), w, R6, count)
            ahead(qdd, first, qdd_stride, leg, legs)
            leg_torque_leg(k_legs[leg], w)
            scatter(w, R9, torque, first * torque_stride + leg * np.uint64(3), torque_stride, np.uint64(3), count)
            ahead(torque, first, torque_stride, leg, legs)
    return missed


def loaded_leg_torque_leg_coefficients(c):
    v0 = c[5] * c[10]
    v1 = c[5] * c[11]
    v2 = c[6] * c[13]
    v3 = c[6] * c[14]
    v4 = (c[4] * c[9]) * c[9]
    v5 = c[24] + ((((c[4] * c[7]) * c[7]) + ((c[4] * c[8]) * c[8])) + v4)
    v6 = v0 * c[10]
    v7 = v1 * c[11]
    v8 = (c[5] * c[12]) * c[12]
    v9 = (v6 + v7) + v8
    v10 = (c[25] + v9) - v6
    v11 = c[6] * (c[2] * c[2])
    v12 = ((c[29] + v9) - v7) + v11
    v13 = c[26] - (v0 * c[11])
    v14 = v2 * c[13]
    v15 = v3 * c[14]
    v16 = c[6] * c[15]
    v17 = v16 * c[15]
    v18 = (v14 + v15) + v17
    v19 = (c[34] + v18) - v14
    v20 = (c[38] + v18) - v15
    v21 = c[35] - (v2 * c[14])
    return [
        v0 + (c[6] * c[2]),
        v1,
        c[1],
        c[2],
        v2,
        v3,
        (v5 - v4) + ((c[5] + c[6]) * (c[1] * c[1])),
        v10,
        v12,
        2.0 * v13,
        v19,
        v20,
        2.0 * v21,
        (c[27] - (v0 * c[12])) - (c[2] * v16),
        c[30] - (v1 * c[12]),
        c[36] - (v2 * c[15]),
        c[39] - (v3 * c[15]),
        v10 - v12,
        v13,
        v19 - v20,
        v21,
        c[3],
        ((c[33] + v9) - v8) + v11,
        c[0],
        (c[42] + v18) - v17,
    ]


def loaded_leg_torque_leg(k, w):
    k0 = k[0]
    k1 = k[1]
    k2 = k[2]
    k3 = k[3]
    k4 = k[4]
    k5 = k[5]
    k6 = k[6]
    k7 = k[7]
    k8 = k[8]
    k9 = k[9]
    k10 = k[10]
    k11 = k[11]
    k12 = k[12]
    k13 = k[13]
    k14 = k[14]
    k15 = k[15]
    k16 = k[16]
    k17 = k[17]
    k18 = k[18]
    k19 = k[19]
    k20 = k[20]
    k21 = k[21]
    k22 = k[22]
    k23 = k[23]
    k24 = k[24]
    for i in range(BLOCK):
        w[R15 + i] = w[R1 + i] + w[R2 + i]
    sincos(w, R1, R16, R17)
    sincos(w, R15, R18, R19)
    sincos(w, R0, R20, R21)
    for i in range(BLOCK):
        v0 = (k0 * w[R17 + i]) - (k1 * w[R16 + i])
        v1 = k3 * w[R17 + i]
        v2 = k2 + v1
        v3 = (k4 * w[R19 + i]) - (k5 * w[R18 + i])
        v4 = w[R16 + i] * w[R16 + i]
        v5 = w[R17 + i] * w[R17 + i]
        v6 = (k6 + (2.0 * ((k2 * v0) + (v2 * v3)))) + (((k7 * v4) + (k8 * v5)) + ((k9 * w[R16 + i]) * w[R17 + i]))
        v7 = w[R18 + i] * w[R18 + i]
        v8 = w[R19 + i] * w[R19 + i]
        v9 = ((k10 * v7) + (k11 * v8)) + ((k12 * w[R18 + i]) * w[R19 + i])
        v10 = (k13 * w[R16 + i]) + (k14 * w[R17 + i])
        v11 = (k15 * w[R18 + i]) + (k16 * w[R19 + i])
        v12 = w[R7 + i] + w[R8 + i]
        v13 = 2.0 * (((k17 * w[R16 + i]) * w[R17 + i]) + (k18 * (v5 - v4)))
        v14 = k3 * w[R16 + i]
        v15 = 2.0 * ((k2 * ((k0 * w[R16 + i]) + (k1 * w[R17 + i]))) + (v14 * v3))
        v16 = v13 - v15
        v17 = 2.0 * (((k19 * w[R18 + i]) * w[R19 + i]) + (k20 * (v8 - v7)))
        v18 = v17 - ((2.0 * v2) * ((k4 * w[R18 + i]) + (k5 * w[R19 + i])))
        v19 = w[R4 + i] + w[R5 + i]
        v20 = ((((v6 + v9) * w[R6 + i]) + (v10 * w[R7 + i])) + (v11 * v12)) + (w[R3 + i] * ((v16 * w[R4 + i]) + (v18 * v19)))
        v21 = w[R4 + i] * w[R4 + i]
        v22 = v19 * v19
        v23 = (((k13 * w[R17 + i]) - (k14 * w[R16 + i])) * v21) + (((k15 * w[R19 + i]) - (k16 * w[R18 + i])) * v22)
        v24 = k21 * w[R19 + i]
        v25 = v1 + v24
        v26 = k2 + v25
        v27 = ((v26 * w[R21 + i]) * w[R10 + i]) - ((v26 * w[R20 + i]) * w[R9 + i])
        v28 = (w[R19 + i] * w[R17 + i]) + (w[R18 + i] * w[R16 + i])
        v29 = (w[R18 + i] * w[R17 + i]) - (w[R19 + i] * w[R16 + i])
        v30 = k3 * ((k4 * v28) - (k5 * v29))
        v31 = (((v10 * w[R6 + i]) + (k22 * w[R7 + i])) + (v30 * v12)) + (k23 * v0)
        v32 = k3 * ((k4 * v29) + (k5 * v28))
        v33 = w[R3 + i] * w[R3 + i]
        v34 = (((v11 * w[R6 + i]) + (v30 * w[R7 + i])) + (k24 * v12)) + (k23 * v3)
        v35 = v34 - (((v18 * v33) * 0.5) - (v32 * v21))
        v36 = k21 * w[R18 + i]
        v37 = v14 + v36
        v38 = (-((v37 * w[R21 + i]) * w[R9 + i])) - ((v37 * w[R20 + i]) * w[R10 + i])
        v39 = ((v31 + ((-(v32 * v22)) - ((v16 * v33) * 0.5))) + v35) - (v38 + (v25 * w[R11 + i]))
        v40 = (-((v36 * w[R21 + i]) * w[R9 + i])) - ((v36 * w[R20 + i]) * w[R10 + i])
        w[R12 + i] = (v20 + v23) - v27
        w[R13 + i] = v39
        w[R14 + i] = v35 - (v40 + (v24 * w[R11 + i]))


def loaded_leg_torque(k_legs, q, q_stride, qd, qd_stride, qdd, qdd_stride, foot_force, foot_force_stride, torque, torque_stride, start, stop):
    w = np.empty(22 * np.int64(BLOCK))
    legs = np.uint64(k_legs.shape[0])
    missed = stop * legs
    for first in range(start, stop, BLOCK):
        count = min(BLOCK, stop - first)
        for leg in range(legs):
            gather(q, first * q_stride + leg * np.uint64(3), q_stride, np.uint64(3), w, R0, count)
            ahead(q, first, q_stride, leg, legs)
            gather(qd, first * qd_stride + leg * np.uint64(3), qd_stride, np.uint64(3), w, R3, count)
            ahead(qd, first, qd_stride, leg, legs)
            gather(qdd, first * qdd_stride + leg * np.uint64(3), qdd_stride, np.uint64(3), w, R6, count)
            ahead(qdd, first, qdd_stride, leg, legs)
            gather(foot_force, first * foot_force_stride + leg * np.uint64(3), foot_force_stride, np.uint64(3), w, R9, count)
            ahead(foot_force, first, foot_force_stride, leg, legs)
            loaded_leg_torque_leg(k_legs[leg], w)
            scatter(w, R12, torque, first * torque_stride + leg * np.uint64(3), torque_stride, np.uint64(3), count)
            ahead(torque, first, torque_stride, leg, legs)
    return missed


def foot_position_leg_coefficients(c):
    return [
        c[1],
        c[0],
        c[2],
    ]


def foot_position_leg(k, w):
    k0 = k[0]
    k1 = k[1]
    k2 = k[2]
    for i in range(BLOCK):
        w[R6 + i] = w[R1 + i] + w[R2 + i]
    sincos(w, R1, R7, R8)
    sincos(w, R6, R9, R10)
    sincos(w, R0, R11, R12)
    for i in range(BLOCK):
        v0 = (k1 + (k0 * w[R8 + i])) + (k2 * w[R10 + i])
        w[R3 + i] = v0 * w[R12 + i]
        w[R4 + i] = v0 * w[R11 + i]
        w[R5 + i] = (k0 * w[R7 + i]) + (k2 * w[R9 + i])


def foot_position(k_legs, q, q_stride, p_hip_foot, p_hip_foot_stride, start, stop):
    w = np.empty(13 * np.int64(BLOCK))
    legs = np.uint64(k_legs.shape[0])
    missed = stop * legs
    for first in range(start, stop, BLOCK):
        count = min(BLOCK, stop - first)
        for leg in range(legs):
            gather(q, first * q_stride + leg * np.uint64(3), q_stride, np.uint64(3), w, R0, count)
            ahead(q, first, q_stride, leg, legs)
            foot_position_leg(k_legs[leg], w)
            scatter(w, R3, p_hip_foot, first * p_hip_foot_stride + leg * np.uint64(3), p_hip_foot_stride, np.uint64(3), count)
            ahead(p_hip_foot, first, p_hip_foot_stride, leg, legs)
    return missed


def joint_angles_leg_coefficients(c):
    v0 = c[1] + c[2]
    v1 = c[1] - c[2]
    v2 = v0 * v0
    v3 = v1 * v1
    v4 = 1e-12 * v2
    return [
        c[0],
        v0 * v1,
        v2,
        v3,
        v2 + v4,
        v3 - v4,
    ]


def joint_angles_leg(k, w):
    k0 = k[0]
    k1 = k[1]
    k2 = k[2]
    k3 = k[3]
    k4 = k[4]
    k5 = k[5]
    for i in range(BLOCK):
        v0 = math.sqrt((w[R0 + i] * w[R0 + i]) + (w[R1 + i] * w[R1 + i])) - k0
        v1 = (v0 * v0) + (w[R2 + i] * w[R2 + i])
        v2 = math.sqrt(max(k2 - v1, 0.0))
        v3 = math.sqrt(max(v1 - k3, 0.0))
        v4 = v1 + k1
        v5 = v2 * v3
        w[R6 + i] = min(k4 - v1, v1 - k5)
        w[R7 + i] = v2
        w[R8 + i] = v3
        w[R9 + i] = (w[R2 + i] * v4) + (v0 * v5)
        w[R10 + i] = (v0 * v4) - (w[R2 + i] * v5)
    arctan2(w, R1, R0, R11)
    arctan2(w, R9, R10, R12)
    arctan2(w, R7, R8, R13)
    for i in range(BLOCK):
        w[R3 + i] = w[R11 + i]
        w[R4 + i] = w[R12 + i]
        w[R5 + i] = -2.0 * w[R13 + i]


def joint_angles(k_legs, p_hip_foot, p_hip_foot_stride, q, q_stride, start, stop):
    w = np.empty(14 * np.int64(BLOCK))
    legs = np.uint64(k_legs.shape[0])
    missed = stop * legs
    for first in range(start, stop, BLOCK):
        count = min(BLOCK, stop - first)
        for leg in range(legs):
            gather(p_hip_foot, first * p_hip_foot_stride + leg * np.uint64(3), p_hip_foot_stride, np.uint64(3), w, R0, count)
            ahead(p_hip_foot, first, p_hip_foot_stride, leg, legs)
            joint_angles_leg(k_legs[leg], w)
            scatter(w, R3, q, first * q_stride + leg * np.uint64(3), q_stride, np.uint64(3), count)
            ahead(q, first, q_stride, leg, legs)
            at = first_below_zero(w, R6, count)
            if at < count:
                missed = min(missed, (first + at) * legs + leg)
        if missed < stop * legs:
            return missed
    return missed


def jacobian_leg_coefficients(c):
    return [
        c[1],
        c[2],
        c[0],
    ]


def jacobian_leg(k, w):
    k0 = k[0]
    k1 = k[1]
    k2 = k[2]
    for i in range(BLOCK):
        w[R9 + i] = 0.0
        w[R12 + i] = w[R1 + i] + w[R2 + i]
    sincos(w, R1, R13, R14)
    sincos(w, R12, R15, R16)
    sincos(w, R0, R17, R18)
    for i in range(BLOCK):
        v0 = k1 * w[R16 + i]
        v1 = (k0 * w[R14 + i]) + v0
        v2 = k2 + v1
        v3 = k1 * w[R15 + i]
        v4 = (k0 * w[R13 + i]) + v3
        w[R3 + i] = -(v2 * w[R17 + i])
        w[R4 + i] = -(v4 * w[R18 + i])
        w[R5 + i] = -(v3 * w[R18 + i])
        w[R6 + i] = v2 * w[R18 + i]
        w[R7 + i] = -(v4 * w[R17 + i])
        w[R8 + i] = -(v3 * w[R17 + i])
        w[R10 + i] = v1
        w[R11 + i] = v0


def jacobian(k_legs, q, q_stride, J, J_stride, start, stop):
    w = np.empty(19 * np.int64(BLOCK))
    legs = np.uint64(k_legs.shape[0])
    missed = stop * legs
    for first in range(start, stop, BLOCK):
        count = min(BLOCK, stop - first)
        for leg in range(legs):
            gather(q, first * q_stride + leg * np.uint64(3), q_stride, np.uint64(3), w, R0, count)
            ahead(q, first, q_stride, leg, legs)
            jacobian_leg(k_legs[leg], w)
            scatter(w, R3, J, first * J_stride + leg * np.uint64(9), J_stride, np.uint64(9), count)
            ahead(J, first, J_stride, leg, legs)
    return missed


def tilted_leg_torque_leg_coefficients(c):
    v0 = c[7] * c[12]
    v1 = c[7] * c[13]
    v2 = c[8] * c[15]
    v3 = c[8] * c[16]
    v4 = c[6] * c[9]
    v5 = c[6] * c[10]
    v6 = (c[6] * c[11]) * c[11]
    v7 = c[7] + c[8]
    v8 = ((c[26] + (((v4 * c[9]) + (v5 * c[10])) + v6)) - v6) + (v7 * (c[3] * c[3]))
    v9 = v0 * c[12]
    v10 = v1 * c[13]
    v11 = c[7] * c[14]
    v12 = v11 * c[14]
    v13 = (v9 + v10) + v12
    v14 = (c[27] + v13) - v9
    v15 = c[8] * (c[4] * c[4])
    v16 = ((c[31] + v13) - v10) + v15
    v17 = c[28] - (v0 * c[13])
    v18 = v2 * c[15]
    v19 = v3 * c[16]
    v20 = c[8] * c[17]
    v21 = v20 * c[17]
    v22 = (v18 + v19) + v21
    v23 = (c[36] + v22) - v18
    v24 = (c[40] + v22) - v19
    v25 = c[37] - (v2 * c[16])
    return [
        v0 + (c[8] * c[4]),
        v1,
        c[3],
        c[4],
        v2,
        v3,
        v8,
        v14,
        v16,
        2.0 * v17,
        v23,
        v24,
        2.0 * v25,
        (c[29] - (v0 * c[14])) - (c[4] * v20),
        c[32] - (v1 * c[14]),
        c[38] - (v2 * c[17]),
        c[41] - (v3 * c[17]),
        v14 - v16,
        v17,
        v23 - v24,
        v25,
        c[1],
        c[0],
        v4 + (v7 * c[3]),
        (v5 - v11) - v20,
        ((c[35] + v13) - v12) + v15,
        c[2],
        (c[44] + v22) - v21,
    ]


def tilted_leg_torque_leg(k, w):
    k0 = k[0]
    k1 = k[1]
    k2 = k[2]
    k3 = k[3]
    k4 = k[4]
    k5 = k[5]
    k6 = k[6]
    k7 = k[7]
    k8 = k[8]
    k9 = k[9]
    k10 = k[10]
    k11 = k[11]
    k12 = k[12]
    k13 = k[13]
    k14 = k[14]
    k15 = k[15]
    k16 = k[16]
    k17 = k[17]
    k18 = k[18]
    k19 = k[19]
    k20 = k[20]
    k21 = k[21]
    k22 = k[22]
    k23 = k[23]
    k24 = k[24]
    k25 = k[25]
    k26 = k[26]
    k27 = k[27]
    for i in range(BLOCK):
        w[R12 + i] = w[R1 + i] + w[R2 + i]
    sincos(w, R1, R13, R14)
    sincos(w, R12, R15, R16)
    sincos(w, R0, R17, R18)
    for i in range(BLOCK):
        v0 = (k0 * w[R14 + i]) - (k1 * w[R13 + i])
        v1 = k2 + (k3 * w[R14 + i])
        v2 = (k4 * w[R16 + i]) - (k5 * w[R15 + i])
        v3 = w[R13 + i] * w[R13 + i]
        v4 = w[R14 + i] * w[R14 + i]
        v5 = (k6 + (2.0 * ((k2 * v0) + (v1 * v2)))) + (((k7 * v3) + (k8 * v4)) + ((k9 * w[R13 + i]) * w[R14 + i]))
        v6 = w[R15 + i] * w[R15 + i]
        v7 = w[R16 + i] * w[R16 + i]
        v8 = ((k10 * v6) + (k11 * v7)) + ((k12 * w[R15 + i]) * w[R16 + i])
        v9 = (k13 * w[R13 + i]) + (k14 * w[R14 + i])
        v10 = (k15 * w[R15 + i]) + (k16 * w[R16 + i])
        v11 = w[R7 + i] + w[R8 + i]
        v12 = 2.0 * (((k17 * w[R13 + i]) * w[R14 + i]) + (k18 * (v4 - v3)))
        v13 = (k0 * w[R13 + i]) + (k1 * w[R14 + i])
        v14 = v12 - (2.0 * ((k2 * v13) + ((k3 * w[R13 + i]) * v2)))
        v15 = 2.0 * (((k19 * w[R15 + i]) * w[R16 + i]) + (k20 * (v7 - v6)))
        v16 = (k4 * w[R15 + i]) + (k5 * w[R16 + i])
        v17 = v15 - ((2.0 * v1) * v16)
        v18 = w[R4 + i] + w[R5 + i]
        v19 = ((((v5 + v8) * w[R6 + i]) + (v9 * w[R7 + i])) + (v10 * v11)) + (w[R3 + i] * ((v14 * w[R4 + i]) + (v17 * v18)))
        v20 = w[R4 + i] * w[R4 + i]
        v21 = v18 * v18
        v22 = (((k13 * w[R14 + i]) - (k14 * w[R13 + i])) * v20) + (((k15 * w[R16 + i]) - (k16 * w[R15 + i])) * v21)
        v23 = ((k21 * w[R18 + i]) - (k22 * w[R17 + i])) * ((k23 + v0) + v2)
        v24 = (k22 * w[R18 + i]) + (k21 * w[R17 + i])
        v25 = (w[R16 + i] * w[R14 + i]) + (w[R15 + i] * w[R13 + i])
        v26 = (w[R15 + i] * w[R14 + i]) - (w[R16 + i] * w[R13 + i])
        v27 = k3 * ((k4 * v25) - (k5 * v26))
        v28 = (((v9 * w[R6 + i]) + (k25 * w[R7 + i])) + (v27 * v11)) + ((k26 * v0) - (v24 * v13))
        v29 = k3 * ((k4 * v26) + (k5 * v25))
        v30 = w[R3 + i] * w[R3 + i]
        v31 = (((v10 * w[R6 + i]) + (v27 * w[R7 + i])) + (k27 * v11)) + ((k26 * v2) - (v24 * v16))
        v32 = v31 - (((v17 * v30) * 0.5) - (v29 * v20))
        w[R9 + i] = v19 + (v22 + (v23 - (v24 * k24)))
        w[R10 + i] = (v28 + ((-(v29 * v21)) - ((v14 * v30) * 0.5))) + v32
        w[R11 + i] = v32


def tilted_leg_torque(k_legs, q, q_stride, qd, qd_stride, qdd, qdd_stride, torque, torque_stride, start, stop):
    w = np.empty(19 * np.int64(BLOCK))
    legs = np.uint64(k_legs.shape[0])
    missed = stop * legs
    for first in range(start, stop, BLOCK):
        count = min(BLOCK, stop - first)
        for leg in range(legs):
            gather(q, first * q_stride + leg * np.uint64(3), q_stride, np.uint64(3), w, R0, count)
            ahead(q, first, q_stride, leg, legs)
            gather(qd, first * qd_stride + leg * np.uint64(3), qd_stride, np.uint64(3), w, R3, count)
            ahead(qd, first, qd_stride, leg, legs)
            gather(qdd, first * qdd_stride + leg * np.uint64(3), qdd_stride, np.uint64(3), w, R6, count)
            ahead(qdd, first, qdd_stride, leg, legs)
            tilted_leg_torque_leg(k_legs[leg], w)
            scatter(w, R9, torque, first * torque_stride + leg * np.uint64(3), torque_stride, np.uint64(3), count)
            ahead(torque, first, torque_stride, leg, legs)
    return missed


def tilted_loaded_leg_torque_leg_coefficients(c):
    v0 = c[7] * c[12]
    v1 = c[7] * c[13]
    v2 = c[8] * c[15]
    v3 = c[8] * c[16]
    v4 = c[6] * c[9]
    v5 = c[6] * c[10]
    v6 = (c[6] * c[11]) * c[11]
    v7 = c[7] + c[8]
    v8 = ((c[26] + (((v4 * c[9]) + (v5 * c[10])) + v6)) - v6) + (v7 * (c[3] * c[3]))
    v9 = v0 * c[12]
    v10 = v1 * c[13]
    v11 = c[7] * c[14]
    v12 = v11 * c[14]
    v13 = (v9 + v10) + v12
    v14 = (c[27] + v13) - v9
    v15 = c[8] * (c[4] * c[4])
    v16 = ((c[31] + v13) - v10) + v15
    v17 = c[28] - (v0 * c[13])
    v18 = v2 * c[15]
    v19 = v3 * c[16]
    v20 = c[8] * c[17]
    v21 = v20 * c[17]
    v22 = (v18 + v19) + v21
    v23 = (c[36] + v22) - v18
    v24 = (c[40] + v22) - v19
    v25 = c[37] - (v2 * c[16])
    return [
        v0 + (c[8] * c[4]),
        v1,
        c[3],
        c[4],
        v2,
        v3,
        v8,
        v14,
        v16,
        2.0 * v17,
        v23,
        v24,
        2.0 * v25,
        (c[29] - (v0 * c[14])) - (c[4] * v20),
        c[32] - (v1 * c[14]),
        c[38] - (v2 * c[17]),
        c[41] - (v3 * c[17]),
        v14 - v16,
        v17,
        v23 - v24,
        v25,
        c[1],
        c[0],
        v4 + (v7 * c[3]),
        (v5 - v11) - v20,
        c[5],
        ((c[35] + v13) - v12) + v15,
        c[2],
        (c[44] + v22) - v21,
    ]


def tilted_loaded_leg_torque_leg(k, w):
    k0 = k[0]
    k1 = k[1]
    k2 = k[2]
    k3 = k[3]
    k4 = k[4]
    k5 = k[5]
    k6 = k[6]
    k7 = k[7]
    k8 = k[8]
    k9 = k[9]
    k10 = k[10]
    k11 = k[11]
    k12 = k[12]
    k13 = k[13]
    k14 = k[14]
    k15 = k[15]
    k16 = k[16]
    k17 = k[17]
    k18 = k[18]
    k19 = k[19]
    k20 = k[20]
    k21 = k[21]
    k22 = k[22]
    k23 = k[23]
    k24 = k[24]
    k25 = k[25]
    k26 = k[26]
    k27 = k[27]
    k28 = k[28]
    for i in range(BLOCK):
        w[R15 + i] = w[R1 + i] + w[R2 + i]
    sincos(w, R1, R16, R17)
    sincos(w, R15, R18, R19)
    sincos(w, R0, R20, R21)
    for i in range(BLOCK):
        v0 = (k0 * w[R17 + i]) - (k1 * w[R16 + i])
        v1 = k3 * w[R17 + i]
        v2 = k2 + v1
        v3 = (k4 * w[R19 + i]) - (k5 * w[R18 + i])
        v4 = w[R16 + i] * w[R16 + i]
        v5 = w[R17 + i] * w[R17 + i]
        v6 = (k6 + (2.0 * ((k2 * v0) + (v2 * v3)))) + (((k7 * v4) + (k8 * v5)) + ((k9 * w[R16 + i]) * w[R17 + i]))
        v7 = w[R18 + i] * w[R18 + i]
        v8 = w[R19 + i] * w[R19 + i]
        v9 = ((k10 * v7) + (k11 * v8)) + ((k12 * w[R18 + i]) * w[R19 + i])
        v10 = (k13 * w[R16 + i]) + (k14 * w[R17 + i])
        v11 = (k15 * w[R18 + i]) + (k16 * w[R19 + i])
        v12 = w[R7 + i] + w[R8 + i]
        v13 = 2.0 * (((k17 * w[R16 + i]) * w[R17 + i]) + (k18 * (v5 - v4)))
        v14 = (k0 * w[R16 + i]) + (k1 * w[R17 + i])
        v15 = k3 * w[R16 + i]
        v16 = v13 - (2.0 * ((k2 * v14) + (v15 * v3)))
        v17 = 2.0 * (((k19 * w[R18 + i]) * w[R19 + i]) + (k20 * (v8 - v7)))
        v18 = (k4 * w[R18 + i]) + (k5 * w[R19 + i])
        v19 = v17 - ((2.0 * v2) * v18)
        v20 = w[R4 + i] + w[R5 + i]
        v21 = ((((v6 + v9) * w[R6 + i]) + (v10 * w[R7 + i])) + (v11 * v12)) + (w[R3 + i] * ((v16 * w[R4 + i]) + (v19 * v20)))
        v22 = w[R4 + i] * w[R4 + i]
        v23 = v20 * v20
        v24 = (((k13 * w[R17 + i]) - (k14 * w[R16 + i])) * v22) + (((k15 * w[R19 + i]) - (k16 * w[R18 + i])) * v23)
        v25 = ((k21 * w[R21 + i]) - (k22 * w[R20 + i])) * ((k23 + v0) + v3)
        v26 = (k22 * w[R21 + i]) + (k21 * w[R20 + i])
        v27 = k25 * w[R19 + i]
        v28 = v1 + v27
        v29 = k2 + v28
        v30 = ((v29 * w[R21 + i]) * w[R10 + i]) - ((v29 * w[R20 + i]) * w[R9 + i])
        v31 = (w[R19 + i] * w[R17 + i]) + (w[R18 + i] * w[R16 + i])
        v32 = (w[R18 + i] * w[R17 + i]) - (w[R19 + i] * w[R16 + i])
        v33 = k3 * ((k4 * v31) - (k5 * v32))
        v34 = (((v10 * w[R6 + i]) + (k26 * w[R7 + i])) + (v33 * v12)) + ((k27 * v0) - (v26 * v14))
        v35 = k3 * ((k4 * v32) + (k5 * v31))
        v36 = w[R3 + i] * w[R3 + i]
        v37 = (((v11 * w[R6 + i]) + (v33 * w[R7 + i])) + (k28 * v12)) + ((k27 * v3) - (v26 * v18))
        v38 = v37 - (((v19 * v36) * 0.5) - (v35 * v22))
        v39 = k25 * w[R18 + i]
        v40 = v15 + v39
        v41 = (-((v40 * w[R21 + i]) * w[R9 + i])) - ((v40 * w[R20 + i]) * w[R10 + i])
        v42 = ((v34 + ((-(v35 * v23)) - ((v16 * v36) * 0.5))) + v38) - (v41 + (v28 * w[R11 + i]))
        v43 = (-((v39 * w[R21 + i]) * w[R9 + i])) - ((v39 * w[R20 + i]) * w[R10 + i])
        w[R12 + i] = (v21 + (v24 + (v25 - (v26 * k24)))) - v30
        w[R13 + i] = v42
        w[R14 + i] = v38 - (v43 + (v27 * w[R11 + i]))


def tilted_loaded_leg_torque(k_legs, q, q_stride, qd, qd_stride, qdd, qdd_stride, foot_force, foot_force_stride, torque, torque_stride, start, stop):
    w = np.empty(22 * np.int64(BLOCK))
    legs = np.uint64(k_legs.shape[0])
    missed = stop * legs
    for first in range(start, stop, BLOCK):
        count = min(BLOCK, stop - first)
        for leg in range(legs):
            gather(q, first * q_stride + leg * np.uint64(3), q_stride, np.uint64(3), w, R0, count)
            ahead(q, first, q_stride, leg, legs)
            gather(qd, first * qd_stride + leg * np.uint64(3), qd_stride, np.uint64(3), w, R3, count)
            ahead(qd, first, qd_stride, leg, legs)
            gather(qdd, first * qdd_stride + leg * np.uint64(3), qdd_stride, np.uint64(3), w, R6, count)
            ahead(qdd, first, qdd_stride, leg, legs)
            gather(foot_force, first * foot_force_stride + leg * np.uint64(3), foot_force_stride, np.uint64(3), w, R9, count)
            ahead(foot_force, first, foot_force_stride, leg, legs)
            tilted_loaded_leg_torque_leg(k_legs[leg], w)
            scatter(w, R12, torque, first * torque_stride + leg * np.uint64(3), torque_stride, np.uint64(3), count)
            ahead(torque, first, torque_stride, leg, legs)
    return missed


def inverse_dynamics_before_coefficients(c):
    v0 = c[1] * c[4]
    v1 = c[1] * c[3]
    v2 = c[1] * c[2]
    v3 = v2 * c[2]
    v4 = v1 * c[3]
    v5 = v0 * c[4]
    v6 = (v3 + v4) + v5
    return [
        c[0],
        c[1],
        v0,
        v1,
        v2,
        (c[5] + v6) - v3,
        c[6] - (v2 * c[3]),
        c[7] - (v2 * c[4]),
        c[11] - (v0 * c[2]),
        c[12] - (v0 * c[3]),
        (c[13] + v6) - v5,
        c[8] - (v1 * c[2]),
        (c[9] + v6) - v4,
        c[10] - (v1 * c[4]),
    ]


def inverse_dynamics_before(k, w):
    k0 = k[0]
    k1 = k[1]
    k2 = k[2]
    k3 = k[3]
    k4 = k[4]
    k5 = k[5]
    k6 = k[6]
    k7 = k[7]
    k8 = k[8]
    k9 = k[9]
    k10 = k[10]
    k11 = k[11]
    k12 = k[12]
    k13 = k[13]
    for i in range(BLOCK):
        v0 = ((w[R0 + i] * w[R9 + i]) + (w[R3 + i] * w[R10 + i])) + (w[R6 + i] * w[R11 + i])
        v1 = ((w[R1 + i] * w[R9 + i]) + (w[R4 + i] * w[R10 + i])) + (w[R7 + i] * w[R11 + i])
        v2 = ((w[R2 + i] * w[R9 + i]) + (w[R5 + i] * w[R10 + i])) + (w[R8 + i] * w[R11 + i])
        v3 = ((w[R0 + i] * w[R12 + i]) + (w[R3 + i] * w[R13 + i])) + (w[R6 + i] * w[R14 + i])
        v4 = ((w[R1 + i] * w[R12 + i]) + (w[R4 + i] * w[R13 + i])) + (w[R7 + i] * w[R14 + i])
        v5 = ((w[R2 + i] * w[R12 + i]) + (w[R5 + i] * w[R13 + i])) + (w[R8 + i] * w[R14 + i])
        v6 = w[R17 + i] + k0
        v7 = ((w[R0 + i] * w[R15 + i]) + (w[R3 + i] * w[R16 + i])) + (w[R6 + i] * v6)
        v8 = ((w[R1 + i] * w[R15 + i]) + (w[R4 + i] * w[R16 + i])) + (w[R7 + i] * v6)
        v9 = ((w[R2 + i] * w[R15 + i]) + (w[R5 + i] * w[R16 + i])) + (w[R8 + i] * v6)
        v10 = (v0 * k3) - (v1 * k4)
        v11 = (v2 * k4) - (v0 * k2)
        v12 = (k1 * v7) + (((v4 * k2) - (v5 * k3)) + ((v1 * v10) - (v2 * v11)))
        v13 = (v1 * k2) - (v2 * k3)
        v14 = (k1 * v8) + (((v5 * k4) - (v3 * k2)) + ((v2 * v13) - (v0 * v10)))
        v15 = (k1 * v9) + (((v3 * k3) - (v4 * k4)) + ((v0 * v11) - (v1 * v13)))
        v16 = ((k8 * v0) + (k9 * v1)) + (k10 * v2)
        v17 = ((k11 * v0) + (k12 * v1)) + (k13 * v2)
        v18 = (((k5 * v3) + (k6 * v4)) + (k7 * v5)) + ((v1 * v16) - (v2 * v17))
        v19 = ((k5 * v0) + (k6 * v1)) + (k7 * v2)
        v20 = (((k11 * v3) + (k12 * v4)) + (k13 * v5)) + ((v2 * v19) - (v0 * v16))
        v21 = (((k8 * v3) + (k9 * v4)) + (k10 * v5)) + ((v0 * v17) - (v1 * v19))
        w[R18 + i] = v0
        w[R19 + i] = v1
        w[R20 + i] = v2
        w[R21 + i] = v3
        w[R22 + i] = v4
        w[R23 + i] = v5
        w[R24 + i] = v7
        w[R25 + i] = v8
        w[R26 + i] = v9
        w[R27 + i] = v12
        w[R28 + i] = v14
        w[R29 + i] = v15
        w[R30 + i] = v18 + ((k3 * v9) - (k2 * v8))
        w[R31 + i] = v20 + ((k2 * v7) - (k4 * v9))
        w[R32 + i] = v21 + ((k4 * v8) - (k3 * v7))


def inverse_dynamics_leg_coefficients(c):
    v0 = c[6] * c[13]
    v1 = v0 * c[13]
    v2 = c[6] * c[14]
    v3 = v2 * c[14]
    v4 = c[6] * c[15]
    v5 = v4 * c[15]
    v6 = (v1 + v3) + v5
    v7 = c[5] * c[10]
    v8 = v7 * c[10]
    v9 = c[5] * c[11]
    v10 = v9 * c[11]
    v11 = c[5] * c[12]
    v12 = v11 * c[12]
    v13 = (v8 + v10) + v12
    v14 = c[4] * c[9]
    v15 = c[4] * c[7]
    v16 = v15 * c[7]
    v17 = c[4] * c[8]
    v18 = v17 * c[8]
    v19 = v14 * c[9]
    v20 = (v16 + v18) + v19
    return [
        c[43],
        c[46],
        (c[34] + v6) - v1,
        c[35] - (v0 * c[14]),
        c[36] - (v0 * c[15]),
        c[40] - (v4 * c[13]),
        c[41] - (v4 * c[14]),
        (c[42] + v6) - v5,
        c[37] - (v2 * c[13]),
        (c[38] + v6) - v3,
        c[39] - (v2 * c[15]),
        c[2],
        c[52],
        c[54],
        c[53],
        c[1],
        v2,
        v4,
        v0,
        c[3],
        (c[25] + v13) - v8,
        c[26] - (v7 * c[11]),
        c[27] - (v7 * c[12]),
        c[31] - (v11 * c[10]),
        c[32] - (v11 * c[11]),
        (c[33] + v13) - v12,
        c[28] - (v9 * c[10]),
        (c[29] + v13) - v10,
        c[30] - (v9 * c[12]),
        v9,
        v11,
        c[6],
        v7,
        c[5],
        c[22] - (v14 * c[7]),
        c[23] - (v14 * c[8]),
        (c[24] + v20) - v19,
        c[19] - (v17 * c[7]),
        (c[20] + v20) - v18,
        c[21] - (v17 * c[9]),
        (c[16] + v20) - v16,
        c[17] - (v15 * c[8]),
        c[18] - (v15 * c[9]),
        v15,
        v17,
        c[4],
        v14,
    ]


def inverse_dynamics_leg(k, w):
    k0 = k[0]
    k1 = k[1]
    k2 = k[2]
    k3 = k[3]
    k4 = k[4]
    k5 = k[5]
    k6 = k[6]
    k7 = k[7]
    k8 = k[8]
    k9 = k[9]
    k10 = k[10]
    k11 = k[11]
    k12 = k[12]
    k13 = k[13]
    k14 = k[14]
    k15 = k[15]
    k16 = k[16]
    k17 = k[17]
    k18 = k[18]
    k19 = k[19]
    k20 = k[20]
    k21 = k[21]
    k22 = k[22]
    k23 = k[23]
    k24 = k[24]
    k25 = k[25]
    k26 = k[26]
    k27 = k[27]
    k28 = k[28]
    k29 = k[29]
    k30 = k[30]
    k31 = k[31]
    k32 = k[32]
    k33 = k[33]
    k34 = k[34]
    k35 = k[35]
    k36 = k[36]
    k37 = k[37]
    k38 = k[38]
    k39 = k[39]
    k40 = k[40]
    k41 = k[41]
    k42 = k[42]
    k43 = k[43]
    k44 = k[44]
    k45 = k[45]
    k46 = k[46]
    sincos(w, R40, R54, R55)
    sincos(w, R41, R56, R57)
    sincos(w, R39, R58, R59)
    for i in range(BLOCK):
        v0 = (k0 * w[R21 + i]) + (k1 * w[R22 + i])
        v1 = (k0 * w[R22 + i]) - (k1 * w[R21 + i])
        v2 = (k0 * w[R19 + i]) - (k1 * w[R18 + i])
        v3 = (k0 * w[R18 + i]) + (k1 * w[R19 + i])
        v4 = (w[R59 + i] * v2) - (w[R58 + i] * v3)
        v5 = ((w[R59 + i] * v0) + (w[R58 + i] * v1)) + (v4 * w[R42 + i])
        v6 = w[R23 + i] + w[R45 + i]
        v7 = w[R20 + i] + w[R42 + i]
        v8 = (w[R59 + i] * v3) + (w[R58 + i] * v2)
        v9 = (w[R55 + i] * v7) - (w[R54 + i] * v8)
        v10 = ((w[R55 + i] * v5) + (w[R54 + i] * v6)) + (v9 * w[R43 + i])
        v11 = (w[R55 + i] * v8) + (w[R54 + i] * v7)
        v12 = ((w[R55 + i] * v6) - (w[R54 + i] * v5)) - (v11 * w[R43 + i])
        v13 = (w[R57 + i] * v9) - (w[R56 + i] * v11)
        v14 = ((w[R57 + i] * v10) + (w[R56 + i] * v12)) + (v13 * w[R44 + i])
        v15 = (w[R57 + i] * v11) + (w[R56 + i] * v9)
        v16 = ((w[R57 + i] * v12) - (w[R56 + i] * v10)) - (v15 * w[R44 + i])
        v17 = ((w[R59 + i] * v1) - (w[R58 + i] * v0)) - (v8 * w[R42 + i])
        v18 = w[R46 + i] - v17
        v19 = v18 + w[R47 + i]
        v20 = w[R43 + i] - v4
        v21 = v20 + w[R44 + i]
        v22 = ((k5 * v15) + (k6 * v13)) + (k7 * v21)
        v23 = ((k8 * v15) + (k9 * v13)) + (k10 * v21)
        v24 = (((k2 * v14) + (k3 * v16)) + (k4 * v19)) + ((v13 * v22) - (v21 * v23))
        v25 = v20 * k11
        v26 = (w[R19 + i] * k13) - (w[R20 + i] * k14)
        v27 = (w[R18 + i] * k14) - (w[R19 + i] * k12)
        v28 = ((w[R23 + i] * k12) - (w[R21 + i] * k13)) + ((w[R20 + i] * v26) - (w[R18 + i] * v27))
        v29 = w[R25 + i] + v28
        v30 = (w[R20 + i] * k12) - (w[R18 + i] * k13)
        v31 = ((w[R22 + i] * k13) - (w[R23 + i] * k14)) + ((w[R19 + i] * v27) - (w[R20 + i] * v30))
        v32 = w[R24 + i] + v31
        v33 = (k0 * v29) - (k1 * v32)
        v34 = (k0 * v32) + (k1 * v29)
        v35 = (w[R59 + i] * v33) - (w[R58 + i] * v34)
        v36 = v4 * k15
        v37 = v35 + ((v6 * k15) + (v36 * v8))
        v38 = ((v11 * v25) - (v12 * k11)) - v37
        v39 = ((w[R21 + i] * k14) - (w[R22 + i] * k12)) + ((w[R18 + i] * v30) - (w[R19 + i] * v26))
        v40 = w[R26 + i] + v39
        v41 = v7 * k15
        v42 = v40 + ((v8 * v41) - (v17 * k15))
        v43 = (w[R59 + i] * v34) + (w[R58 + i] * v33)
        v44 = v43 + ((-(v36 * v4)) - (v7 * v41))
        v45 = (w[R55 + i] * v42) - (w[R54 + i] * v44)
        v46 = v9 * k11
        v47 = v45 + ((v18 * k11) + (v46 * v11))
        v48 = (w[R55 + i] * v44) + (w[R54 + i] * v42)
        v49 = v48 + ((-(v46 * v9)) - (v20 * v25))
        v50 = (w[R57 + i] * v47) - (w[R56 + i] * v49)
        v51 = v24 + ((k16 * v38) - (k17 * v50))
        v52 = ((k2 * v15) + (k3 * v13)) + (k4 * v21)
        v53 = (((k8 * v14) + (k9 * v16)) + (k10 * v19)) + ((v21 * v52) - (v15 * v22))
        v54 = (w[R57 + i] * v49) + (w[R56 + i] * v47)
        v55 = ((w[R1 + i] * w[R48 + i]) + (w[R4 + i] * w[R49 + i])) + (w[R7 + i] * w[R50 + i])
        v56 = ((w[R0 + i] * w[R48 + i]) + (w[R3 + i] * w[R49 + i])) + (w[R6 + i] * w[R50 + i])
        v57 = (k0 * v55) - (k1 * v56)
        v58 = (k0 * v56) + (k1 * v55)
        v59 = (w[R59 + i] * v57) - (w[R58 + i] * v58)
        v60 = (v53 + ((k17 * v54) - (k18 * v38))) - (k19 * v59)
        v61 = ((k23 * v11) + (k24 * v9)) + (k25 * v20)
        v62 = ((k26 * v11) + (k27 * v9)) + (k28 * v20)
        v63 = (((k20 * v10) + (k21 * v12)) + (k22 * v18)) + ((v9 * v61) - (v20 * v62))
        v64 = ((w[R57 + i] * v51) - (w[R56 + i] * v60)) + (v63 + ((-(v37 * k29)) - (k30 * v45)))
        v65 = (v21 * k18) - (v15 * k17)
        v66 = (v13 * k17) - (v21 * k16)
        v67 = (k31 * v38) + (((v14 * k16) - (v16 * k18)) + ((v15 * v65) - (v13 * v66)))
        v68 = v59 + v67
        v69 = ((k20 * v11) + (k21 * v9)) + (k22 * v20)
        v70 = (((k26 * v10) + (k27 * v12)) + (k28 * v18)) + ((v20 * v69) - (v11 * v61))
        v71 = (((w[R56 + i] * v51) + (w[R57 + i] * v60)) - (k11 * v68)) + (v70 + ((k30 * v48) + (v37 * k32)))
        v72 = (v20 * k32) - (v11 * k30)
        v73 = (v9 * k30) - (v20 * k29)
        v74 = (((v10 * k29) - (v12 * k32)) + ((v11 * v72) - (v9 * v73))) - (v37 * k33)
        v75 = v68 + v74
        v76 = ((k37 * v8) + (k38 * v4)) + (k39 * v7)
        v77 = ((k40 * v8) + (k41 * v4)) + (k42 * v7)
        v78 = (((k34 * v5) + (k35 * v17)) + (k36 * v6)) + ((v8 * v76) - (v4 * v77))
        v79 = (((w[R54 + i] * v64) + (w[R55 + i] * v71)) - (v75 * k15)) + (v78 + ((k43 * v35) - (k44 * v43)))
        v80 = (((k5 * v14) + (k6 * v16)) + (k7 * v19)) + ((v15 * v23) - (v13 * v52))
        v81 = ((w[R2 + i] * w[R48 + i]) + (w[R5 + i] * w[R49 + i])) + (w[R8 + i] * w[R50 + i])
        v82 = (w[R59 + i] * v58) + (w[R58 + i] * v57)
        v83 = (w[R55 + i] * v81) - (w[R54 + i] * v82)
        v84 = (w[R55 + i] * v82) + (w[R54 + i] * v81)
        v85 = (w[R57 + i] * v83) - (w[R56 + i] * v84)
        v86 = (v80 + ((k18 * v50) - (k16 * v54))) - (v85 * k19)
        v87 = (v15 * k16) - (v13 * k18)
        v88 = (k31 * v54) + (((v16 * k17) - (v19 * k16)) + ((v13 * v87) - (v21 * v65)))
        v89 = v88 - ((w[R57 + i] * v84) + (w[R56 + i] * v83))
        v90 = (k31 * v50) + (((v19 * k18) - (v14 * k17)) + ((v21 * v66) - (v15 * v87)))
        v91 = v90 - v85
        v92 = (w[R56 + i] * v89) + (w[R57 + i] * v91)
        v93 = (((k23 * v10) + (k24 * v12)) + (k25 * v18)) + ((v11 * v62) - (v9 * v69))
        v94 = (v86 + (k11 * v92)) + (v93 + ((k32 * v45) - (k29 * v48)))
        v95 = (v11 * k29) - (v9 * k32)
        v96 = (k33 * v48) + (((v12 * k30) - (v18 * k29)) + ((v9 * v95) - (v20 * v72)))
        v97 = ((w[R57 + i] * v89) - (w[R56 + i] * v91)) + v96
        v98 = (k33 * v45) + (((v18 * k32) - (v10 * k30)) + ((v20 * v73) - (v11 * v95)))
        v99 = v92 + v98
        v100 = (v8 * k44) - (v4 * k43)
        v101 = (v7 * k43) - (v8 * k46)
        v102 = (k45 * v43) + (((v17 * k46) - (v6 * k44)) + ((v4 * v100) - (v7 * v101)))
        v103 = ((w[R55 + i] * v97) - (w[R54 + i] * v99)) + v102
        v104 = (v4 * k46) - (v7 * k44)
        v105 = (k45 * v35) + (((v6 * k43) - (v5 * k46)) + ((v7 * v104) - (v8 * v100)))
        v106 = v105 - v75
        v107 = (w[R59 + i] * v103) - (w[R58 + i] * v106)
        v108 = (w[R58 + i] * v103) + (w[R59 + i] * v106)
        v109 = (k0 * v107) - (k1 * v108)
        v110 = (k1 * v107) + (k0 * v108)
        v111 = (w[R54 + i] * v97) + (w[R55 + i] * v99)
        v112 = (k45 * v40) + (((v5 * k44) - (v17 * k43)) + ((v8 * v101) - (v4 * v104)))
        v113 = v111 + v112
        v114 = ((k34 * v8) + (k35 * v4)) + (k36 * v7)
        v115 = (((k40 * v5) + (k41 * v17)) + (k42 * v6)) + ((v4 * v114) - (v7 * v76))
        v116 = ((w[R55 + i] * v64) - (w[R54 + i] * v71)) + (v115 + ((k44 * v40) - (k46 * v35)))
        v117 = (((k37 * v5) + (k38 * v17)) + (k39 * v6)) + ((v7 * v77) - (v8 * v114))
        v118 = ((-v94) - (k15 * v111)) + (v117 + ((k46 * v43) - (k43 * v40)))
        v119 = (w[R59 + i] * v116) - (w[R58 + i] * v118)
        v120 = (w[R58 + i] * v116) + (w[R59 + i] * v118)
        v121 = w[R30 + i] + (((k0 * v119) - (k1 * v120)) + ((k14 * v113) - (k13 * v110)))
        v122 = w[R31 + i] + (((k1 * v119) + (k0 * v120)) + ((k13 * v109) - (k12 * v113)))
        w[R51 + i] = v79
        w[R52 + i] = v94
        w[R53 + i] = v86
        w[R27 + i] = w[R27 + i] + v109
        w[R28 + i] = w[R28 + i] + v110
        w[R29 + i] = w[R29 + i] + v113
        w[R30 + i] = v121
        w[R31 + i] = v122
        w[R32 + i] = w[R32 + i] + (v79 + ((k12 * v110) - (k14 * v109)))


def inverse_dynamics_after_coefficients(c):
    return [
    ]


def inverse_dynamics_after(k, w):
    for i in range(BLOCK):
        v0 = ((w[R0 + i] * w[R27 + i]) + (w[R1 + i] * w[R28 + i])) + (w[R2 + i] * w[R29 + i])
        v1 = ((w[R3 + i] * w[R27 + i]) + (w[R4 + i] * w[R28 + i])) + (w[R5 + i] * w[R29 + i])
        v2 = ((w[R6 + i] * w[R27 + i]) + (w[R7 + i] * w[R28 + i])) + (w[R8 + i] * w[R29 + i])
        v3 = ((w[R0 + i] * w[R30 + i]) + (w[R1 + i] * w[R31 + i])) + (w[R2 + i] * w[R32 + i])
        v4 = ((w[R3 + i] * w[R30 + i]) + (w[R4 + i] * w[R31 + i])) + (w[R5 + i] * w[R32 + i])
        v5 = ((w[R6 + i] * w[R30 + i]) + (w[R7 + i] * w[R31 + i])) + (w[R8 + i] * w[R32 + i])
        w[R33 + i] = v0
        w[R34 + i] = v1
        w[R35 + i] = v2
        w[R36 + i] = v3
        w[R37 + i] = v4
        w[R38 + i] = v5


def inverse_dynamics(k_before, k_legs, rotation, rotation_stride, angular_velocity, angular_velocity_stride, angular_acceleration, angular_acceleration_stride, acceleration, acceleration_stride, q, q_stride, qd, qd_stride, qdd, qdd_stride, foot_force, foot_force_stride, torque, torque_stride, wrench, wrench_stride, start, stop):
    w = np.empty(60 * np.int64(BLOCK))
    legs = np.uint64(k_legs.shape[0])
    missed = stop * legs
    for first in range(start, stop, BLOCK):
        count = min(BLOCK, stop - first)
        gather(rotation, first * rotation_stride, rotation_stride, np.uint64(9), w, R0, count)
        ahead(rotation, first, rotation_stride, np.uint64(0), np.uint64(1))
        gather(angular_velocity, first * angular_velocity_stride, angular_velocity_stride, np.uint64(3), w, R9, count)
        ahead(angular_velocity, first, angular_velocity_stride, np.uint64(0), np.uint64(1))
        gather(angular_acceleration, first * angular_acceleration_stride, angular_acceleration_stride, np.uint64(3), w, R12, count)
        ahead(angular_acceleration, first, angular_acceleration_stride, np.uint64(0), np.uint64(1))
        gather(acceleration, first * acceleration_stride, acceleration_stride, np.uint64(3), w, R15, count)
        ahead(acceleration, first, acceleration_stride, np.uint64(0), np.uint64(1))
        inverse_dynamics_before(k_before[0], w)
        for leg in range(legs):
            gather(q, first * q_stride + leg * np.uint64(3), q_stride, np.uint64(3), w, R39, count)
            ahead(q, first, q_stride, leg, legs)
            gather(qd, first * qd_stride + leg * np.uint64(3), qd_stride, np.uint64(3), w, R42, count)
            ahead(qd, first, qd_stride, leg, legs)
            gather(qdd, first * qdd_stride + leg * np.uint64(3), qdd_stride, np.uint64(3), w, R45, count)
            ahead(qdd, first, qdd_stride, leg, legs)
            gather(foot_force, first * foot_force_stride + leg * np.uint64(3), foot_force_stride, np.uint64(3), w, R48, count)
            ahead(foot_force, first, foot_force_stride, leg, legs)
            inverse_dynamics_leg(k_legs[leg], w)
            scatter(w, R51, torque, first * torque_stride + leg * np.uint64(3), torque_stride, np.uint64(3), count)
            ahead(torque, first, torque_stride, leg, legs)
        inverse_dynamics_after(k_before[0], w)
        scatter(w, R33, wrench, first * wrench_stride, wrench_stride, np.uint64(6), count)
        ahead(wrench, first, wrench_stride, np.uint64(0), np.uint64(1))
    return missed


def tilted_inverse_dynamics_before_coefficients(c):
    v0 = c[1] * c[4]
    v1 = c[1] * c[3]
    v2 = c[1] * c[2]
    v3 = v2 * c[2]
    v4 = v1 * c[3]
    v5 = v0 * c[4]
    v6 = (v3 + v4) + v5
    return [
        c[0],
        c[1],
        v0,
        v1,
        v2,
        (c[5] + v6) - v3,
        c[6] - (v2 * c[3]),
        c[7] - (v2 * c[4]),
        c[11] - (v0 * c[2]),
        c[12] - (v0 * c[3]),
        (c[13] + v6) - v5,
        c[8] - (v1 * c[2]),
        (c[9] + v6) - v4,
        c[10] - (v1 * c[4]),
    ]


def tilted_inverse_dynamics_before(k, w):
    k0 = k[0]
    k1 = k[1]
    k2 = k[2]
    k3 = k[3]
    k4 = k[4]
    k5 = k[5]
    k6 = k[6]
    k7 = k[7]
    k8 = k[8]
    k9 = k[9]
    k10 = k[10]
    k11 = k[11]
    k12 = k[12]
    k13 = k[13]
    for i in range(BLOCK):
        v0 = ((w[R0 + i] * w[R9 + i]) + (w[R3 + i] * w[R10 + i])) + (w[R6 + i] * w[R11 + i])
        v1 = ((w[R1 + i] * w[R9 + i]) + (w[R4 + i] * w[R10 + i])) + (w[R7 + i] * w[R11 + i])
        v2 = ((w[R2 + i] * w[R9 + i]) + (w[R5 + i] * w[R10 + i])) + (w[R8 + i] * w[R11 + i])
        v3 = ((w[R0 + i] * w[R12 + i]) + (w[R3 + i] * w[R13 + i])) + (w[R6 + i] * w[R14 + i])
        v4 = ((w[R1 + i] * w[R12 + i]) + (w[R4 + i] * w[R13 + i])) + (w[R7 + i] * w[R14 + i])
        v5 = ((w[R2 + i] * w[R12 + i]) + (w[R5 + i] * w[R13 + i])) + (w[R8 + i] * w[R14 + i])
        v6 = w[R17 + i] + k0
        v7 = ((w[R0 + i] * w[R15 + i]) + (w[R3 + i] * w[R16 + i])) + (w[R6 + i] * v6)
        v8 = ((w[R1 + i] * w[R15 + i]) + (w[R4 + i] * w[R16 + i])) + (w[R7 + i] * v6)
        v9 = ((w[R2 + i] * w[R15 + i]) + (w[R5 + i] * w[R16 + i])) + (w[R8 + i] * v6)
        v10 = (v0 * k3) - (v1 * k4)
        v11 = (v2 * k4) - (v0 * k2)
        v12 = (k1 * v7) + (((v4 * k2) - (v5 * k3)) + ((v1 * v10) - (v2 * v11)))
        v13 = (v1 * k2) - (v2 * k3)
        v14 = (k1 * v8) + (((v5 * k4) - (v3 * k2)) + ((v2 * v13) - (v0 * v10)))
        v15 = (k1 * v9) + (((v3 * k3) - (v4 * k4)) + ((v0 * v11) - (v1 * v13)))
        v16 = ((k8 * v0) + (k9 * v1)) + (k10 * v2)
        v17 = ((k11 * v0) + (k12 * v1)) + (k13 * v2)
        v18 = (((k5 * v3) + (k6 * v4)) + (k7 * v5)) + ((v1 * v16) - (v2 * v17))
        v19 = ((k5 * v0) + (k6 * v1)) + (k7 * v2)
        v20 = (((k11 * v3) + (k12 * v4)) + (k13 * v5)) + ((v2 * v19) - (v0 * v16))
        v21 = (((k8 * v3) + (k9 * v4)) + (k10 * v5)) + ((v0 * v17) - (v1 * v19))
        w[R18 + i] = v0
        w[R19 + i] = v1
        w[R20 + i] = v2
        w[R21 + i] = v3
        w[R22 + i] = v4
        w[R23 + i] = v5
        w[R24 + i] = v7
        w[R25 + i] = v8
        w[R26 + i] = v9
        w[R27 + i] = v12
        w[R28 + i] = v14
        w[R29 + i] = v15
        w[R30 + i] = v18 + ((k3 * v9) - (k2 * v8))
        w[R31 + i] = v20 + ((k2 * v7) - (k4 * v9))
        w[R32 + i] = v21 + ((k4 * v8) - (k3 * v7))


def tilted_inverse_dynamics_leg_coefficients(c):
    v0 = c[6] * c[13]
    v1 = v0 * c[13]
    v2 = c[6] * c[14]
    v3 = v2 * c[14]
    v4 = c[6] * c[15]
    v5 = v4 * c[15]
    v6 = (v1 + v3) + v5
    v7 = c[5] * c[10]
    v8 = v7 * c[10]
    v9 = c[5] * c[11]
    v10 = v9 * c[11]
    v11 = c[5] * c[12]
    v12 = v11 * c[12]
    v13 = (v8 + v10) + v12
    v14 = c[4] * c[9]
    v15 = c[4] * c[7]
    v16 = v15 * c[7]
    v17 = c[4] * c[8]
    v18 = v17 * c[8]
    v19 = v14 * c[9]
    v20 = (v16 + v18) + v19
    return [
        c[43],
        c[46],
        c[49],
        c[44],
        c[47],
        c[50],
        c[45],
        c[48],
        c[51],
        (c[34] + v6) - v1,
        c[35] - (v0 * c[14]),
        c[36] - (v0 * c[15]),
        c[40] - (v4 * c[13]),
        c[41] - (v4 * c[14]),
        (c[42] + v6) - v5,
        c[37] - (v2 * c[13]),
        (c[38] + v6) - v3,
        c[39] - (v2 * c[15]),
        c[2],
        c[54],
        c[53],
        c[52],
        c[1],
        v2,
        v4,
        v0,
        c[3],
        (c[25] + v13) - v8,
        c[26] - (v7 * c[11]),
        c[27] - (v7 * c[12]),
        c[31] - (v11 * c[10]),
        c[32] - (v11 * c[11]),
        (c[33] + v13) - v12,
        c[28] - (v9 * c[10]),
        (c[29] + v13) - v10,
        c[30] - (v9 * c[12]),
        v9,
        v11,
        c[6],
        v7,
        c[5],
        c[22] - (v14 * c[7]),
        c[23] - (v14 * c[8]),
        (c[24] + v20) - v19,
        c[19] - (v17 * c[7]),
        (c[20] + v20) - v18,
        c[21] - (v17 * c[9]),
        (c[16] + v20) - v16,
        c[17] - (v15 * c[8]),
        c[18] - (v15 * c[9]),
        v15,
        v17,
        c[4],
        v14,
    ]


def tilted_inverse_dynamics_leg(k, w):
    k0 = k[0]
    k1 = k[1]
    k2 = k[2]
    k3 = k[3]
    k4 = k[4]
    k5 = k[5]
    k6 = k[6]
    k7 = k[7]
    k8 = k[8]
    k9 = k[9]
    k10 = k[10]
    k11 = k[11]
    k12 = k[12]
    k13 = k[13]
    k14 = k[14]
    k15 = k[15]
    k16 = k[16]
    k17 = k[17]
    k18 = k[18]
    k19 = k[19]
    k20 = k[20]
    k21 = k[21]
    k22 = k[22]
    k23 = k[23]
    k24 = k[24]
    k25 = k[25]
    k26 = k[26]
    k27 = k[27]
    k28 = k[28]
    k29 = k[29]
    k30 = k[30]
    k31 = k[31]
    k32 = k[32]
    k33 = k[33]
    k34 = k[34]
    k35 = k[35]
    k36 = k[36]
    k37 = k[37]
    k38 = k[38]
    k39 = k[39]
    k40 = k[40]
    k41 = k[41]
    k42 = k[42]
    k43 = k[43]
    k44 = k[44]
    k45 = k[45]
    k46 = k[46]
    k47 = k[47]
    k48 = k[48]
    k49 = k[49]
    k50 = k[50]
    k51 = k[51]
    k52 = k[52]
    k53 = k[53]
    sincos(w, R40, R54, R55)
    sincos(w, R41, R56, R57)
    sincos(w, R39, R58, R59)
    for i in range(BLOCK):
        v0 = ((k0 * w[R21 + i]) + (k1 * w[R22 + i])) + (k2 * w[R23 + i])
        v1 = ((k3 * w[R21 + i]) + (k4 * w[R22 + i])) + (k5 * w[R23 + i])
        v2 = ((k3 * w[R18 + i]) + (k4 * w[R19 + i])) + (k5 * w[R20 + i])
        v3 = ((k0 * w[R18 + i]) + (k1 * w[R19 + i])) + (k2 * w[R20 + i])
        v4 = (w[R59 + i] * v2) - (w[R58 + i] * v3)
        v5 = ((w[R59 + i] * v0) + (w[R58 + i] * v1)) + (v4 * w[R42 + i])
        v6 = (((k6 * w[R21 + i]) + (k7 * w[R22 + i])) + (k8 * w[R23 + i])) + w[R45 + i]
        v7 = (((k6 * w[R18 + i]) + (k7 * w[R19 + i])) + (k8 * w[R20 + i])) + w[R42 + i]
        v8 = (w[R59 + i] * v3) + (w[R58 + i] * v2)
        v9 = (w[R55 + i] * v7) - (w[R54 + i] * v8)
        v10 = ((w[R55 + i] * v5) + (w[R54 + i] * v6)) + (v9 * w[R43 + i])
        v11 = (w[R55 + i] * v8) + (w[R54 + i] * v7)
        v12 = ((w[R55 + i] * v6) - (w[R54 + i] * v5)) - (v11 * w[R43 + i])
        v13 = (w[R57 + i] * v9) - (w[R56 + i] * v11)
        v14 = ((w[R57 + i] * v10) + (w[R56 + i] * v12)) + (v13 * w[R44 + i])
        v15 = (w[R57 + i] * v11) + (w[R56 + i] * v9)
        v16 = ((w[R57 + i] * v12) - (w[R56 + i] * v10)) - (v15 * w[R44 + i])
        v17 = ((w[R59 + i] * v1) - (w[R58 + i] * v0)) - (v8 * w[R42 + i])
        v18 = w[R46 + i] - v17
        v19 = v18 + w[R47 + i]
        v20 = w[R43 + i] - v4
        v21 = v20 + w[R44 + i]
        v22 = ((k12 * v15) + (k13 * v13)) + (k14 * v21)
        v23 = ((k15 * v15) + (k16 * v13)) + (k17 * v21)
        v24 = (((k9 * v14) + (k10 * v16)) + (k11 * v19)) + ((v13 * v22) - (v21 * v23))
        v25 = v20 * k18
        v26 = (w[R18 + i] * k20) - (w[R19 + i] * k21)
        v27 = (w[R20 + i] * k21) - (w[R18 + i] * k19)
        v28 = ((w[R22 + i] * k19) - (w[R23 + i] * k20)) + ((w[R19 + i] * v26) - (w[R20 + i] * v27))
        v29 = w[R24 + i] + v28
        v30 = (w[R19 + i] * k19) - (w[R20 + i] * k20)
        v31 = ((w[R23 + i] * k21) - (w[R21 + i] * k19)) + ((w[R20 + i] * v30) - (w[R18 + i] * v26))
        v32 = w[R25 + i] + v31
        v33 = ((w[R21 + i] * k20) - (w[R22 + i] * k21)) + ((w[R18 + i] * v27) - (w[R19 + i] * v30))
        v34 = w[R26 + i] + v33
        v35 = ((k3 * v29) + (k4 * v32)) + (k5 * v34)
        v36 = ((k0 * v29) + (k1 * v32)) + (k2 * v34)
        v37 = (w[R59 + i] * v35) - (w[R58 + i] * v36)
        v38 = v4 * k22
        v39 = v37 + ((v6 * k22) + (v38 * v8))
        v40 = ((v11 * v25) - (v12 * k18)) - v39
        v41 = ((k6 * v29) + (k7 * v32)) + (k8 * v34)
        v42 = v7 * k22
        v43 = v41 + ((v8 * v42) - (v17 * k22))
        v44 = (w[R59 + i] * v36) + (w[R58 + i] * v35)
        v45 = v44 + ((-(v38 * v4)) - (v7 * v42))
        v46 = (w[R55 + i] * v43) - (w[R54 + i] * v45)
        v47 = v9 * k18
        v48 = v46 + ((v18 * k18) + (v47 * v11))
        v49 = (w[R55 + i] * v45) + (w[R54 + i] * v43)
        v50 = v49 + ((-(v47 * v9)) - (v20 * v25))
        v51 = (w[R57 + i] * v48) - (w[R56 + i] * v50)
        v52 = v24 + ((k23 * v40) - (k24 * v51))
        v53 = ((k9 * v15) + (k10 * v13)) + (k11 * v21)
        v54 = (((k15 * v14) + (k16 * v16)) + (k17 * v19)) + ((v21 * v53) - (v15 * v22))
        v55 = (w[R57 + i] * v50) + (w[R56 + i] * v48)
        v56 = ((w[R0 + i] * w[R48 + i]) + (w[R3 + i] * w[R49 + i])) + (w[R6 + i] * w[R50 + i])
        v57 = ((w[R1 + i] * w[R48 + i]) + (w[R4 + i] * w[R49 + i])) + (w[R7 + i] * w[R50 + i])
        v58 = ((w[R2 + i] * w[R48 + i]) + (w[R5 + i] * w[R49 + i])) + (w[R8 + i] * w[R50 + i])
        v59 = ((k3 * v56) + (k4 * v57)) + (k5 * v58)
        v60 = ((k0 * v56) + (k1 * v57)) + (k2 * v58)
        v61 = (w[R59 + i] * v59) - (w[R58 + i] * v60)
        v62 = (v54 + ((k24 * v55) - (k25 * v40))) - (k26 * v61)
        v63 = ((k30 * v11) + (k31 * v9)) + (k32 * v20)
        v64 = ((k33 * v11) + (k34 * v9)) + (k35 * v20)
        v65 = (((k27 * v10) + (k28 * v12)) + (k29 * v18)) + ((v9 * v63) - (v20 * v64))
        v66 = ((w[R57 + i] * v52) - (w[R56 + i] * v62)) + (v65 + ((-(v39 * k36)) - (k37 * v46)))
        v67 = (v21 * k25) - (v15 * k24)
        v68 = (v13 * k24) - (v21 * k23)
        v69 = (k38 * v40) + (((v14 * k23) - (v16 * k25)) + ((v15 * v67) - (v13 * v68)))
        v70 = v61 + v69
        v71 = ((k27 * v11) + (k28 * v9)) + (k29 * v20)
        v72 = (((k33 * v10) + (k34 * v12)) + (k35 * v18)) + ((v20 * v71) - (v11 * v63))
        v73 = (((w[R56 + i] * v52) + (w[R57 + i] * v62)) - (k18 * v70)) + (v72 + ((k37 * v49) + (v39 * k39)))
        v74 = (v20 * k39) - (v11 * k37)
        v75 = (v9 * k37) - (v20 * k36)
        v76 = (((v10 * k36) - (v12 * k39)) + ((v11 * v74) - (v9 * v75))) - (v39 * k40)
        v77 = v70 + v76
        v78 = ((k44 * v8) + (k45 * v4)) + (k46 * v7)
        v79 = ((k47 * v8) + (k48 * v4)) + (k49 * v7)
        v80 = (((k41 * v5) + (k42 * v17)) + (k43 * v6)) + ((v8 * v78) - (v4 * v79))
        v81 = (((w[R54 + i] * v66) + (w[R55 + i] * v73)) - (v77 * k22)) + (v80 + ((k50 * v37) - (k51 * v44)))
        v82 = (((k12 * v14) + (k13 * v16)) + (k14 * v19)) + ((v15 * v23) - (v13 * v53))
        v83 = ((k6 * v56) + (k7 * v57)) + (k8 * v58)
        v84 = (w[R59 + i] * v60) + (w[R58 + i] * v59)
        v85 = (w[R55 + i] * v83) - (w[R54 + i] * v84)
        v86 = (w[R55 + i] * v84) + (w[R54 + i] * v83)
        v87 = (w[R57 + i] * v85) - (w[R56 + i] * v86)
        v88 = (v82 + ((k25 * v51) - (k23 * v55))) - (v87 * k26)
        v89 = (v15 * k23) - (v13 * k25)
        v90 = (k38 * v55) + (((v16 * k24) - (v19 * k23)) + ((v13 * v89) - (v21 * v67)))
        v91 = v90 - ((w[R57 + i] * v86) + (w[R56 + i] * v85))
        v92 = (k38 * v51) + (((v19 * k25) - (v14 * k24)) + ((v21 * v68) - (v15 * v89)))
        v93 = v92 - v87
        v94 = (w[R56 + i] * v91) + (w[R57 + i] * v93)
        v95 = (((k30 * v10) + (k31 * v12)) + (k32 * v18)) + ((v11 * v64) - (v9 * v71))
        v96 = (v88 + (k18 * v94)) + (v95 + ((k39 * v46) - (k36 * v49)))
        v97 = (v11 * k36) - (v9 * k39)
        v98 = (k40 * v49) + (((v12 * k37) - (v18 * k36)) + ((v9 * v97) - (v20 * v74)))
        v99 = ((w[R57 + i] * v91) - (w[R56 + i] * v93)) + v98
        v100 = (k40 * v46) + (((v18 * k39) - (v10 * k37)) + ((v20 * v75) - (v11 * v97)))
        v101 = v94 + v100
        v102 = (v8 * k51) - (v4 * k50)
        v103 = (v7 * k50) - (v8 * k53)
        v104 = (k52 * v44) + (((v17 * k53) - (v6 * k51)) + ((v4 * v102) - (v7 * v103)))
        v105 = ((w[R55 + i] * v99) - (w[R54 + i] * v101)) + v104
        v106 = (v4 * k53) - (v7 * k51)
        v107 = (k52 * v37) + (((v6 * k50) - (v5 * k53)) + ((v7 * v106) - (v8 * v102)))
        v108 = v107 - v77
        v109 = (w[R59 + i] * v105) - (w[R58 + i] * v108)
        v110 = (w[R58 + i] * v105) + (w[R59 + i] * v108)
        v111 = (w[R54 + i] * v99) + (w[R55 + i] * v101)
        v112 = (k52 * v41) + (((v5 * k51) - (v17 * k50)) + ((v8 * v103) - (v4 * v106)))
        v113 = v111 + v112
        v114 = ((k0 * v109) + (k3 * v110)) + (k6 * v113)
        v115 = ((k1 * v109) + (k4 * v110)) + (k7 * v113)
        v116 = ((k2 * v109) + (k5 * v110)) + (k8 * v113)
        v117 = ((k41 * v8) + (k42 * v4)) + (k43 * v7)
        v118 = (((k47 * v5) + (k48 * v17)) + (k49 * v6)) + ((v4 * v117) - (v7 * v78))
        v119 = ((w[R55 + i] * v66) - (w[R54 + i] * v73)) + (v118 + ((k51 * v41) - (k53 * v37)))
        v120 = (((k44 * v5) + (k45 * v17)) + (k46 * v6)) + ((v7 * v79) - (v8 * v117))
        v121 = ((-v96) - (k22 * v111)) + (v120 + ((k53 * v44) - (k50 * v41)))
        v122 = (w[R59 + i] * v119) - (w[R58 + i] * v121)
        v123 = (w[R58 + i] * v119) + (w[R59 + i] * v121)
        v124 = (((k0 * v122) + (k3 * v123)) + (k6 * v81)) + ((k20 * v116) - (k19 * v115))
        v125 = (((k1 * v122) + (k4 * v123)) + (k7 * v81)) + ((k19 * v114) - (k21 * v116))
        v126 = (((k2 * v122) + (k5 * v123)) + (k8 * v81)) + ((k21 * v115) - (k20 * v114))
        w[R51 + i] = v81
        w[R52 + i] = v96
        w[R53 + i] = v88
        w[R27 + i] = w[R27 + i] + v114
        w[R28 + i] = w[R28 + i] + v115
        w[R29 + i] = w[R29 + i] + v116
        w[R30 + i] = w[R30 + i] + v124
        w[R31 + i] = w[R31 + i] + v125
        w[R32 + i] = w[R32 + i] + v126


def tilted_inverse_dynamics_after_coefficients(c):
    return [
    ]


def tilted_inverse_dynamics_after(k, w):
    for i in range(BLOCK):
        v0 = ((w[R0 + i] * w[R27 + i]) + (w[R1 + i] * w[R28 + i])) + (w[R2 + i] * w[R29 + i])
        v1 = ((w[R3 + i] * w[R27 + i]) + (w[R4 + i] * w[R28 + i])) + (w[R5 + i] * w[R29 + i])
        v2 = ((w[R6 + i] * w[R27 + i]) + (w[R7 + i] * w[R28 + i])) + (w[R8 + i] * w[R29 + i])
        v3 = ((w[R0 + i] * w[R30 + i]) + (w[R1 + i] * w[R31 + i])) + (w[R2 + i] * w[R32 + i])
        v4 = ((w[R3 + i] * w[R30 + i]) + (w[R4 + i] * w[R31 + i])) + (w[R5 + i] * w[R32 + i])
        v5 = ((w[R6 + i] * w[R30 + i]) + (w[R7 + i] * w[R31 + i])) + (w[R8 + i] * w[R32 + i])
        w[R33 + i] = v0
        w[R34 + i] = v1
        w[R35 + i] = v2
        w[R36 + i] = v3
        w[R37 + i] = v4
        w[R38 + i] = v5


def tilted_inverse_dynamics(k_before, k_legs, rotation, rotation_stride, angular_velocity, angular_velocity_stride, angular_acceleration, angular_acceleration_stride, acceleration, acceleration_stride, q, q_stride, qd, qd_stride, qdd, qdd_stride, foot_force, foot_force_stride, torque, torque_stride, wrench, wrench_stride, start, stop):
    w = np.empty(60 * np.int64(BLOCK))
    legs = np.uint64(k_legs.shape[0])
    missed = stop * legs
    for first in range(start, stop, BLOCK):
        count = min(BLOCK, stop - first)
        gather(rotation, first * rotation_stride, rotation_stride, np.uint64(9), w, R0, count)
        ahead(rotation, first, rotation_stride, np.uint64(0), np.uint64(1))
        gather(angular_velocity, first * angular_velocity_stride, angular_velocity_stride, np.uint64(3), w, R9, count)
        ahead(angular_velocity, first, angular_velocity_stride, np.uint64(0), np.uint64(1))
        gather(angular_acceleration, first * angular_acceleration_stride, angular_acceleration_stride, np.uint64(3), w, R12, count)
        ahead(angular_acceleration, first, angular_acceleration_stride, np.uint64(0), np.uint64(1))
        gather(acceleration, first * acceleration_stride, acceleration_stride, np.uint64(3), w, R15, count)
        ahead(acceleration, first, acceleration_stride, np.uint64(0), np.uint64(1))
        tilted_inverse_dynamics_before(k_before[0], w)
        for leg in range(legs):
            gather(q, first * q_stride + leg * np.uint64(3), q_stride, np.uint64(3), w, R39, count)
            ahead(q, first, q_stride, leg, legs)
            gather(qd, first * qd_stride + leg * np.uint64(3), qd_stride, np.uint64(3), w, R42, count)
            ahead(qd, first, qd_stride, leg, legs)
            gather(qdd, first * qdd_stride + leg * np.uint64(3), qdd_stride, np.uint64(3), w, R45, count)
            ahead(qdd, first, qdd_stride, leg, legs)
            gather(foot_force, first * foot_force_stride + leg * np.uint64(3), foot_force_stride, np.uint64(3), w, R48, count)
            ahead(foot_force, first, foot_force_stride, leg, legs)
            tilted_inverse_dynamics_leg(k_legs[leg], w)
            scatter(w, R51, torque, first * torque_stride + leg * np.uint64(3), torque_stride, np.uint64(3), count)
            ahead(torque, first, torque_stride, leg, legs)
        tilted_inverse_dynamics_after(k_before[0], w)
        scatter(w, R33, wrench, first * wrench_stride, wrench_stride, np.uint64(6), count)
        ahead(wrench, first, wrench_stride, np.uint64(0), np.uint64(1))
    return missed
