"""The contact law of the paper's library: one-sided damping and stick-slip friction.

Source: Simscape Multibody Contact Forces Library, sphere to plane, with its defaults (the tool of
the paper's Figs. 9 to 11).
"""

from __future__ import annotations

from phasmid.compiled import compiled

KINETIC_FROM = 1.5
"""From this many thresholds of speed on, friction is kinetic."""


@compiled
def normal_force(depth: float, sinking: float, stiffness: float, damping: float) -> float:
    """Force of the ground on one point, out of the ground [N].

    A spring, and a damper while the point sinks further; while it leaves there is none, so that
    the ground never pulls.

    Args:
        depth: By which the point is in the ground [m].
        sinking: Speed into the ground [m/s].
        stiffness: [N/m].
        damping: [N·s/m].
    """
    if depth <= 0.0:
        return 0.0
    if sinking <= 0.0:
        return stiffness * depth
    return stiffness * depth + damping * sinking


@compiled
def friction_coefficient(speed: float, static: float, kinetic: float, threshold: float) -> float:
    """Friction over normal force of one point, against the slip.

    It rises linearly to the static coefficient at the threshold, falls linearly to the kinetic one
    at 1.5 times the threshold, and stays there.

    Args:
        speed: Of the slip, not negative [m/s].
        static: Coefficient at the threshold.
        kinetic: Coefficient of fast slip.
        threshold: Speed up to which the point sticks, by creeping [m/s].
    """
    if speed <= threshold:
        return static * speed / threshold
    if speed >= KINETIC_FROM * threshold:
        return kinetic
    return static - (static - kinetic) * (speed / threshold - 1.0) / (KINETIC_FROM - 1.0)
