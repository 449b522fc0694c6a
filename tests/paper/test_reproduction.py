"""The whole paper in one command, and the page in docs that it wrote."""

import re
from pathlib import Path

import pytest

from phasmid.cli import main
from phasmid.errors import AlreadyExists
from phasmid.paper.reproduction import STATEMENTS, reproduce

DOCS = Path(__file__).parents[2] / "docs"

NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]\d+)?")


def _words(text):
    return NUMBER.sub("#", text.replace("**", ""))


def _alike(ours, theirs):
    """Whether two printed numbers tell the same.

    Whole numbers below a hundred count things. Round-off (below 1e-9) may be any round-off. What
    was simulated depends on the machine's arithmetic from the first impact on: the servos' runs,
    which slide most, differ by some percent from one time step to a smaller one, so that 5 % and
    two units in the last printed digit are left to it.
    """
    a, b = float(ours), float(theirs)
    if "." not in ours + theirs and "e" not in ours + theirs and max(abs(a), abs(b)) < 100:
        return a == b
    if max(abs(a), abs(b)) < 1e-9:
        return True
    decimals = min(len(text.partition(".")[2]) for text in (ours, theirs))
    unit = 10.0**-decimals if "e" not in ours + theirs else 0.0
    return abs(a - b) <= 0.05 * max(abs(a), abs(b)) + 2 * unit


@pytest.mark.slow
def test_the_command_writes_the_page_that_stands_in_docs(tmp_path, capsys):
    folder = tmp_path / "out"
    assert main(["paper", "--out", str(folder)]) == 0
    page = (folder / "paper.md").read_text(encoding="utf-8")
    kept = (DOCS / "paper.md").read_text(encoding="utf-8")
    assert _words(page) == _words(kept), "make pages PAGE=paper writes it anew"
    pairs = list(zip(NUMBER.findall(page), NUMBER.findall(kept), strict=True))
    assert len(pairs) > 200
    assert [pair for pair in pairs if not _alike(*pair)] == []

    pictures = {path.name for path in (folder / "paper").iterdir()}
    assert {path.name for path in (DOCS / "paper").iterdir()} == pictures
    assert {path.name for path in folder.iterdir()} == {"paper.md", "paper"}
    for name in pictures:
        assert f"](paper/{name})" in page

    shown = " ".join(capsys.readouterr().out.split())
    count = sum(map(len, STATEMENTS.values()))
    assert f"{count} statements. holds: " in shown
    for part in STATEMENTS:
        assert part in shown
        assert f"## {part}" in page


def test_a_place_that_cannot_be_written_is_refused_before_the_work(tmp_path, capsys):
    (tmp_path / "paper.md").write_text("mine")
    with pytest.raises(AlreadyExists, match=r"paper\.md exists; nothing was written"):
        reproduce(tmp_path)
    assert main(["paper", "--out", str(tmp_path / "paper.md" / "folder"), "--quiet"]) == 1
    assert "cannot write" in capsys.readouterr().err
