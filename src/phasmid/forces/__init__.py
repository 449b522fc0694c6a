"""Foot-force distribution, model torques of a walk, and the servo verdict."""

from phasmid.forces.analysis import ModelLoad, analyse, holding_forces, planned_load
from phasmid.forces.contacts import Contacts, JointLoad, contact_jacobian, contact_points
from phasmid.forces.friction import FrictionStatistics, friction_statistics
from phasmid.forces.models import (
    FORCE_MODELS,
    ForceModel,
    FrictionCone,
    MinimumNorm,
    MinimumTorque,
    SmallestLargestLoad,
    WeightedMinimumNorm,
    force_model,
)
from phasmid.forces.servo_verdict import Holding, ServoVerdict, scenario_verdict, servo_verdict
from phasmid.forces.sharing import minimum_norm, share_load
from phasmid.forces.transfer import load_share

__all__ = [
    "FORCE_MODELS",
    "Contacts",
    "ForceModel",
    "FrictionCone",
    "FrictionStatistics",
    "Holding",
    "JointLoad",
    "MinimumNorm",
    "MinimumTorque",
    "ModelLoad",
    "ServoVerdict",
    "SmallestLargestLoad",
    "WeightedMinimumNorm",
    "analyse",
    "contact_jacobian",
    "contact_points",
    "force_model",
    "friction_statistics",
    "holding_forces",
    "load_share",
    "minimum_norm",
    "planned_load",
    "scenario_verdict",
    "servo_verdict",
    "share_load",
]
