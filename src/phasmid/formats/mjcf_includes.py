"""MJCF files that include one another, put together."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from phasmid.errors import InvalidInput, located
from phasmid.formats.files import named_file
from phasmid.formats.options import ImportOptions
from phasmid.formats.xml import DEEPEST, MOST_ELEMENTS, Element, load_xml, short

MOST_FILES = 100
"""Files that a file includes, directly or not, beyond this number are refused."""


def expand_includes(root: Element, path: Path, options: ImportOptions) -> None:
    """Replace each ``<include>`` by what its file holds.

    Args:
        root: The root element, which is changed.
        path: Its file.
        options: Where packages lie.

    Raises:
        InvalidInput: A file cannot be read or lies outside the model's folder, files include one
            another in a circle, or there are too many.
    """
    _Includes(path, options).expand(root)


@dataclass
class _Includes:
    """Files being put together."""

    path: Path
    options: ImportOptions
    files: int = 0
    elements: int = 0

    def expand(self, root: Element, chain: tuple[Path, ...] = (), depth: int = 0) -> None:
        """Replace each include by the children of what it names."""
        chain = chain or (self.path.absolute(),)
        children: list[Element] = []
        if depth > DEEPEST:
            raise InvalidInput(
                f"elements lie more than {DEEPEST} deep; such files are refused.", where=root.where
            )
        for child in root.children:
            self.elements += 1
            if self.elements > MOST_ELEMENTS:
                raise InvalidInput(
                    f"{self.path.name} and its includes have more than {MOST_ELEMENTS} elements; "
                    "such models are refused."
                )
            if child.tag == "include":
                children += self._included(child, chain, depth)
            else:
                self.expand(child, chain, depth + 1)
                children.append(child)
        root.children = children

    def _included(self, element: Element, chain: tuple[Path, ...], depth: int) -> list[Element]:
        name = element.need_text("file")
        with located(element.where):
            path = named_file(self.path, name, "include", self.options.packages)
            if not path.is_file():
                # Some writers count from the file that includes.
                beside = named_file(chain[-1], name, "include", self.options.packages)
                path = beside if beside.is_file() else path
            if path in chain:
                circle = [*chain[chain.index(path) :], path]
                raise InvalidInput(" includes ".join(file.name for file in circle) + ".")
            self.files += 1
            if self.files > MOST_FILES:
                raise InvalidInput(
                    f"{self.path.name} includes more than {MOST_FILES} files; "
                    "such models are refused."
                )
            if not path.is_file():
                raise InvalidInput(f'include "{short(name)}" is not there.')
        included = load_xml(path)
        self.expand(included, (*chain, path), depth)
        return included.children
