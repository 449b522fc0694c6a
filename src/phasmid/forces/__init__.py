"""Foot-force distribution and model torques of a walk."""

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
from phasmid.forces.sharing import minimum_norm, share_load
from phasmid.forces.transfer import load_share

__all__ = [
    "FORCE_MODELS",
    "Contacts",
    "ForceModel",
    "FrictionCone",
    "FrictionStatistics",
    "JointLoad",
    "MinimumNorm",
    "MinimumTorque",
    "ModelLoad",
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
    "share_load",
]
