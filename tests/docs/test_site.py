"""The documentation site: it builds without a warning, its links lead somewhere, and its reference
has all public names."""

from importlib import import_module
from pathlib import Path

import pytest

import build_site
import reference_pages

ROOT = Path(__file__).parents[2]
EXTENSIONS = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
"""Those of docs/conf.py but for `viewcode`."""
INTERNAL = {"phasmid.reporting.webpage"}  # used by the studio


def test_the_site_builds_without_a_warning_or_a_dead_link(tmp_path):
    """Without executing the notebooks, which test_course.py does, without the engine of the
    demonstration, which test_demo.py has, and without pages of the source, a third of the time."""
    pytest.importorskip("sphinx")
    options = ["nb_execution_mode=off", f"extensions={','.join(EXTENSIONS)}"]
    options = [word for option in options for word in ("-D", option)]
    assert build_site.build(tmp_path / "site", *options, wasm=tmp_path) == []
    for page in ("index", "reference/phasmid.control", "reference/command-line"):
        assert (tmp_path / f"site/{page}.html").exists()


def test_dead_links_and_anchors_are_found(tmp_path):
    (tmp_path / "a.html").write_text('<a href="b.html#here">x</a><a href="b.html#gone">x</a>')
    (tmp_path / "b.html").write_text('<p id="here"></p><img src="none.png"><a href="#top2"></a>')
    (tmp_path / "c.html").write_text('<a href="https://example.org/x">x</a><a href="a.html">x</a>')
    found = build_site.dead_links(tmp_path)
    assert found == [
        "a.html: b.html#gone has no such anchor.",
        "b.html: #top2 has no such anchor.",
        "b.html: none.png leads nowhere.",
    ]


def test_the_reference_has_every_package_with_public_names():
    packages = set()
    for file in (ROOT / "src/phasmid").rglob("__init__.py"):
        name = ".".join(file.parent.relative_to(ROOT / "src").parts)
        if name != "phasmid" and hasattr(import_module(name), "__all__"):
            packages.add(name)
    assert packages - INTERNAL <= set(reference_pages.PACKAGES)
