"""Compare the force models on level ground and on a slope."""

import numpy as np

import phasmid
from phasmid import forces

scenario = phasmid.load_scenario("paper")
walk = phasmid.plan(scenario)
print("largest torque and friction demand on the paper's walk")
for model in forces.FORCE_MODELS:
    run = phasmid.analyse(scenario.replace(force_model=model), walk)
    # Moments are about the body's origin, from which the feet are measured; axes are the world's.
    feet = walk.foot_position - walk.trunk.position[:, None]
    contacts = forces.Contacts(feet, walk.stance)
    friction = forces.friction_statistics(contacts, run.foot_force_model.values).summary()
    torque = float(abs(run.joint_torque_model).max())
    print(f"  {model:<22} {torque:.3f} N·m, {friction['demand']['max']:.3f}")

# Three feet on a slope of 20 degrees: gravity pulls the robot downhill.
feet = np.array([[0.12, -0.1, -0.1], [-0.12, -0.1, -0.1], [0.0, 0.15, -0.1]])
tilt = np.radians(20.0)
normal = np.array([-np.sin(tilt), 0.0, np.cos(tilt)])
up_hill = np.array([np.cos(tilt), 0.0, np.sin(tilt)])
feet = feet[:, :1] * up_hill + feet[:, 1:2] * np.array([0.0, 1.0, 0.0]) + feet[:, 2:] * normal
weight = np.array([0.0, 0.0, 26.0, 0.0, 0.0, 0.0])
slope = forces.Contacts(feet, np.ones(3), normals=normal, friction=0.7)
for model in ("minimum-norm", "friction-cone"):
    demand = forces.friction_statistics(slope, forces.share_load(slope, weight, model)).demand
    print(f"on a slope of 20°, friction 0.7: {model} needs {demand.max():.2f}")

# At least tan(20°) = 0.364 is needed; the minimum norm reduces forces, not friction.
ice = forces.Contacts(feet, np.ones(3), normals=normal, friction=0.2)
try:
    forces.share_load(ice, weight, "friction-cone")
except phasmid.InfeasibleLoad as refusal:
    print(refusal)
