"""XML that others wrote: read with limits, with lines, and without entities."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any
from xml.parsers import expat

from phasmid.errors import InvalidInput, plain

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

    Its methods raise `InvalidInput` with file and line where something is absent or wrong.

    Attributes:
        tag: Its name, with its prefix where it has one.
        attributes: By name, in the file's order.
        file: Name of its file.
        line: Line on which it begins, from 1.
        children: Elements inside it.
    """

    tag: str
    attributes: dict[str, str]
    file: str = ""
    line: int = 0
    children: list[Element] = field(default_factory=list)

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
        """Return the elements of a kind directly inside this one."""
        return [child for child in self.children if child.tag == tag]

    def find(self, tag: str) -> Element | None:
        """Return the first element of a kind directly inside this one."""
        return next(iter(self.all(tag)), None)

    def get(self, tag: str) -> Element:
        """Return the first element of a kind, or one without attributes in its place."""
        return self.find(tag) or Element(tag, {}, self.file, self.line)

    def need(self, tag: str) -> Element:
        """Return the first element of a kind, which must be there."""
        found = self.find(tag)
        if found is None:
            raise InvalidInput(f"{self.shown} has no <{tag}>.", where=self.where)
        return found

    def walk(self) -> Iterator[Element]:
        """Yield this element and all inside it, in the file's order."""
        yield self
        for child in self.children:
            yield from child.walk()

    def need_text(self, attribute: str) -> str:
        """Return an attribute that must be there and not be empty."""
        value = self.attributes.get(attribute, "").strip()
        if not value:
            raise InvalidInput(f"{self.shown} has no {attribute}.", where=self.where)
        return value

    def need_name(self, attribute: str = "name") -> str:
        """Return an attribute that is a name: there, printable and not too long."""
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
        least: float = -LARGEST_NUMBER,
        largest: float = LARGEST_NUMBER,
    ) -> list[float]:
        """Return the finite numbers of an attribute, separated by blanks, as many as counted.

        Without a default the attribute must be there.
        """
        written = self.attributes.get(attribute)
        if written is None:
            if default is None:
                raise InvalidInput(f"{self.shown} has no {attribute}.", where=self.where)
            return list(default)
        try:
            values = [float(word) for word in written.split()]
        except ValueError:
            values = []
        if len(values) != count:
            problem = f"it must be {'a number' if count == 1 else f'{count} numbers'}"
        elif not all(map(math.isfinite, values)) and not math.isinf(largest):
            problem = f"it must be {'a finite number' if count == 1 else 'finite numbers'}"
        elif not all(least <= value <= largest for value in values):
            problem = f"numbers must be from {least:g} to {largest:g}"
        else:
            return values
        raise InvalidInput(
            f'{self.shown}: {attribute} is "{short(written, 60)}"; {problem}.',
            where=self.where,
            hint="expand the file with xacro first" if "$" in written else "",
        )

    def number(
        self,
        attribute: str,
        default: float | None = None,
        *,
        least: float = -LARGEST_NUMBER,
        largest: float = LARGEST_NUMBER,
    ) -> float:
        """Return the one number of an attribute; as `numbers`."""
        preset = None if default is None else [default]
        return self.numbers(attribute, 1, preset, least=least, largest=largest)[0]


def short(text: str, most: int = LONGEST_NAME) -> str:
    """Shorten a text from a file to one line of a message."""
    text = plain(text)
    return text if len(text) <= most else f"{text[:most]}…"


def written(numbers: Iterable[float]) -> str:
    """Return numbers as text that reads back as the same, separated by blanks."""
    # Adding zero makes minus zero plain.
    return " ".join(repr(float(number) + 0.0) for number in numbers)


def read_xml(raw: bytes, file: str) -> Element:
    """Return the root element of an XML text in the encoding that it declares.

    Raises:
        InvalidInput: It is not well formed, too deep or too large, or defines entities.
    """
    if not raw.strip():
        raise InvalidInput(f"{file} is empty.")
    file = plain(file)
    parser: Any = expat.ParserCreate()
    # Elements are in `inside` until they end; the first is an outer one that holds the root.
    inside, count = [Element("", {})], 0

    def refusal(what: str, line: int | None = None) -> InvalidInput:
        return InvalidInput(f"{file} line {line or parser.CurrentLineNumber}: {what}")

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        if len(inside) > DEEPEST:
            raise refusal(f"elements lie more than {DEEPEST} deep; such files are refused.")
        if count > MOST_ELEMENTS:
            raise refusal(f"more than {MOST_ELEMENTS} elements; such files are refused.")
        element = Element(tag, attributes, file, parser.CurrentLineNumber)
        inside[-1].children.append(element)
        inside.append(element)

    def doctype(*_: object) -> None:
        raise refusal("entity definitions are not accepted.")

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _: inside.pop()
    parser.StartDoctypeDeclHandler = doctype
    try:
        parser.Parse(raw, True)
    except expat.ExpatError as error:
        if error.code in _ENDS and inside[1:]:
            # The innermost element that has a name says more than an <inertia>.
            named = [element for element in inside[1:] if "name" in element.attributes]
            innermost = (named or inside)[-1]
            raise refusal(f"the file ends inside {innermost.shown}.", error.lineno) from None
        if not inside[0].children:
            raise refusal("this is no XML.", error.lineno) from None
        reason = expat.ErrorString(error.code).removeprefix("not well-formed ").strip("()")
        fault = refusal(f"not well formed ({reason}).", error.lineno)
        fault.hint = "a blank between attributes, and &amp; for &" if "token" in reason else ""
        raise fault from None
    except (LookupError, ValueError) as error:
        raise InvalidInput(f"{file}: its encoding cannot be read ({short(str(error))}).") from None
    return inside[0].children[0]


_ENDS = frozenset(
    expat.errors.codes[message]
    for message in (
        expat.errors.XML_ERROR_NO_ELEMENTS,
        expat.errors.XML_ERROR_UNCLOSED_TOKEN,
        expat.errors.XML_ERROR_PARTIAL_CHAR,
        expat.errors.XML_ERROR_UNCLOSED_CDATA_SECTION,
    )
)
