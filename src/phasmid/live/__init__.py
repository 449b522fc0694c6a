"""Live view: runs in Foxglove while they go on, and velocity commands from there."""

from phasmid.errors import InvalidInput
from phasmid.extras import install_hint

try:
    import foxglove
except ModuleNotFoundError as error:
    raise InvalidInput(
        "the live view needs the package foxglove-sdk, which was not found.",
        hint=install_hint("live"),
    ) from error

from phasmid.live.server import COMMAND_TOPIC, HOST, PORT, RATE, LiveServer, serve

__all__ = ["COMMAND_TOPIC", "HOST", "PORT", "RATE", "LiveServer", "serve"]

del foxglove
