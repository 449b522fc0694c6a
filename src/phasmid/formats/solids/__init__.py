"""Solids of robots: the parametric model, STEP assemblies and meshes; needs the extra ``cad``."""

from phasmid.formats.solids.assembly import Assembly, Placed, Solid, mass_properties
from phasmid.formats.solids.material import Material
from phasmid.formats.solids.meshes import meshes
from phasmid.formats.solids.model import build

__all__ = [
    "Assembly",
    "Material",
    "Placed",
    "Solid",
    "build",
    "mass_properties",
    "meshes",
]
