"""Which feet feel the ground, and which of their sensors are to be believed."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float, Int, Shaped

from phasmid.compiled import internal

SENSORS = ("contact switch", "force sensor", "joint loads", "joint angles")
"""What tells of a foot's contact, the best first."""

DEAD, STUCK_ON, STUCK_OFF, FLICKERS, HEALED = 1, 2, 3, 4, 5
"""What is news of a sensor."""

TOLD = {
    DEAD: "tells no number; it is not used",
    STUCK_ON: "feels the ground all through swings; it is not believed",
    STUCK_OFF: "never feels the ground while its leg stands; it is not believed",
    FLICKERS: "flickers while its leg swings; it is not believed",
    HEALED: "fits the leg's motion again; it is believed",
}
"""The same in words."""

# Columns of what is remembered of each sensor of each leg.
SENSE, SILENCE, IN_AIR, SWING, SWING_ON, FLIPS, STANCE, STANCE_ON, BADNESS, DOUBTED = range(10)
# Columns of what is remembered of each leg.
WAS_STANDING, CODE, CHANGE, LEFT, HITS = range(5)
# Columns of the settings.
TOUCH_TIME, RELEASE_TIME, RELEASE_BY, HIT_BY, DEAD_TIME = range(5)

SWING_WINDOW = (0.35, 0.85)
"""Part of a swing in which a foot over level ground is surely in the air."""

SCUFF = 0.1
"""Share of a swing up to which a foot that touches again has not left yet."""

CLEAR = 0.25
"""Share of a swing up to which a foot that has left may still bounce."""

MOST_FLIPS = 4
"""Changes of a reading in that part which no obstacle makes."""

FEWEST = 5
"""Readings of a swing or a stance from which a sensor is judged."""

SURE = 0.95
"""Share of those that is as good as all."""

HEALING = 0.5
"""By this each step that fits makes up for one that does not."""


@internal
def detect_contact(
    dt: float,
    reading: Float[np.ndarray, "4 legs"],
    threshold: Float[np.ndarray, "4 2"],
    present: Shaped[np.ndarray, " 4"],
    standing: Shaped[np.ndarray, " legs"],
    progress: Float[np.ndarray, " legs"],
    settings: Float[np.ndarray, " 5"],
    sensors: Float[np.ndarray, "legs 4 10"],
    legs: Float[np.ndarray, "legs 5"],
    code: Int[np.ndarray, " legs"],
    news: Int[np.ndarray, "4 legs"],
) -> int:
    """What each foot feels: the ground, the air, or nothing that is to be believed.

    The first sensor that is there, tells a number and is believed is heard. One that has not left
    the ground early in a swing is not heard for the rest of it: it is stuck, or the foot drags, and
    neither tells when the foot lands.

    Args:
        dt: Since the last update [s].
        reading: Of each sensor: 0 or 1 of the switch, forces [N] of the others; NaN: none, (4, L).
        threshold: From which a sensor feels the ground, and below which it does no more, (4, 2).
        present: Which sensors the robot has, shape (4,).
        standing: Which feet stand by the plan, shape (L,).
        progress: Share of its swing that each foot has done, shape (L,).
        settings: Touch and release time [s], latest release and latest hit as shares of a swing,
            dead time [s].
        sensors: Memory, is changed.
        legs: Memory, is changed.
        code: Is written: 1 on the ground, 0 in the air, -1 unknown: trust the plan, shape (L,).
        news: Is written where there is news of a sensor, shape (4, L).

    Returns:
        Number of news.
    """
    count = 0
    for i in range(code.shape[0]):
        stands = standing[i]
        legs[i, WAS_STANDING] = 1.0 if stands else 0.0
        evidence = -1
        for s in range(4):
            if not present[s]:
                continue
            m = sensors[i, s]
            value = reading[s, i]
            if not math.isfinite(value):
                silent = m[SILENCE]
                m[SILENCE] = silent + dt
                if silent <= settings[DEAD_TIME] < m[SILENCE]:
                    news[s, i] = DEAD
                    count += 1
                # For a moment its last word stands.
                if m[SILENCE] > settings[DEAD_TIME]:
                    continue
            else:
                if m[SILENCE] > settings[DEAD_TIME]:
                    news[s, i] = HEALED
                    count += 1
                m[SILENCE] = 0.0
                before = m[SENSE]
                if value >= threshold[s, 0]:
                    m[SENSE] = 1.0
                elif value < threshold[s, 1]:
                    m[SENSE] = 0.0
                if stands:
                    m[STANCE] += 1.0
                    m[STANCE_ON] += m[SENSE]
                elif SWING_WINDOW[0] <= progress[i] < SWING_WINDOW[1]:
                    m[SWING] += 1.0
                    m[SWING_ON] += m[SENSE]
                    m[FLIPS] += abs(m[SENSE] - before)
                if m[SENSE] < 0.5:
                    m[IN_AIR] += dt
            heard = stands or progress[i] < settings[RELEASE_BY]
            heard = heard or m[IN_AIR] >= settings[RELEASE_TIME]
            if evidence < 0 and m[DOUBTED] < 0.5 and heard:
                evidence = 1 if m[SENSE] > 0.5 else 0
        now = int(legs[i, CODE])
        if evidence == now:
            legs[i, CHANGE] = 0.0
        elif evidence < 0 or now < 0:
            # Doubt comes at once, and so does the first word after it.
            now = evidence
            legs[i, CHANGE] = 0.0
        else:
            legs[i, CHANGE] += dt
            wait = settings[TOUCH_TIME] if evidence == 1 else settings[RELEASE_TIME]
            # Half a nanosecond: a sum of time steps may end just short of its time.
            if legs[i, CHANGE] >= wait - 5e-10:
                now = evidence
                legs[i, CHANGE] = 0.0
        if now == 0 and not stands and progress[i] > SCUFF:
            legs[i, LEFT] = 1.0
        elif now == 1 and legs[i, LEFT] > 0.5 and CLEAR <= progress[i] < settings[HIT_BY]:
            # Before it counts as another one the foot must have left this one.
            legs[i, HITS] += 1.0
            legs[i, LEFT] = 0.0
        legs[i, CODE] = float(now)
        code[i] = now
    return count


