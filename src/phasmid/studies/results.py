"""Rows of a study in its folder, and their tables."""

from __future__ import annotations

import hashlib
import io
import json
import stat
import time
import warnings
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from phasmid.arguments import checked
from phasmid.errors import InvalidInput, plain
from phasmid.recording.file import write_whole
from phasmid.studies.definition import Study
from phasmid.studies.runs import Row

if TYPE_CHECKING:
    import xarray as xr

PARTS, RECORDINGS, DEFINITION, PAGE = "parts", "recordings", "study.json", "study.html"
"""Names in the folder of a study."""

DIGEST_LETTERS = 16
"""Letters of the SHA-256 in the name of a part: 64 bits."""

MOST_BYTES = 100_000_000
"""Size of the largest part that is read [bytes]; 500 rows take less than a megabyte."""


class DamagedPart(UserWarning):
    """A part of a study could not be read."""


@dataclass(frozen=True, eq=False)
class StudyResults:
    """Rows of a study.

    Attributes:
        study: The study.
        folder: Its folder.
        table: One row per run: number, run (its id), the axes, seed, metrics, status (``done`` or
            ``failed``), ending, ending_reason, error, recording, wall_time_s and versions.
    """

    study: Study
    folder: Path
    table: pd.DataFrame

    @property
    def dataset(self) -> xr.Dataset:
        """Metrics by axis and seed, of a grid; by run, of another sampler."""
        names = [metric.name for metric in self.study.metrics]
        axes = [*self.study.axes, *(["seed"] if self.study.seeds else [])]
        if self.study.sampler != "grid":
            return self.table.set_index("run")[[*axes, *names]].to_xarray()
        return self.table.set_index(axes)[names].to_xarray()

    @property
    def best(self) -> pd.DataFrame:
        """Points of a search that no other point surpasses in all objectives; means over seeds.

        Raises:
            InvalidInput: The study has no ``[search]``.
        """
        from phasmid.studies.search import best_points

        if self.study.search is None:
            raise InvalidInput("the study has no [search].", hint="StudyResults.table")
        return best_points(self.study, self.table)

    @property
    def best_numbers(self) -> list[int]:
        """Numbers of the runs of the best points; empty without a search."""
        if self.study.search is None:
            return []
        axes = list(self.study.axes)
        best = self.table.merge(self.best[axes], on=axes)
        return [int(number) for number in best["number"]]


@checked
def load_study(folder: str | Path) -> StudyResults:
    """Read the rows of a study, also while it runs.

    Args:
        folder: The folder of the study.

    Raises:
        InvalidInput: It is no folder of a study, or it has no row.

    Warns:
        DamagedPart: A part is damaged; its rows are absent.
    """
    folder = Path(folder)
    study = Study(**read_definition(folder)["study"])
    table = read_rows(folder, study)
    if table.empty:
        raise InvalidInput(f"{folder} has no row of a study.", hint="phasmid study FILE")
    return StudyResults(study, folder, table)


def read_definition(folder: Path) -> dict[str, Any]:
    """Return study and fingerprint of a folder.

    Raises:
        InvalidInput: It is no folder of a study.
    """
    path = folder / DEFINITION
    try:
        # A pipe never ends.
        text = path.read_text(encoding="utf-8") if path.is_file() else ""
        found: dict[str, Any] = json.loads(text)
        return {"study": found["study"], "parts": found["parts"]}
    except (OSError, ValueError, KeyError, TypeError):
        raise InvalidInput(
            f"{folder} is no folder of a study.", hint="phasmid study FILE"
        ) from None


def write_definition(folder: Path, study: Study, parts: Mapping[str, str]) -> None:
    """Write study and fingerprint into a folder.

    Raises:
        OutputError: They cannot be written.
    """
    text = json.dumps({"study": study.model_dump(mode="json"), "parts": dict(parts)}, indent=1)
    write_whole(folder / DEFINITION, text.encode())


def write_rows(folder: Path, rows: Sequence[Row]) -> None:
    """Write rows as a part, which appears whole or not at all.

    Raises:
        OutputError: They cannot be written.
    """
    content = pd.DataFrame(rows).to_parquet(index=False)
    # Parts sort by time: a run that was made again has its newest row last.
    name = f"{time.time_ns():020d}-{_digest(content)}.parquet"
    write_whole(folder / PARTS / name, content)


def read_rows(folder: Path, study: Study, *, set_aside: bool = False) -> pd.DataFrame:
    """Return the newest row of each run, in the order of the study.

    Args:
        folder: The folder of the study.
        study: The study.
        set_aside: Rename damaged parts, so that they are not read again.

    Warns:
        DamagedPart: A part is damaged; its rows are absent.
    """
    tables = [pd.DataFrame({"run": [], "status": [], "number": []})]
    for path in sorted((folder / PARTS).glob("*.parquet")):
        try:
            tables.append(_read_part(path, study))
        except FileNotFoundError:
            # Another machine has set it aside.
            continue
        except (InvalidInput, MemoryError):
            raise
        except Exception as error:
            # Damaged bytes raise any exception in the reader.
            reason = " ".join(str(error).split())[:160].rstrip(".") or type(error).__name__
            sentence = f"the part {path} of a study is damaged: {reason}"
            if set_aside:
                aside = path.with_name(f"{path.name}.damaged")
                with suppress(OSError):
                    path.replace(aside)
                sentence += f"; it is now {aside.name}, and its runs are made again"
            warnings.warn(DamagedPart(plain(f"{sentence}.")), stacklevel=2)
    if len(tables) == 1:
        return tables[0]
    table = pd.concat(tables[1:], ignore_index=True)
    table = table.drop_duplicates("run", keep="last").sort_values("number")
    return table.reset_index(drop=True)


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:DIGEST_LETTERS]


def _read_part(path: Path, study: Study) -> pd.DataFrame:
    """Return the rows of a part.

    Raises:
        FileNotFoundError: There is no such part.
        InvalidInput: The system cannot read it; it may be sound.
        ValueError: It is damaged; other exceptions too.
    """
    try:
        state = path.lstat()
        if not stat.S_ISREG(state.st_mode):
            # A pipe never ends.
            raise ValueError("it is not a file")
        if state.st_size > MOST_BYTES:
            raise ValueError(f"it has {state.st_size} bytes")
        content = path.read_bytes()
    except FileNotFoundError:
        raise
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise InvalidInput(f"cannot read the part {path} of a study: {reason}.") from None
    if path.stem.rpartition("-")[2] != _digest(content):
        raise ValueError("it fails its checksum")
    table = pd.read_parquet(io.BytesIO(content))
    columns = ["run", "number", "status", "ending", "error", *study.axes]
    columns += [metric.name for metric in study.metrics]
    if absent := [name for name in columns if name not in table]:
        raise ValueError(f"it has no {', '.join(absent)}")
    return table


def causes(failed: pd.DataFrame) -> list[tuple[int, Any]]:
    """Return how many failed runs have each cause, with the first of them; the most frequent first.

    Sentences that differ in their numbers only are one cause.
    """
    sentences = failed["error"].str.replace(r"[-−]?\d+(\.\d+)?(e[-+]?\d+)?", "#", regex=True)
    groups = [group for _, group in failed.groupby(sentences)]
    return [(len(group), group.iloc[0]) for group in sorted(groups, key=len, reverse=True)]
