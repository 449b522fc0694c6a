"""Solids of robots: the parametric model, STEP assemblies and meshes; needs the extra ``cad``."""

from phasmid.cad.assembly import Assembly, Placed, Solid, mass_properties
from phasmid.cad.material import Material
from phasmid.cad.meshes import meshes
from phasmid.cad.model import build

__all__ = [
    "Assembly",
    "Material",
    "Placed",
    "Solid",
    "build",
    "mass_properties",
    "meshes",
]
