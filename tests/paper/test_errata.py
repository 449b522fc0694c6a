"""The page of misprints follows from the table."""

from pathlib import Path

import pytest

from phasmid.paper.errata import errata, main
from phasmid.paper.misprints import MISPRINTS

PAGE = Path(__file__).parents[2] / "docs" / "errata.md"


@pytest.fixture(scope="module")
def page() -> str:
    return errata()


def test_docs_errata_md_is_what_the_table_says(page: str) -> None:
    # Written anew by python -m phasmid.paper.errata; two digits do not depend on the machine.
    assert PAGE.read_text(encoding="utf-8") == page


def test_each_misprint_has_its_line(page: str) -> None:
    lines = page.splitlines()
    for row in MISPRINTS:
        start = f"| {row.where} | {row.printed} | {row.right} | "
        assert sum(line.startswith(start) for line in lines) == 1


def test_the_command_writes_the_page(tmp_path: Path, page: str) -> None:
    assert main([str(tmp_path / "errata.md")]) == 0
    assert (tmp_path / "errata.md").read_text(encoding="utf-8") == page


def test_a_page_that_cannot_be_written_is_refused_in_a_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(tmp_path / "nowhere" / "errata.md")]) == 1
    assert "cannot be written: No such file or directory." in capsys.readouterr().err


def test_an_option_that_is_none_is_no_file_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as stopped:
        main(["--halp"])
    assert stopped.value.code == 2
    assert "usage:" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
