"""How the ground shares the load, and what a walk needs."""

from phasmid.forces.analysis import analyse, planned_torque
from phasmid.forces.contacts import Contacts, JointLoad
from phasmid.forces.family import (
    FORCE_MODELS,
    ForceModel,
    FrictionCone,
    MinimumNorm,
    MinimumTorque,
    SmallestLargestLoad,
    WeightedMinimumNorm,
    force_model,
)
from phasmid.forces.friction import FrictionStatistics, friction_statistics
from phasmid.forces.minimum_norm import minimum_norm
from phasmid.forces.servo_verdict import (
    Holding,
    ServoVerdict,
    scenario_verdict,
    servo_verdict,
)
from phasmid.forces.sharing import share_load
from phasmid.forces.standing import Held, holding_forces
from phasmid.forces.transfer import load_share

__all__ = [
    "FORCE_MODELS",
    "Contacts",
    "ForceModel",
    "FrictionCone",
    "FrictionStatistics",
    "Held",
    "Holding",
    "JointLoad",
    "MinimumNorm",
    "MinimumTorque",
    "ServoVerdict",
    "SmallestLargestLoad",
    "WeightedMinimumNorm",
    "analyse",
    "force_model",
    "friction_statistics",
    "holding_forces",
    "load_share",
    "minimum_norm",
    "planned_torque",
    "scenario_verdict",
    "servo_verdict",
    "share_load",
]
