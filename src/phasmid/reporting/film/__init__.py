"""Recordings as videos, drawn by the engine's renderer."""
