"""XML files that others wrote: read with limits, with lines, and without entities."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.parsers import expat

from phasmid.errors import InvalidInput, plain
from phasmid.formats.files import read_bytes

LARGEST_FILE = 10_000_000
"""Files above this many bytes are no descriptions of robots."""

DEEPEST = 200
"""Elements inside one another beyond this depth are refused."""

MOST_ELEMENTS = 100_000
"""Files of more elements than this are refused."""

LARGEST_NUMBER = 1e6
"""Numbers above this are slips or attacks, in any unit that models use."""

LONGEST_NAME = 200
"""Names above this many characters are refused."""


@dataclass(slots=True, eq=False)
class Element:
    """An element of an XML file.

    Attributes:
        tag: Its name, with its prefix where it has one.
        attributes: By name, in the file's order.
        file: Name of its file.
        line: Line on which it begins, from 1.
        children: Elements inside it.
        text: Text directly inside it.
    """

    tag: str
    attributes: dict[str, str]
    file: str = ""
    line: int = 0
    children: list[Element] = field(default_factory=list)
    text: str = ""

    @property
    def where(self) -> str:
        """File and line, for messages."""
        return f"{self.file}, line {self.line}"

    @property
    def shown(self) -> str:
        """The element as in its file, with its name alone, such as ``<link name="tibia">``."""
        name = self.attributes.get("name")
        return f"<{self.tag}>" if name is None else f'<{self.tag} name="{short(name)}">'

    def all(self, tag: str) -> list[Element]:
        """Elements of a kind directly inside this one."""
        return [child for child in self.children if child.tag == tag]

    def find(self, tag: str) -> Element | None:
        """Return the first element of a kind directly inside this one."""
        return next((child for child in self.children if child.tag == tag), None)

    def need(self, tag: str) -> Element:
        """Return the first element of a kind directly inside this one.

        Raises:
            InvalidInput: There is none.
        """
        found = self.find(tag)
        if found is None:
            raise InvalidInput(f"{self.shown} has no <{tag}>.", where=self.where)
        return found

    def walk(self) -> Iterator[Element]:
        """This element and all inside it, in the file's order."""
        pending = [self]
        while pending:
            element = pending.pop()
            yield element
            pending.extend(reversed(element.children))

    def need_text(self, attribute: str) -> str:
        """Return an attribute that must be there and not be empty.

        Raises:
            InvalidInput: It is absent or empty.
        """
        value = self.attributes.get(attribute, "").strip()
        if not value:
            raise InvalidInput(f"{self.shown} has no {attribute}.", where=self.where)
        return value

    def need_name(self, attribute: str = "name") -> str:
        """Return an attribute that is a name: there, printable and not too long.

        Raises:
            InvalidInput: It is not.
        """
        name = self.need_text(attribute)
        if len(name) > LONGEST_NAME or not name.isprintable():
            raise InvalidInput(
                f'{attribute} "{short(name)}" must be {LONGEST_NAME} printable characters or less.',
                where=self.where,
            )
        return name

    def numbers(
        self,
        attribute: str,
        count: int,
        default: Sequence[float] | None = None,
        *,
        largest: float = LARGEST_NUMBER,
    ) -> list[float]:
        """Numbers of an attribute, separated by blanks.

        Args:
            attribute: Its name.
            count: How many there must be.
            default: Value of an absent attribute; without one it must be there.
            largest: Largest absolute value.

        Raises:
            InvalidInput: They are absent, too few or too many, not finite or too large.
        """
        written = self.attributes.get(attribute)
        if written is None:
            if default is None:
                raise InvalidInput(f"{self.shown} has no {attribute}.", where=self.where)
            return list(default)
        noun = "a number" if count == 1 else f"{count} numbers"
        problem, hint = "", ""
        words = written.split(None, count)
        values = [_number(word) for word in words]
        if "${" in written or "$(" in written:
            problem, hint = f"it must be {noun}", "expand the file with xacro first"
        elif any(value is None for value in values) or len(values) != count:
            problem = f"it must be {noun}"
        elif not all(math.isfinite(value) for value in values if value is not None):
            problem = f"it must be {'a finite number' if count == 1 else 'finite numbers'}"
        elif any(abs(value) > largest for value in values if value is not None):
            problem = f"numbers above {largest:g} are refused"
        if problem:
            raise InvalidInput(
                f'{self.shown}: {attribute} is "{short(written, 60)}"; {problem}.',
                where=self.where,
                hint=hint,
            )
        return [value for value in values if value is not None]

    def number(
        self, attribute: str, default: float | None = None, *, largest: float = LARGEST_NUMBER
    ) -> float:
        """Return the one number of an attribute; as `numbers`."""
        preset = None if default is None else [default]
        return self.numbers(attribute, 1, preset, largest=largest)[0]


