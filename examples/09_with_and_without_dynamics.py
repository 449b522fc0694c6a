"""The same driven walk with and without feed-forward torque, on three kinds of joints."""

import math

import phasmid
from phasmid.control import Command, EngineSettings, LocomotionEngine
from phasmid.reporting.tracking import track

DRIVES = {"ideal-servo": "ideal servos", "servo": "its own servos", "torque": "torque"}
PERIOD, CYCLES = 1.0, 3


def walked(name, drive, dynamics):
    """Figures of a walk at 70 % of the largest velocity ahead."""
    scenario = phasmid.load_scenario("paper").replace(
        robot=name, drive=drive, duration=2.0 + CYCLES * PERIOD, record_interval=0.005
    )
    engine = LocomotionEngine(
        scenario.load_robot(), EngineSettings(period=PERIOD, dynamics=dynamics)
    )
    fastest = engine.largest_velocity((1.0, 0.0, 0.0)).velocity
    velocity = tuple(0.7 * part for part in fastest)
    run = phasmid.drive(scenario, engine, Command(velocity=velocity))
    return track(run, velocity, period=PERIOD, cycles=CYCLES)


print(
    f"{'':<38} velocity  joints   slip   squeeze   power  torque\n"
    f"{'':<38}    error   error  a step      all            peak"
)
for name in ("phantomx-paper", "phantomx-mk4"):
    for drive, words in DRIVES.items():
        for dynamics in ("none", "feed-forward"):
            found = walked(name, drive, dynamics)
            print(
                f"{name + ', ' + words:<30} {'with' if dynamics != 'none' else 'without':<7}"
                f" {found.velocity_error:8.1%} {math.degrees(found.joint_error):6.2f}°"
                f" {1000 * found.slip:4.2f} mm {found.tangential:7.2f} N {found.power:5.2f} W"
                f" {found.torque:4.2f} N·m"
            )

# "squeeze" is the sum of the forces along the ground of all feet, most of which push against one
# another; "power" what the joints give, the mean over time; "joints" the root of the mean square.
