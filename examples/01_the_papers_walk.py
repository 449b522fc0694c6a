"""Plan and simulate the walk of IMECE2018-88226, and read forces and torques from the recording."""

import phasmid

scenario = phasmid.load_scenario("paper")
walk = phasmid.plan(scenario)  # joint positions, velocities, accelerations; (N, 6, 3)
run = phasmid.simulate(scenario, walk)  # an xarray.Dataset, every channel with its unit

displacement = run.body_position[-1] - run.body_position[0]
print(
    f"The body moved {1000 * float(displacement[0]):.1f} mm forward in {float(run.time[-1]):g} s."
)

total = float(run.foot_normal_force.sum("leg").mean())
print(f"The feet carried {total:.2f} N on average; the robot weighs 26 N.")

mid_stance = run.sel(time=0.5, method="nearest").foot_normal_force
for leg in (2, 4, 6):
    print(f"At 0.5 s leg {leg} carried {float(mid_stance.sel(leg=leg)):.2f} N.")

worst = abs(run.joint_torque).max("time")
ratio = float(worst.max()) / walk.robot.servo.stall_torque
print(f"The largest torque was {100 * ratio:.0f} % of the {walk.robot.servo.name}'s stall torque.")
