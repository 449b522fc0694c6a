"""Solids of robots: the parametric model, STEP assemblies and meshes; needs the extra ``cad``."""

from phasmid.formats.solids.assembly import Assembly, mass_properties, meshes
from phasmid.formats.solids.model import build

__all__ = ["Assembly", "build", "mass_properties", "meshes"]
