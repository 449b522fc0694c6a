"""Simulate the paper's walk on AX-12A servos: sag, saturation and heat."""

from dataclasses import replace

import phasmid
from phasmid.reporting.checks import largest_joint

paper = phasmid.load_scenario("paper").replace(drive="servo", duration=4)
robot = phasmid.load_robot("phantomx-paper")


def with_payload(mass):
    """Return the paper's robot with a payload [kg] at the middle of its trunk."""
    return replace(robot, body=replace(robot.body, mass=robot.body.mass + mass))


cases = {
    "as in the paper": paper,
    "on 9 V": paper.replace(voltage=9),
    "on 9 V with 0.5 kg": paper.replace(voltage=9, robot=with_payload(0.5)),
    "on 9 V with 3 kg, at 45 °C": paper.replace(
        voltage=9, robot=with_payload(3.0), ambient_temperature=45
    ),
    "twice as stiff": paper.replace(compliance_slope=16),
    "phantomx-mk4, XL430": paper.replace(robot="phantomx-mk4"),
}
print(f"{'':<27} path  lowest  output  >contin.  after 1 h")
for name, scenario in cases.items():
    walk = phasmid.plan(scenario)
    run = phasmid.simulate(scenario, walk)
    summary = phasmid.summarise(run)
    travel = summary["travel"]
    ratio = travel["distance"] / travel["commanded_distance"]
    sag = 1000 * (float(run.body_position[:, 2].min()) - walk.trunk.position[0, 2])
    output = abs(run.servo_duty).max()
    above, _ = largest_joint(summary, "above_continuous")
    hot, cool = summary["servo_verdict"]["hour_temperature"]
    print(
        f"{name:<27}{ratio:5.0%} {sag:4.1f} mm {float(output):6.0%} {above:8.0%}"
        f"  {cool:.0f} to {hot:.0f} °C"
    )
    for warning in summary["warnings"]:
        if "servo" in warning:
            print(f"  ! {warning}")

# path: distance over the planned one; lowest: height of the trunk minus the planned one. Then, of
# the worst joint, the largest duty cycle and the time above the continuous torque of 0.3 N·m; and
# the verdict's temperature of the warmest servo after an hour, with the floor's best help and
# without.
