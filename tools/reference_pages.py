"""Write the reference pages of the site: one per package, and one of the command line."""

from __future__ import annotations

import contextlib
import inspect
import io
from importlib import import_module
from pathlib import Path

import phasmid
from phasmid.cli.parser import COMMANDS, build_parser

PACKAGES = (
    "phasmid.robot",
    "phasmid.servo",
    "phasmid.kinematics",
    "phasmid.gait",
    "phasmid.motion",
    "phasmid.scenario",
    "phasmid.dynamics",
    "phasmid.forces",
    "phasmid.terrain",
    "phasmid.experiment",
    "phasmid.control.estimation",
    "phasmid.control.sequences",
    "phasmid.control",
    "phasmid.simulation.sensors",
    "phasmid.simulation",
    "phasmid.recording",
    "phasmid.formats",
    "phasmid.reporting",
    "phasmid.live",
    "phasmid.learning",
    "phasmid.studies",
    "phasmid.advice",
    "phasmid.identification",
    "phasmid.hardware",
    "phasmid.formats.solids",
    "phasmid.errors",
)
"""Packages with public names, in the order of the reference."""


def write_reference(folder: Path) -> None:
    """Write the pages, and remove older ones."""
    folder.mkdir(exist_ok=True)
    pages = {"index": _index(), "command-line": _command_line()}
    pages |= {name: _package(name) for name in PACKAGES}
    for old in folder.glob("*.md"):
        if old.stem not in pages:
            old.unlink()
    for name, text in pages.items():
        path = folder / f"{name}.md"
        # An unchanged file keeps its time, so that Sphinx does not read it again.
        if not path.exists() or path.read_text("utf-8") != text:
            path.write_text(text, encoding="utf-8")


def _index() -> str:
    """Return the page of all packages, and of the names that phasmid itself has."""
    rows = [f"| [`{name}`]({name}.md) | {_summary(import_module(name))} |" for name in PACKAGES]
    short = []
    for name in sorted(dir(phasmid)):
        value = getattr(phasmid, name)
        if inspect.isroutine(value) or inspect.isclass(value):
            home = next(p for p in PACKAGES if name in _public(p))
            short.append(f"| {{py:obj}}`phasmid.{name} <{home}.{name}>` | {_summary(value)} |")
    return (
        "# Python\n\nThe public names of each package. All other names may change.\n\n"
        "| package | content |\n|---|---|\n" + "\n".join(rows) + "\n\n## phasmid\n\n"
        "These names can be used as `phasmid.NAME`.\n\n| name | |\n|---|---|\n"
        + "\n".join(short)
        + "\n\n```{toctree}\n:hidden:\n\n"
        + "\n".join(PACKAGES)
        + "\n```\n"
    )


def _summary(value: object) -> str:
    """Return the first sentence of a docstring, in one line."""
    text = " ".join((inspect.getdoc(value) or "").split("\n\n")[0].split())
    return text.replace("|", "\\|").split(". ")[0].rstrip(".") + "."


def _public(name: str) -> list[str]:
    """Return the public names of a package or module."""
    package = import_module(name)
    own = [key for key in dir(phasmid) if hasattr(package, key)]
    return list(getattr(package, "__all__", own))


def _package(name: str) -> str:
    """Return the page of a package, without what the page of a package before it describes."""
    package, before = import_module(name), PACKAGES[: PACKAGES.index(name)]
    elsewhere = {id(getattr(import_module(p), key)) for p in before for key in _public(p)}
    members = [key for key in _public(name) if id(getattr(package, key)) not in elsewhere]
    return (
        f"# {name}\n\n```{{eval-rst}}\n.. automodule:: {name}\n"
        f"   :members: {', '.join(members)}\n```\n"
    )


def _command_line() -> str:
    """Return the page with the help text of each command."""
    parts = [
        "# Command line\n\n`phasmid COMMAND --help` prints these texts. "
        "[Conventions](../conventions.md#files) describes the files.\n"
    ]
    for name, words in COMMANDS.items():
        text = io.StringIO()
        with contextlib.redirect_stdout(text), contextlib.suppress(SystemExit):
            build_parser(name).parse_args([name, "--help"])
        parts.append(
            f"## {name}\n\n{words[0].upper()}{words[1:]}.\n\n```text\n{text.getvalue()}```\n"
        )
    return "\n".join(parts)
