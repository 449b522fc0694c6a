"""Walk with another robot, gait and stride; a step beyond the reach is refused with its reason."""

import phasmid
from phasmid import motion

scenario = phasmid.load_scenario("paper").replace(
    robot="phantomx-mk4", gait="ripple", step_length_mm=60, step_turn_deg=5, duration=6
)
walk = phasmid.plan(scenario)
run = phasmid.simulate(scenario, walk)
x, y, _ = run.body_position.values[-1]
print(f"{run.attrs['ending']}: {walk.robot.name} reached ({1000 * x:.0f}, {1000 * y:.0f}) mm.")

longest = motion.longest_stride(walk.robot, walk.gait)
print(f"Its longest step forward is {1000 * longest:.0f} mm.")
try:
    phasmid.plan(scenario.replace(step_length_mm=300))
except phasmid.InfeasibleWalk as refusal:
    print(refusal)
