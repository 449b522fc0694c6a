"""Build the documentation site: python tools/build_site.py [--out results/site]

The pages are made by Sphinx, whose warnings are errors; the demonstration page by `build_demo.py`.
Then every link of every page to another file of the site is followed.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import jupytext

import build_demo

DOCS = Path(__file__).parents[1] / "docs"


class _Page(HTMLParser):
    """Links and anchors of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: set[str] = set()
        self.anchors: set[str] = set()
        self.feed(text)

    def handle_starttag(self, _tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Take the links and anchors of an element."""
        given = dict(attrs)
        self.anchors |= {given[key] or "" for key in ("id", "name") if key in given}
        self.links |= {given[key] or "" for key in ("href", "src") if key in given}


def dead_links(site: Path) -> list[str]:
    """Return the links to files or anchors that the site does not have, one sentence each."""
    pages = {path: _Page(path.read_text("utf-8")) for path in sorted(site.rglob("*.html"))}
    dead = []
    for path, page in pages.items():
        for link in sorted(page.links):
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path.resolve()
            anchor = unquote(parts.fragment)
            if not target.exists():
                dead.append(f"{path.relative_to(site)}: {link} leads nowhere.")
            elif anchor and target in pages and anchor not in pages[target].anchors:
                dead.append(f"{path.relative_to(site)}: {link} has no such anchor.")
    return dead


def build(site: Path, *options: str, wasm: Path | None = None) -> list[str]:
    """Build the site, and return its dead links.

    Args:
        site: Folder of the site, which is replaced.
        options: Further options of Sphinx.
        wasm: Folder with MuJoCo's files for browsers; None: they are fetched with npm.

    Raises:
        subprocess.CalledProcessError: Sphinx warns, or a notebook fails.
    """
    shutil.rmtree(site, ignore_errors=True)
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html"]
    # Trees of parsed pages are kept beside the site, not in it.
    trees = site.with_name(f"{site.name}-cache")
    subprocess.run([*command, *options, "-d", str(trees), str(DOCS), str(site)], check=True)
    # Notebooks to download, beside their pages.
    for page in sorted((DOCS / "course").glob("[0-9]*.md")):
        jupytext.write(jupytext.read(page), site / "course" / f"{page.stem}.ipynb")
    build_demo.build(site / "demo", wasm)
    return dead_links(site.resolve())


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("results/site"))
    parser.add_argument("--wasm", type=Path, help="folder with MuJoCo's files for browsers")
    given = parser.parse_args()
    out = given.out
    found = build(out, wasm=given.wasm)
    words = "\n".join(found) or f"Written to {out / 'index.html'}; all its links lead somewhere."
    sys.stdout.write(f"{words}\n")
    sys.exit(bool(found))
