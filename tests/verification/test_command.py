"""``phasmid verify``: what it prints, writes and answers."""

import json
import re
from pathlib import Path

import pytest

from phasmid.cli import main
from phasmid.verification import CHECKS, Verdict
from phasmid.verification.page import page, tally
from phasmid.verification.row import Check, reading

PAGE = Path(__file__).parents[2] / "docs" / "verification.md"


@pytest.fixture
def failing_check(monkeypatch):
    """A check that fails, in the place of the seventh."""

    def measure(_):
        yield reading("too much", 2.0, 0.5, "Derived [somehow].", unit="m", expected=1.0)

    monkeypatch.setitem(CHECKS, 7, Check(7, "title", "a = b", measure))


def test_it_prints_the_table_and_ends_well(capsys):
    assert main(["verify", "--rows", "8,7"]) == 0
    out = capsys.readouterr().out
    lines = out.splitlines()
    assert re.match(r"row +expected +got +tolerance +verdict", lines[0])
    assert lines[1].startswith("  7 Denavit-Hartenberg chain   T₁ T₂ T₃ T₄ = closed form")
    assert re.search(r"^    foot, all presets +0 +\S+ m +± 1e-14 +passes$", out, re.MULTILINE)
    assert "2 checks, 2 numbers: 2 pass, 0 fail." in out
    assert "Products of four" not in out


def test_a_row_that_fails_is_told_by_the_status(failing_check, capsys):
    assert main(["verify", "--rows", "7,8", "--quiet", "--explain"]) == 1
    out = capsys.readouterr().out
    assert re.search(r"too much +1 m +2 m +± 0.5 +FAILS", out)
    # Square brackets are text, not the terminal's colours.
    assert "Derived [somehow]." in out
    assert "Jacobian" not in out


def test_it_writes_the_rows_and_the_page(tmp_path, failing_check):
    told, written = tmp_path / "rows.json", tmp_path / "page.md"
    call = ["verify", "--rows", "7,8", "--json", str(told), "--page", str(written), "--quiet"]
    assert main(call) == 1
    found = json.loads(told.read_text("utf-8"))
    assert found["passed"] is False
    assert [row["number"] for row in found["rows"]] == [7, 8]
    assert found["rows"][0]["got"] == 2.0
    assert found["rows"][0]["verdict"] == "FAILS"
    assert "| | too much | 1 m | 2 m | ± 0.5 | FAILS |" in written.read_text("utf-8")


def test_a_file_that_exists_is_not_replaced(tmp_path, capsys):
    path = tmp_path / "mine"
    path.write_text("mine", encoding="utf-8")
    assert main(["verify", "--rows", "7", "--json", str(path)]) == 2
    assert capsys.readouterr().err == (
        f"phasmid: {path} exists; nothing was written.\n  try  --force, or another file\n"
    )
    assert path.read_text("utf-8") == "mine"
    assert main(["verify", "--rows", "7", "--json", str(path), "--force", "--quiet"]) == 0
    assert path.read_text("utf-8") != "mine"


@pytest.mark.parametrize(
    ("rows", "error"),
    [
        ("31", "there is no row 31; rows are 1 to 30."),
        (
            "²",
            '--rows is "²"; it must be row numbers with commas between.\n  try  --rows 1,5,25',
        ),
    ],
)
def test_rows_that_are_none_are_refused(rows, error, capsys):
    assert main(["verify", "--rows", rows]) == 2
    assert capsys.readouterr().err == f"phasmid: {error}\n"


def cells(text):
    """Rows of the page's table without what a machine measured."""
    table = [line.split(" | ") for line in text.splitlines() if line.startswith("| ")]
    return [[line[0], line[1], *line[4:]] for line in table]


@pytest.mark.slow
def test_the_page_is_that_of_the_present_checks(measured):
    # What was measured differs from machine to machine in its last digits; checks, cases,
    # tolerances and verdicts do not.
    rows = [row for number in CHECKS for row in measured(number)]
    ours = page(rows)
    written = PAGE.read_text("utf-8")
    assert cells(written) == cells(ours)
    after = "## How each tolerance"
    assert written[written.index(after) :] == ours[ours.index(after) :]
    assert tally(rows) in written
    assert all(row.verdict is not Verdict.FAILS for row in rows)


def test_one_file_cannot_hold_both_the_rows_and_the_page(tmp_path, capsys):
    one, same = str(tmp_path / "a"), f"{tmp_path}/../{tmp_path.name}/a"
    assert main(["verify", "--rows", "1", "--json", one, "--page", same]) == 2
    assert "they must be two files" in capsys.readouterr().err
