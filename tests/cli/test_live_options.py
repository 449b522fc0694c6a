"""Options of the live view, with and without its packages."""

import sys

import pytest

from phasmid.cli import main
from phasmid.extras import install_hint


def test_one_sentence_says_what_the_live_view_lacks(monkeypatch, capsys, tmp_path):
    for name in [name for name in sys.modules if name.startswith("phasmid.live")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "foxglove", None)
    assert main(["walk", "--live", "--out", str(tmp_path / "walk")]) == 2
    assert f"try  {install_hint('live')}" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("port", ["paper", "70000"])
def test_a_port_is_a_number(port, capsys):
    assert main(["walk", "--live", port]) == 2
    assert "a whole number from 0 to 65535" in capsys.readouterr().err
