"""A run and what is kept of it: in memory, or in a log alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TypeAlias

import numpy as np
from jaxtyping import Float

from phasmid.recording import Recording, RecordingLog, new_recording
from phasmid.recording.recording import Attributes
from phasmid.simulation.channels import ending_attributes
from phasmid.simulation.interrupt import noticed_interrupts
from phasmid.simulation.run import Progress, Run
from phasmid.simulation.samples import Samples
from phasmid.simulation.termination import Ending, Failure

Told: TypeAlias = Callable[[Samples, Float[np.ndarray, " time"]], dict[str, np.ndarray]]
"""From consecutive samples of a run and their times [s] to all their channels."""

Later: TypeAlias = Callable[[], Attributes]
"""What a recording says of its run that is known only at its end."""

Shortfall: TypeAlias = Callable[[], Failure | None]
"""Why a run that came to its end is incomplete; None where it is complete."""


def record_to_memory(
    run: Run,
    told: Told,
    attributes: Attributes,
    *,
    samples: int | None = None,
    progress: Progress | None = None,
    interrupted: Sequence[int] | None = (),
    shortfall: Shortfall = lambda: None,
    later: Later = dict,
) -> Recording:
    """Make a run, and its recording.

    Args:
        run: About to start.
        told: Tells the channels of its samples.
        attributes: What the recording says of it.
        samples: How many to record at most; None: all.
        progress: Is told how far the run is.
        interrupted: The run is stopped as soon as this is not empty; None: at Ctrl-C.
        shortfall: Returns at the end of a whole run why it is incomplete, or None.
        later: Tells at the end what else the recording says.
    """
    count = len(run.time) if samples is None else min(samples, len(run.time))
    room: dict[str, np.ndarray] = {}
    done = 0

    def keep(rows: Samples) -> None:
        nonlocal done
        part = slice(done, done + len(rows.qpos))
        for name, values in told(rows, run.time[part]).items():
            if name not in room:
                room[name] = np.empty((count, *values.shape[1:]), values.dtype)
            room[name][part] = values
        done = part.stop

    noticed = noticed_interrupts() if interrupted is None else nullcontext(interrupted)
    with noticed as seen:
        until = run.step_of(count - 1) + 1 if samples is not None else None
        trouble = run.advance(progress, keep=keep, interrupted=seen, until=until)
    if samples is None:
        trouble = trouble or shortfall()
    channels = {name: values[:done] for name, values in room.items()}
    said = {**attributes, **ending_attributes(trouble), **later()}
    # What is left of arrays that are too long would keep all of them.
    return new_recording(run.time[:done], channels, said, own=done == count)


def record_to_log(
    run: Run,
    told: Told,
    attributes: Attributes,
    path: str | Path,
    *,
    progress: Progress | None = None,
    force: bool = False,
    shortfall: Shortfall = lambda: None,
    later: Later = dict,
) -> Failure | None:
    """Make a run, recorded into a log file alone, in memory that does not grow with it.

    Args:
        run: As in `record_to_memory`.
        told: As in `record_to_memory`.
        attributes: As in `record_to_memory`.
        path: The log file.
        progress: As in `record_to_memory`.
        force: Whether an older file of that name is replaced.
        shortfall: As in `record_to_memory`.
        later: As in `record_to_memory`; a log that is cut off lacks it.

    Returns:
        What ended the run early; None where it was completed.

    Raises:
        InvalidInput: The file exists and may not be replaced.
        OutputError: It cannot be written.
    """
    done = 0

    def keep(rows: Samples) -> None:
        nonlocal done
        part = slice(done, done + len(rows.qpos))
        log.append(run.time[part], told(rows, run.time[part]))
        done = part.stop

    first = told(run.first, run.time[:1])
    cut = {"ending": Ending.CUT.name, "ending_reason": Ending.CUT.value}
    with (
        noticed_interrupts() as interrupted,
        RecordingLog(path, first, {**attributes, **cut}, time=run.time, force=force) as log,
    ):
        trouble = run.advance(progress, keep=keep, interrupted=interrupted) or shortfall()
        log.finish({**ending_attributes(trouble), **later()})
    return trouble
