"""The command that installs an extra names the source of the installed phasmid."""

import json
import sys

import pytest

from phasmid.cli import main
from phasmid.extras import install_hint
from phasmid.formats.solids.assembly import build123d

STUDIO = "phasmid.studio.guard"


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


@pytest.mark.parametrize(
    ("package", "line", "extra"),
    [
        ("foxglove", "walk --live --out walk", "live"),
        ("dynamixel_sdk", "bus scan /dev/null", "hardware"),
        ("starlette.datastructures", "studio --no-open", "studio"),
        ("build123d", "export --out cad", "cad"),
    ],
)
def test_a_command_that_lacks_its_extra_names_it(package, line, extra, here, monkeypatch, capsys):
    for name in [name for name in sys.modules if name.startswith(("phasmid.live", STUDIO))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)
    build123d.cache_clear()
    assert main(line.split()) == 2
    build123d.cache_clear()
    assert f"  try  {install_hint(extra)}" in capsys.readouterr().err
    assert not list(here.iterdir())
