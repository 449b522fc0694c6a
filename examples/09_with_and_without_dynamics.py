"""Compare a driven walk with and without feed-forward torque, on three kinds of joints."""

import numpy as np

import phasmid
from phasmid.control import EngineSettings, LocomotionEngine
from phasmid.experiment import Command

DRIVES = {"ideal-servo": "ideal servos", "servo": "its own servos", "torque": "torque"}
PERIOD, CYCLES = 1.0, 3


def measure(name, drive, dynamics):
    """Return numbers of the last cycles of a walk at 70 % of the largest forward velocity."""
    scenario = phasmid.load_scenario("paper").replace(
        robot=name, drive=drive, duration=2.0 + CYCLES * PERIOD, record_interval=0.005
    )
    engine = LocomotionEngine(
        scenario.load_robot(), EngineSettings(period=PERIOD, dynamics=dynamics)
    )
    fastest = engine.largest_velocity((1.0, 0.0, 0.0)).velocity
    velocity = tuple(0.7 * part for part in fastest)
    run = phasmid.drive(scenario, engine, Command(velocity=velocity))
    steady = run.sel(time=slice(float(run.time[-1]) - CYCLES * PERIOD, None))
    summary = phasmid.summarise(steady)
    error = np.degrees(steady.joint_position - steady.joint_position_target)
    squeeze = np.hypot(steady.foot_force[..., 0], steady.foot_force[..., 1]).sum("leg")
    return (
        abs(summary["velocity"]["actual"][0] / velocity[0] - 1),
        float(np.sqrt(np.mean(error**2))),
        1000 * summary["slip"]["mean"],
        float(squeeze.mean()),
        summary["energy"]["mean_power"],
        summary["torque"]["simulation"]["largest"],
    )


print(
    f"{'':<38} velocity  joints   slip   squeeze   power  torque\n"
    f"{'':<38}    error   error  a step      all            peak"
)
for name in ("phantomx-paper", "phantomx-mk4"):
    for drive, words in DRIVES.items():
        for dynamics in ("none", "feed-forward"):
            velocity, joints, slip, squeeze, power, torque = measure(name, drive, dynamics)
            print(
                f"{name + ', ' + words:<30} {'with' if dynamics != 'none' else 'without':<7}"
                f" {velocity:8.1%} {joints:6.2f}° {slip:4.2f} mm {squeeze:7.2f} N"
                f" {power:5.2f} W {torque:4.2f} N·m"
            )

# squeeze: sum of the tangential forces of all feet, most of which push against one another; power:
# mean positive power of the joints; joints: rms position error.
