"""Live view: runs in Foxglove while they go on, and velocity commands from there."""

from phasmid.errors import InvalidInput

try:
    import foxglove
except ModuleNotFoundError as error:
    raise InvalidInput(
        "the live view needs the package foxglove-sdk, which was not found.",
        hint='pip install "phasmid[live]"',
    ) from error

from phasmid.live.server import COMMAND_TOPIC, HOST, PORT, RATE, LiveServer, serve

__all__ = ["COMMAND_TOPIC", "HOST", "PORT", "RATE", "LiveServer", "serve"]

del foxglove
