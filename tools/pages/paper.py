"""The paper's statements, graded: docs/paper.md and its figures."""

from pathlib import Path

from phasmid.cli import main as phasmid


def main() -> None:
    """Write the page."""
    assert phasmid(["paper", "--out", str(Path(__file__).parents[2] / "docs"), "--force"]) == 0
