"""Live view: runs in Foxglove while they go on, and velocity commands from there."""

from phasmid.errors import InvalidInput

try:
    import foxglove
    import mcap_ros2.writer
except ModuleNotFoundError as error:
    raise InvalidInput(
        "the live view needs the packages foxglove-sdk and mcap-ros2-support, which were not "
        "found.",
        hint='pip install "phasmid[live]"',
    ) from error

from phasmid.live.server import COMMAND_TOPIC, HOST, PORT, RATE, LiveServer, serve

__all__ = ["COMMAND_TOPIC", "HOST", "PORT", "RATE", "LiveServer", "serve"]

del foxglove, mcap_ros2
