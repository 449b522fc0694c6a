"""Write pages of the documentation, their tables and pictures.

    python tools/pages [PAGE ...] [option ...]

Without a page all are written, one after the other, which takes hours. `list` prints what each
makes. Options go to the pages.
"""

from __future__ import annotations

import ast
import sys
from importlib import import_module
from itertools import takewhile
from pathlib import Path

HERE = Path(__file__).parent
# What a page measures may be a test's experiment.
sys.path[:0] = [str(HERE.parent), str(HERE.parents[1] / "tests")]


def pages() -> dict[str, str]:
    """Return the first sentence of each page's module, by its name."""
    words = {}
    for path in sorted(HERE.glob("[a-z]*.py")):
        tree = ast.parse(path.read_text("utf-8"))
        if any(isinstance(node, ast.FunctionDef) and node.name == "main" for node in tree.body):
            words[path.stem] = (ast.get_docstring(tree) or "").partition("\n")[0]
    return words


def main(arguments: list[str]) -> int:
    """Write the named pages, or all."""
    known = pages()
    named = list(takewhile(lambda word: not word.startswith("-"), arguments))
    if named == ["list"]:
        print("\n".join(f"{name:<13} {words}" for name, words in known.items()))
        return 0
    if unknown := [name for name in named if name not in known]:
        print(f"no page {', '.join(unknown)}; pages are {', '.join(known)}.", file=sys.stderr)
        return 2
    sys.argv[1:] = arguments[len(named) :]
    for name in named or known:
        print(f"== {name}: {known[name]}", flush=True)
        import_module(f"pages.{name}").main()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
