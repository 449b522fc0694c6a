"""The locomotion engine, told where to go: commands over time, then places, then a dead servo."""

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
told = phasmid.summarise(run)["velocity"]
for name in ("commanded", "actual"):
    ahead, left, turn = told[name]
    print(f"{name:6} {1000 * ahead:.1f} mm/s ahead, {turn:.3f} rad/s")
print("run again:", phasmid.replay(run))

places = CommandScript(waypoint=[{"x_mm": 150, "y": 0}, {"x_mm": 150, "y_mm": 100}])
run = phasmid.drive(scenario.replace(duration=30), commands=places)
x, y, _ = run.body_position.values[-1]
print(f"{run.attrs['ending']}: at ({1000 * x:.0f}, {1000 * y:.0f}) mm after {run.time[-1]:.1f} s.")

faults = ["right_middle.tibia dead at 3 s"]
run = phasmid.drive(scenario.replace(drive="servo"), commands=script, faults=faults)
print(f"With a dead servo: {run.attrs['ending']}. {run.attrs['events']}")