def _number(word: str) -> float | None:
    # Python also reads 1_000 and digits of other scripts, which no other reader does.
    if "_" in word or not word.isascii():
        return None
    try:
        return float(word)
    except ValueError:
        return None


def short(text: str, most: int = LONGEST_NAME) -> str:
    """Shorten a text from a file to one line of a message."""
    text = plain(text)
    return text if len(text) <= most else f"{text[:most]}…"


def load_xml(path: Path, limit: int = LARGEST_FILE) -> Element:
    """Return the root element of an XML file.

    Args:
        path: The file.
        limit: Most bytes that it may hold.

    Raises:
        InvalidInput: The file cannot be read, or as `read_xml`.
    """
    return read_xml(read_bytes(path, limit), path.name)


def read_xml(raw: bytes, file: str) -> Element:
    """Return the root element of an XML text.

    Args:
        raw: The text, in the encoding that it declares.
        file: Name of its file, for messages.

    Raises:
        InvalidInput: It is not well formed, too deep or too large, or defines entities.
    """
    if not raw.strip():
        raise InvalidInput(f"{file} is empty.")
    reader = _Reader(file)
    parser = reader.parser
    try:
        parser.Parse(raw, True)
    except expat.ExpatError as error:
        raise reader.located(error) from None
    except (LookupError, ValueError) as error:
        raise InvalidInput(f"{file}: its encoding cannot be read ({short(str(error))}).") from None
    root = reader.root
    if root is None:
        raise InvalidInput(f"{file} holds no element.")
    return root


_ENDS = frozenset(
    expat.errors.codes[message]
    for message in (
        expat.errors.XML_ERROR_NO_ELEMENTS,
        expat.errors.XML_ERROR_UNCLOSED_TOKEN,
        expat.errors.XML_ERROR_PARTIAL_CHAR,
        expat.errors.XML_ERROR_UNCLOSED_CDATA_SECTION,
    )
)


class _Reader:
    """Builds elements from the events of expat."""

    def __init__(self, file: str) -> None:
        self.file = plain(file)
        self.root: Element | None = None
        self.open: list[Element] = []
        self.texts: list[list[str]] = []
        self.count = 0
        self.parser: Any = expat.ParserCreate()
        self.parser.buffer_text = True
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._text
        self.parser.StartDoctypeDeclHandler = self._doctype

    @property
    def _line(self) -> int:
        return int(self.parser.CurrentLineNumber)

    def _refuse(self, what: str, line: int | None = None) -> InvalidInput:
        return InvalidInput(f"{self.file} line {line or self._line}: {what}")

    def _doctype(self, *_: object) -> None:
        raise self._refuse("entity definitions are not accepted.")

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        self.count += 1
        if len(self.open) >= DEEPEST:
            raise self._refuse(f"elements lie more than {DEEPEST} deep; such files are refused.")
        if self.count > MOST_ELEMENTS:
            raise self._refuse(f"more than {MOST_ELEMENTS} elements; such files are refused.")
        element = Element(tag, attributes, self.file, self._line)
        if self.open:
            self.open[-1].children.append(element)
        else:
            self.root = element
        self.open.append(element)
        self.texts.append([])

    def _text(self, text: str) -> None:
        self.texts[-1].append(text)

    def _end(self, _: str) -> None:
        self.open.pop().text = "".join(self.texts.pop()).strip()

    def located(self, error: expat.ExpatError) -> InvalidInput:
        """Convert an error of expat to a sentence."""
        if error.code in _ENDS and self.open:
            # The innermost element that has a name says more than an <inertia>.
            named = [element for element in self.open if "name" in element.attributes]
            inside = (named or self.open)[-1]
            return self._refuse(f"the file ends inside {inside.shown}.", error.lineno)
        if self.root is None:
            return self._refuse("this is no XML.", error.lineno)
        reason = expat.ErrorString(error.code).removeprefix("not well-formed ").strip("()")
        return self._refuse(f"not well formed ({reason}).", error.lineno)
