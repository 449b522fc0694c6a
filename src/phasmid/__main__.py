"""``python -m phasmid`` is the command ``phasmid``."""

import signal
import sys


def main() -> int:
    """Run the command, and return its exit status."""
    # Until the command handles it, and after that, Ctrl-C ends the process without a traceback.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    from phasmid.cli import main as command

    return command()


if __name__ == "__main__":
    sys.exit(main())
