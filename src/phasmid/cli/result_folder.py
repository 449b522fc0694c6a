"""The folder of a run in ``results``, named by its scenario and options."""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from phasmid.cli.scenario_options import PLACES, given_fields

if TYPE_CHECKING:
    from phasmid.scenario import Scenario

LONGEST_NAME = 100


def result_folder(
    options: argparse.Namespace, scenario: Scenario, words: Sequence[str] = ()
) -> Path:
    """Return the folder of the options, or the next free one in ``results``.

    Args:
        options: Those of the command line, among them ``out``, ``force`` and the fields.
        scenario: Gives the first part of the name.
        words: Further parts, before those of the fields.
    """
    if options.out:
        return Path(options.out)
    name = scenario.name
    if vars(options)["field:name"] is None:
        name = _plain("_".join([name, *words, *_fields(options)]))[:LONGEST_NAME]
    folder = first = Path("results") / name
    number = 1
    # The log of an interrupted run occupies its name, too.
    while not options.force and (os.path.lexists(folder) or os.path.lexists(log_of(folder))):
        number += 1
        folder = first.with_name(f"{name}-{number}")
    return folder


def log_of(folder: Path) -> Path:
    """Return the log of a run, beside its result folder."""
    return folder.with_name(f"{folder.name}.mcap")


def _fields(options: argparse.Namespace) -> list[str]:
    """Return the changed fields with their values, and files by their names."""
    words = []
    for field, value in given_fields(options).items():
        file = field in PLACES or value.endswith(".toml")
        words.append(f"{field.replace('_', '-')}-{Path(value).stem if file else value}")
    return words


def _plain(name: str) -> str:
    """Replace characters that are not plain in a file name, except a minus sign."""
    kept = (c if c.isascii() and (c.isalnum() or c in "._-") else "_" for c in name)
    return "".join(kept).rstrip("_.")
