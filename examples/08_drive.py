"""Drive the locomotion engine by commands over time, by waypoints, and with a dead servo."""

import phasmid
from phasmid.control import CommandScript

scenario = phasmid.load_scenario("paper").replace(duration=8, period=1.0)
script = CommandScript(
    between="linear",
    command=[
        {"time": 0.5, "ahead": 0.0},
        {"time": 2.0, "ahead_mm_per_s": 60},
        {"time": 5.0, "ahead_mm_per_s": 60, "turn_deg_per_s": 10},
        {"time": 7.0, "ahead": 0.0, "turn": 0.0},
    ],
)
run = phasmid.drive(scenario, commands=script)
velocity = phasmid.summarise(run)["velocity"]
for name in ("commanded", "actual"):
    vx, _, wz = velocity[name]
    print(f"{name:9} {1000 * vx:.1f} mm/s forward, {wz:.3f} rad/s")
print("replay:", phasmid.replay(run))

waypoints = CommandScript(waypoint=[{"x_mm": 150, "y": 0}, {"x_mm": 150, "y_mm": 100}])
run = phasmid.drive(scenario.replace(duration=30), commands=waypoints)
x, y, _ = run.body_position.values[-1]
print(f"{run.attrs['ending']}: at ({1000 * x:.0f}, {1000 * y:.0f}) mm after {run.time[-1]:.1f} s.")

faults = ["right_middle.tibia dead at 3 s"]
run = phasmid.drive(scenario.replace(drive="servo"), commands=script, faults=faults)
print(f"With a dead servo: {run.attrs['ending']}. {run.attrs['events']}")
