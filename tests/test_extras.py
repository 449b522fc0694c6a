"""The command that installs an extra names the source of the installed phasmid."""

import json
import sys

import pytest

from phasmid.cli import main
from phasmid.extras import install_hint


@pytest.mark.parametrize(
    ("origin", "command"),
    [
        (None, 'pip install "phasmid[video]"'),
        ({"url": "https://host/phasmid.whl", "archive_info": {}}, 'pip install "phasmid[video]"'),
        ({"url": "file:///my%20clone", "dir_info": {}}, 'pip install "/my clone[video]"'),
    ],
    ids=["index", "wheel", "clone"],
)
def test_an_extra_comes_from_where_phasmid_came(origin, command, tmp_path, monkeypatch):
    """pip writes `direct_url.json` for everything that comes from no index (PEP 610)."""
    info = tmp_path / "phasmid-1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: phasmid\nVersion: 1\n")
    if origin:
        (info / "direct_url.json").write_text(json.dumps(origin))
    monkeypatch.syspath_prepend(tmp_path)
    assert install_hint("video") == command


def test_one_sentence_says_what_the_live_view_lacks(monkeypatch, capsys, tmp_path):
    for name in [name for name in sys.modules if name.startswith("phasmid.live")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "foxglove", None)
    assert main(["walk", "--live", "--out", str(tmp_path / "walk")]) == 2
    assert f"  try  {install_hint('live')}" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
