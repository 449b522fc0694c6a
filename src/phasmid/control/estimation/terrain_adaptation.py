"""Adapt steps, stance and height of the body to rough and steep ground.

On rough ground the robot steps higher, stands higher and narrower, where a leg reaches deeper. On a
slope the body moves downhill, so that the legs stay near the middle of their reach.
"""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.compiled import compiled
from phasmid.control.estimation.state import EstimatorParameters, EstimatorState
from phasmid.control.reach import STRETCH, to_hip_frame
from phasmid.control.types import LegPhase, Model, Reference, State

LEAST_ROUGHNESS = 0.003
"""Vertical difference of the stance feet over the plane that is due to compliant legs [m]:
AX-12A servos and light legs deflect by 1 to 2 mm."""

FORGETTING = 0.4
"""Rate at which the estimated roughness decays [1/s]."""

HIT_ROUGHNESS = 0.05
"""Roughness that an obstacle met in a swing indicates [m]."""

MOST_STEP_RISE, MOST_BODY_RISE, MOST_CLEARANCE_RISE = 0.05, 0.05, 0.06
"""Most by which steps and body are raised by the roughness, and the body for its clearance [m]."""

LEVEL_SLOPE, DOWNHILL = 0.05, 0.8
"""Slope below which ground counts as level; shift of the body downhill, as a share of that which
puts the legs in the middle of their reach."""

ROUGH_NARROWING, STEEP_NARROWING, STEEP = 0.5, 0.1, 0.1
"""Narrowing of the stance by roughness [m/m] and by slope [m] beyond a slope of `STEEP`."""

MOST_NARROWING, NARROWING_RATE, NARROWING_STEP = 0.03, 0.02, 1e-3
"""Largest narrowing of the stance [m], its rate [m/s], and steps of the neutral feet [m]."""

STANCE_REACH, LANDING_REACH, LOWEST = 0.003, 0.01, -0.02
"""Height that the body could still rise over standing feet and over landings [m]; lowest height to
which it is lowered for that [m]."""

ROUGH_DEPTH, MOST_DEPTH = 0.5, 0.05
"""Depth by which a foot goes down farther, as a share of the roughness, and the most of it [m]."""


@compiled
def adapt_to_terrain(
    state: State,
    model: Model,
    reference: Reference,
    estimator: EstimatorState,
    parameters: EstimatorParameters,
    normal: Float[np.ndarray, "3"],
) -> None:
    """Write the corrections of body, steps and stance for the estimated ground.

    Args:
        state: State of the engine.
        model: `neutral` is written.
        reference: `pose_correction`, `step_height` and `landing_depth` are written.
        estimator: `roughness` and `narrowing` are written.
        parameters: Update period.
        normal: Upwards through the ground plane, with a vertical component of 1.
    """
    update_roughness(state, reference, estimator, parameters, normal)
    rough, correction = estimator.roughness, reference.pose_correction
    narrow_stance(state, model, estimator, parameters)
    shift_downhill(state, model, reference, estimator)
    if reference.step_height != estimator.raised_step_height:
        estimator.commanded_step_height = reference.step_height
    # On a height map the swings are planned.
    unseen = math.isinf(reference.least_rise)
    raised = estimator.commanded_step_height + (min(rough, MOST_STEP_RISE) if unseen else 0.0)
    reference.step_height = estimator.raised_step_height = raised
    deeper = min(ROUGH_DEPTH * rough, MOST_DEPTH) if unseen else 0.0
    reference.landing_depth = model.landing_depth + deeper
    # Legs that step higher need more clearance.
    rise = min(rough, MOST_BODY_RISE)
    if rise > 0.0:
        now = state.pose_filter[3, 2] - reference.pose[2] - correction[2]
        rise = min(rise, max(now + room_to_rise(state, model), LOWEST))
    # The trunk must clear the ground.
    rise = max(rise, min(reference.least_rise, MOST_CLEARANCE_RISE))
    correction[2] += rise


