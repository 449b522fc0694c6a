"""Why a request is refused, beside what the package itself refuses."""

from phasmid.errors import PhasmidError


class TooMany(PhasmidError):
    """As much of it goes on already as there may be at a time."""
