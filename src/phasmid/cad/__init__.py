"""Solids of robots: the parametric model, STEP assemblies and meshes; needs the extra ``cad``."""