@compiled
def update_roughness(
    state: State,
    reference: Reference,
    estimator: EstimatorState,
    parameters: EstimatorParameters,
    normal: Float[np.ndarray, "3"],
) -> None:
    """Estimate the roughness: the largest recent difference of the feet's heights over the plane.

    An obstacle that a foot meets counts as a roughness, too.
    """
    low, high, rough = 0.0, 0.0, 0.0
    for leg in range(parameters.leg_count):
        if state.leg_phase[leg] == LegPhase.STANCE:
            z = normal @ state.foot[leg] - reference.ground_height
            low, high = min(low, z), max(high, z)
        estimate = estimator.feet[leg]
        if estimate.obstacle_hits > estimate.reported_hits:
            rough = HIT_ROUGHNESS
    rough = max(rough, high - low - LEAST_ROUGHNESS)
    kept = math.exp(-FORGETTING * parameters.dt) * estimator.roughness
    estimator.roughness = max(rough, kept)


@compiled
def narrow_stance(
    state: State, model: Model, estimator: EstimatorState, parameters: EstimatorParameters
) -> None:
    """Move the neutral feet towards the body on rough and steep ground."""
    plane = estimator.ground_plane
    steep = max(math.hypot(plane.slope_x, plane.slope_y) - STEEP, 0.0)
    goal = ROUGH_NARROWING * estimator.roughness + STEEP_NARROWING * steep
    most = NARROWING_RATE * parameters.dt
    change = min(goal, MOST_NARROWING) - estimator.narrowing
    estimator.narrowing += min(max(change, -most), most)
    for leg in range(parameters.leg_count):
        x, y = model.nominal[leg, 0], model.nominal[leg, 1]
        share = 1.0 - estimator.narrowing / math.hypot(x, y)
        dx, dy = share * x - model.neutral[leg, 0], share * y - model.neutral[leg, 1]
        if math.hypot(dx, dy) >= NARROWING_STEP or (estimator.narrowing == 0.0 and dx != 0.0):
            model.neutral[leg, 0] += dx
            model.neutral[leg, 1] += dy
            # Its foothold region is another one.
            state.region_pose[leg] = math.inf


@compiled
def shift_downhill(
    state: State, model: Model, reference: Reference, estimator: EstimatorState
) -> None:
    """Shift the body downhill along a slope."""
    plane, correction = estimator.ground_plane, reference.pose_correction
    steep = math.hypot(plane.slope_x, plane.slope_y)
    if steep <= LEVEL_SLOPE:
        return
    size = DOWNHILL * model.height * (1.0 - LEVEL_SLOPE / steep)
    c, s = math.cos(state.path[2]), math.sin(state.path[2])
    ahead, aside = (
        c * plane.slope_x + s * plane.slope_y,
        c * plane.slope_y - s * plane.slope_x,
    )
    correction[0] -= size * ahead
    correction[1] -= size * aside
    correction[2] -= size * steep * steep


@compiled
def room_to_rise(state: State, model: Model) -> float:
    """Return how much the body can rise until a leg reaches its foot or landing no more [m]."""
    room = math.inf
    for leg in range(state.leg_count):
        phase = state.leg_phase[leg]
        if phase == LegPhase.STANCE:
            left = height_left(state, model, leg, state.foot[leg]) - STANCE_REACH
        elif phase != LegPhase.HELD:
            left = height_left(state, model, leg, state.touchdown[leg]) - LANDING_REACH
        else:
            continue
        room = min(room, left)
    return room


@compiled
def height_left(state: State, model: Model, leg: int, foot: Float[np.ndarray, "3"]) -> float:
    """Return how much the body could rise along its z until a leg is stretched to a foot [m]."""
    R, p, lengths = state.R_odom_body, state.body_position, model.lengths[leg]
    x, y, z = to_hip_frame(model, leg, R, p, foot[0], foot[1], foot[2])
    out = math.sqrt(max(x * x + y * y - lengths[3] * lengths[3], 0.0)) - lengths[0]
    longest = STRETCH * (lengths[1] + lengths[2])
    return math.sqrt(max(longest * longest - out * out, 0.0)) + z