@internal
def detect_sensor_faults(
    standing: Shaped[np.ndarray, " legs"],
    bad_steps: float,
    sensors: Float[np.ndarray, "legs 4 10"],
    legs: Float[np.ndarray, "legs 5"],
    news: Int[np.ndarray, "4 legs"],
) -> int:
    """Judge the sensors of the legs that lift off now, by the swing and the stance before it.

    Args:
        standing: Which feet stand by the plan, shape (L,).
        bad_steps: Steps that do not fit, until a sensor is doubted.
        sensors: Memory, is changed.
        legs: Memory, is changed.
        news: Is written where there is news, shape (4, L).

    Returns:
        Number of news.
    """
    count = 0
    for i in range(standing.shape[0]):
        if standing[i] or legs[i, WAS_STANDING] < 0.5:
            continue
        legs[i, LEFT] = legs[i, HITS] = 0.0
        for s in range(4):
            m = sensors[i, s]
            bad = 0
            if m[SWING] >= FEWEST and m[SWING_ON] >= SURE * m[SWING]:
                bad = STUCK_ON
            elif m[FLIPS] > MOST_FLIPS:
                bad = FLICKERS
            elif m[STANCE] >= FEWEST and m[STANCE_ON] <= (1 - SURE) * m[STANCE]:
                bad = STUCK_OFF
            judged = m[SWING] >= FEWEST or m[STANCE] >= FEWEST
            m[SWING] = m[SWING_ON] = m[FLIPS] = m[STANCE] = m[STANCE_ON] = m[IN_AIR] = 0.0
            if bad > 0:
                m[BADNESS] = min(m[BADNESS] + 1.0, 2 * bad_steps)
                if m[DOUBTED] < 0.5 and m[BADNESS] >= bad_steps:
                    m[DOUBTED] = 1.0
                    news[s, i] = bad
                    count += 1
            elif judged:
                m[BADNESS] = max(m[BADNESS] - HEALING, 0.0)
                if m[DOUBTED] > 0.5 and m[BADNESS] <= 0.0:
                    m[DOUBTED] = 0.0
                    news[s, i] = HEALED
                    count += 1
    return count
