"""Lines and tables of a terminal are broken between words; a pipe gets them whole."""

import io

import pytest

from phasmid.cli.output import print_table, say


class Terminal(io.StringIO):
    """A terminal of 40 columns."""

    def isatty(self):
        return True


@pytest.fixture(autouse=True)
def columns(monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")


TEXT = "  note  a sentence that is longer than forty columns, and/or_a_path/that/stays"


def test_a_terminal_gets_lines_broken_between_words():
    terminal, pipe = Terminal(), io.StringIO()
    say(TEXT, file=terminal)
    say(TEXT, file=pipe)
    assert pipe.getvalue() == f"{TEXT}\n"
    lines = terminal.getvalue().splitlines()
    assert len(lines) > 1
    assert max(map(len, lines)) < 40
    assert " ".join(terminal.getvalue().split()) == " ".join(TEXT.split())
    assert lines[0].startswith("  note")
    assert all(line.startswith("    ") for line in lines[1:])


def test_the_last_column_of_a_table_stays_in_its_place(monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr("sys.stdout", terminal)
    print_table(
        [("name", "mass", "remark"), ("femur", "85.8", "one two three four five six")], (1,)
    )
    head, first, second = terminal.getvalue().splitlines()
    assert head.index("remark") == first.index("one") == len(second) - len(second.lstrip())
    assert first.index("85.8") + 4 == head.index("mass") + 4
