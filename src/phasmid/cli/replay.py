"""``phasmid replay``: run a recorded walk again and compare it bit by bit."""

from __future__ import annotations

import argparse

from phasmid.cli.report import print_damage

OPTIONS = {"FILE": "a recording.nc, its folder, or the .mcap of a run"}


def run(options: argparse.Namespace) -> int:
    """Replay a recording, and return the exit status."""
    from phasmid.recording import load_recording

    with print_damage():
        recording = load_recording(options.file)
    # Lazy import: the engine takes 0.3 s.
    from phasmid.scenario import replay

    found = replay(recording)
    print(found)
    return 0 if found.equal else 1
