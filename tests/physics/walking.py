"""Checks of the paper's walk: ground reaction and error of the time step."""

import numpy as np

from phasmid.motion import plan
from phasmid.reporting import summarise
from phasmid.reporting.steps import away_from_switches
from phasmid.robot import JOINTS
from phasmid.simulation import simulate, with_time_step
from physics.rows import row, samples

REFINED_CYCLES = 2
"""Cycles of a walk that are compared at half the time step: the first and one in full swing."""


def mean_load(bench):
    """Mean sum of all normal forces over whole cycles, beside the weight."""
    scenario, recording = bench.scenario, bench.walk()
    weight = scenario.load_robot().mass * scenario.model.gravity
    # The last sample begins the next cycle.
    total = recording["foot_normal_force"].sum("leg").values[:-1]
    why = (
        "Height and speed of the body repeat after each cycle, so that the mean force is the "
        "weight; touchdowns change them by 0.1 mm and some mm/s."
    )
    case = f"over {scenario.duration / scenario.build().course.stride.period:g} cycles"
    yield row(case, float(total.mean()) / weight, 0.002, why, expected=1.0)


def swing_load(bench):
    """Check the largest force on a swing foot, 80 ms away from its switches.

    That standing feet are loaded shows that the forces are measured at all.
    """
    recording = bench.walk()
    force = np.linalg.norm(recording["foot_force"].values, axis=-1)
    stance, away = recording["stance"].values, calm(recording)
    swinging, standing = away & ~stance, away & stance
    why = "A foot in the air touches nothing: exactly none."
    yield row("largest on any foot", force[swinging].max(initial=0.0), 0.0, why, unit="N")
    why = "Counted: every foot of a tripod carries a part of the weight."
    unloaded = np.count_nonzero(~(force[standing] > 0))
    yield row("standing feet without load", unloaded, 0.0, why, unit="samples")
    yield samples(int(swinging.sum()), "samples of feet in swing")


def refinement(bench):
    """Compare the first two cycles at the scenario's time step and at half of it.

    The error of the time step is about as large as this difference, as MuJoCo's is of first order.
    """
    walk = plan(bench.scenario)
    experiment = with_time_step(bench.scenario.build(), walk)
    dt = experiment.solver.time_step
    duration = min(experiment.duration, REFINED_CYCLES * walk.course.stride.period)
    # Both record the same instants.
    interval = dt * experiment.solver.record_steps
    coarse, fine = (
        simulate(experiment.replace(duration=duration, record_interval=interval, dt=step), walk)
        for step in (dt, dt / 2)
    )
    why = "The specified 0.5 %: rms of the difference over rms, touchdowns included."
    half = f"{1000 * dt:g} ms and half"
    for what, name in (("normal forces", "foot_normal_force"), ("joint torques", "joint_torque")):
        error, size = coarse[name].values - fine[name].values, fine[name].values
        ratio = float(np.sqrt((error**2).mean() / (size**2).mean()))
        yield row(f"{what}, {half}", 100 * ratio, 0.5, why, unit="%")
    apart = np.linalg.norm(coarse["body_position"].values - fine["body_position"].values, axis=1)
    why = "The specified 0.5 %, of the distance itself."
    ratio = float(apart.max() / np.linalg.norm(_way(bench.scenario)))
    yield row(f"way of the body, {half}", 100 * ratio, 0.5, why, unit="%")


def model_against_simulation(bench):
    """Rms difference of torques, model and simulation, amid stance; the worst leg of each joint."""
    compared = summarise(bench.walk())["model_against_simulation"]["torque"]
    for name, key in (("whole walk", "rms"), ("mid-stance", "rms_mid_stance")):
        worst = np.array(compared[key], dtype=float).max(axis=0)
        for joint, value in zip(JOINTS, worst, strict=True):
            why = (
                "Reported: statics does not determine the internal forces of the feet, so "
                "nothing is claimed beyond this number."
            )
            yield row(f"{joint}, {name}, worst leg", value, None, why, unit="N·m")


def calm(recording):
    """Samples of each leg that are 80 ms and more away from its switches."""
    return away_from_switches(recording["time"].values, recording["stance"].values)


def amid_stance(recording, legs):
    """Samples in which exactly these legs (from 0) stand, away from all switches."""
    wanted = np.zeros(recording.sizes["leg"], dtype=bool)
    wanted[list(legs)] = True
    return (recording["stance"].values == wanted).all(axis=1) & calm(recording).all(axis=1)


def _way(scenario):
    """Return the planned displacement in the compared cycles [m]."""
    end = min(scenario.duration, REFINED_CYCLES * scenario.build().course.stride.period)
    return plan(scenario).sample(np.array([end])).trunk.position[0] * [1, 1, 0]
