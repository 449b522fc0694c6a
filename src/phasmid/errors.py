"""Errors that users meet, each with one sentence."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any


class PhasmidError(Exception):
    """Base of all errors that phasmid raises for users.

    Attributes:
        what: Cause and requirement, one sentence.
        where: File and line, field or option that it comes from; empty where nothing is known.
        hint: One thing to try; empty where there is none. It begins with what is typed: ``key =
            value`` of a scenario or of the file that `where` names, ``"name"`` in place of the one
            that `what` quotes, or a command. Of ``key = value`` the command line makes options.
        exit_status: Exit status of the command line.
    """

    exit_status = 2

    def __init__(self, what: str, *, where: str = "", hint: str = "") -> None:
        super().__init__(what)
        self.what = what
        self.where = where
        self._hint: str | Callable[[], str] = hint

    @property
    def hint(self) -> str:
        """One thing to try."""
        if callable(self._hint):
            self._hint = self._hint()
        return self._hint

    @hint.setter
    def hint(self, text: str) -> None:
        self._hint = text

    def advise(self, find: Callable[[], str]) -> None:
        """Set a hint that takes time to find, and is found when it is read.

        Args:
            find: Returns it.
        """
        self._hint = find

    def reword(self, change: Callable[[str], str]) -> None:
        """Change the hint, which is not found before it is read.

        Args:
            change: Returns another one.
        """
        own = self._hint
        self._hint = lambda: change(own() if callable(own) else own)

    def __str__(self) -> str:
        lines = [plain(self.what)]
        if self.where:
            lines.append(f"  in   {plain(self.where)}")
        if self.hint:
            lines.append(f"  try  {plain(self.hint)}")
        return "\n".join(lines)


LONGEST_TEXT = 1600
"""Letters of a longer text that are shown, half from its beginning and half from its end."""


def plain(text: str) -> str:
    """Return a text on one line, of bounded length, without control characters.

    Args:
        text: Whatever came from a file, an option or a name.
    """
    if len(text) > LONGEST_TEXT:
        half = LONGEST_TEXT // 2
        text = f"{text[:half]} … {text[-half:]}"
    return "".join(
        c if c.isprintable() else " " if c.isspace() else "\N{REPLACEMENT CHARACTER}" for c in text
    )


class InvalidInput(PhasmidError):
    """A file, option or argument that cannot be used."""


class AlreadyExists(InvalidInput):
    """A file or folder that is there and was not to be replaced.

    Attributes:
        option: The option of the command line that names another place.
    """

    def __init__(self, path: object, *, option: str) -> None:
        super().__init__(f"{path} exists; nothing was written.", hint="force=True, or another name")
        self.option = option


class InvalidRobot(InvalidInput):
    """A robot description that no machine could have."""


class InvalidGait(InvalidInput):
    """A gait that does not hold the robot up or is not well formed."""


class InfeasibleWalk(InvalidInput):
    """A walk that this robot cannot make: too long, too fast or unstable."""


class Unreachable(InfeasibleWalk):
    """A foot position that the leg cannot reach."""


class InfeasibleLoad(PhasmidError):
    """A load that the standing feet cannot give within their limits.

    Attributes:
        limit: The violated limit: ``feet``, ``pull``, ``friction`` or ``torque``.
        index: Index of the first such sample over the leading axes.
    """

    def __init__(
        self,
        what: str,
        *,
        limit: str,
        index: tuple[int, ...] = (),
        where: str = "",
        hint: str = "",
    ) -> None:
        self.limit = limit
        self.index = index
        super().__init__(what, where=where, hint=hint)


class FailedRuns(PhasmidError):
    """Some of several runs were refused; the others were made.

    Attributes:
        recordings: Of all runs in their order, None for those that were refused.
        errors: Why, by the run's index.
    """

    def __init__(
        self,
        names: Sequence[str],
        recordings: Sequence[Any],
        errors: Mapping[int, Exception],
    ) -> None:
        self.recordings = list(recordings)
        self.errors = dict(errors)
        first = min(errors)
        which = f"run {first + 1} of {len(names)} ({names[first]}): "
        more = f" {len(errors) - 1} more failed." if len(errors) > 1 else ""
        error = errors[first]
        if isinstance(error, PhasmidError):
            super().__init__(which + error.what + more, where=error.where, hint=error.hint)
        else:
            cause = f"{type(error).__name__}: {error}".rstrip(".: ")
            super().__init__(f"{which}{cause}.{more}")


class OutputError(PhasmidError):
    """A result that cannot be written."""

    exit_status = 1


class WrongContent(ValueError):
    """What is wrong with the content of a file, in words of phasmid, for `own_words`."""


def own_words(error: Exception) -> str:
    """Return why a file could not be read, such as ``: permission denied``.

    The words of a library, which name its own functions and types, are left out.

    Args:
        error: What its reader raised.
    """
    if isinstance(error, OSError) and error.filename and error.strerror:
        return f": {error.strerror.lower()}"
    return f": {error}" if isinstance(error, WrongContent) else ""


@contextmanager
def located(where: str) -> Iterator[None]:
    """Add the place of an error that has none.

    Args:
        where: File, line or field that is being read.
    """
    try:
        yield
    except PhasmidError as error:
        error.where = error.where or where
        raise


@contextmanager
def advised(hint: str) -> Iterator[None]:
    """Give another hint to an error.

    Args:
        hint: One thing to try.
    """
    try:
        yield
    except PhasmidError as error:
        error.hint = hint
        raise


LONGEST_NAME = 200
"""Letters of a misspelt name that are compared: a search in megabytes takes seconds."""


def nearest(name: str, known: Iterable[str]) -> str:
    """Return the known name nearest to a misspelt one, in any case; empty if none is near."""
    by_lower_case = {one.lower(): one for one in known}
    start = name[:LONGEST_NAME].lower()
    matches = difflib.get_close_matches(start, by_lower_case, n=1, cutoff=0.6)
    return by_lower_case[matches[0]] if matches else ""
