"""``phasmid doctor``: what it prints, and its exit status."""

import json
import sys

from phasmid.cli import main
from phasmid.doctor import Finding, State

FINDINGS = [
    Finding("engine", State.READY, "MuJoCo 4.0.1", needed=True),
    Finding("ros", State.ABSENT, "ROS: mcap is not installed", 'pip install "phasmid[ros]"'),
]
BROKEN = Finding("figures", State.BROKEN, "no \x1b[2J.", "pip install matplotlib", needed=True)
TABLE = """\
engine      ready   MuJoCo 4.0.1
ros         absent  ROS: mcap is not installed
                    try  pip install "phasmid[ros]"
"""


def answered(monkeypatch, capsys, findings, *arguments):
    monkeypatch.setattr("phasmid.doctor.examine", lambda: findings)
    status = main(["doctor", *arguments])
    told = capsys.readouterr()
    return status, told.out, told.err


def test_what_is_absent_but_not_needed_does_not_fail(monkeypatch, capsys):
    status, out, err = answered(monkeypatch, capsys, FINDINGS)
    assert (status, err) == (0, "")
    assert out == f"{TABLE}robots can walk here.\n"


def test_what_is_needed_and_broken_fails_in_a_sentence(monkeypatch, capsys):
    status, out, err = answered(monkeypatch, capsys, [*FINDINGS, BROKEN])
    assert status == 1
    assert out.startswith(TABLE)
    assert "\x1b" not in out + err
    said = "phasmid: nothing can walk here: figures: no \N{REPLACEMENT CHARACTER}[2J.\n"
    assert err == f"{said}  try  pip install matplotlib\n"


def test_without_rich_the_table_is_plain(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "rich.console", None)
    assert answered(monkeypatch, capsys, FINDINGS)[1] == f"{TABLE}robots can walk here.\n"


def test_programs_get_json(monkeypatch, capsys):
    status, out, err = answered(monkeypatch, capsys, FINDINGS, "--json")
    assert (status, err) == (0, "")
    told = json.loads(out)
    assert told["walks"] is True
    assert told["findings"][1] == {
        "topic": "ros",
        "state": "absent",
        "what": "ROS: mcap is not installed",
        "remedy": 'pip install "phasmid[ros]"',
        "needed": False,
    }
    status, out, err = answered(monkeypatch, capsys, [*FINDINGS, BROKEN], "--json")
    assert status == 1
    assert json.loads(out)["walks"] is False
    assert err.startswith("phasmid: nothing can walk here: figures:")


def test_this_machine_is_examined_and_can_walk(capsys):
    # The tests run on it, so that all that is needed is there.
    assert main(["doctor"]) == 0
    out = capsys.readouterr().out
    assert out.endswith("robots can walk here.\n")
    assert "engine      ready   MuJoCo" in out
