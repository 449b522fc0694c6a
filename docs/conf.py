"""Configuration of the documentation site, which `make docs` builds into results/site.

The reference pages are written from the package itself: one page per package from its docstrings,
and one page of all commands from their parsers.
"""

from __future__ import annotations

import os
import re
import sys
from importlib import metadata
from pathlib import Path
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "tools"))

from reference_pages import write_reference  # noqa: E402

project = "phasmid"
author = "The phasmid authors"
copyright = "2026, the phasmid authors"
version = release = metadata.version("phasmid")

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
]
exclude_patterns = ["demo/*"]
default_role = "py:obj"

autodoc_default_options = {"imported-members": True}
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
napoleon_use_ivar = True
napoleon_use_rtype = False
# Types of attributes are in their own lines; shapes such as "*time 3" are not reStructuredText.
napoleon_attr_annotations = False

myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 4
nb_execution_mode = "cache"
# Notebooks that are not executed, as in the tests, name no language.
suppress_warnings = ["myst-nb.lexer"]
nb_merge_streams = True
nb_execution_raise_on_error = True
nb_execution_timeout = 120

html_math_renderer = "mathml"
html_theme = "furo"
html_title = "phasmid"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_theme_options = {"navigation_with_keys": True}

# The width of help texts.
os.environ["COLUMNS"] = "90"
write_reference(HERE / "reference")


def _skip(_app: Any, _what: str, _name: str, value: object, *_: Any) -> bool | None:
    """Leave out the fields of named tuples, which the text of the class describes."""
    return True if (value.__doc__ or "").startswith("Alias for field number") else None


def _write_math(translator: Any, node: Any) -> None:
    """Write an equation as MathML, which browsers draw without a script."""
    if isinstance(node, nodes.math):
        equation = convert(node.astext())
    else:
        equation = f'<div class="equation">{convert(node.astext(), display="block")}</div>'
    translator.body.append(equation)
    raise nodes.SkipNode


def _link_notebook(_app: Any, page: str, source: list[str]) -> None:
    """Link the notebook of a course page below its title; `build_site.py` writes the file."""
    folder, _, name = page.partition("/")
    if folder == "course" and name[0].isdigit():
        link = f'<p><a href="{name}.ipynb" download>Download this notebook</a></p>'
        source[0] = re.sub(r"^(# .*)$", rf"\1\n\n{link}", source[0], count=1, flags=re.MULTILINE)


def setup(app: Any) -> None:
    """Add how members are chosen and equations written."""
    app.connect("autodoc-skip-member", _skip)
    app.connect("source-read", _link_notebook)
    app.add_html_math_renderer("mathml", (_write_math, None), (_write_math, None))
