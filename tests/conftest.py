"""Shapes and types are checked at run time in all tests; hypothesis draws the same each time."""

from hypothesis import settings
from jaxtyping import install_import_hook

install_import_hook("phasmid", "type_checker.check")

settings.register_profile("phasmid", deadline=None, derandomize=True, max_examples=50)
settings.load_profile("phasmid")
