"""Sphinx's settings for the site of the documentation: `python3 scripts/dev.py docs` builds it, without network."""

from __future__ import annotations

import re
from typing import Any

import tactile_core

project = "tactile"
release = version = tactile_core.__version__
extensions = ["myst_parser", "sphinx.ext.autodoc"]
html_theme = "furo"
html_title = f"tactile {release}"
html_show_copyright = False
html_static_path, html_css_files = ["static"], ["wide.css"]
myst_heading_anchors = 3
# Pages also link to files of the repository beside docs/; tests/test_documentation.py checks that these exist.
suppress_warnings = ["myst.xref_missing"]
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
python_use_unqualified_type_names = True

_ARGUMENT = re.compile(r"^(\w+(?:, \w+)*) : (?=\S)")
_NEXT = re.compile(r"(?:;|  ) +(?=\w+(?:, \w+)* : \S)")  # before another argument in the same line


def list_arguments(app: Any, what: str, name: str, thing: object, options: Any, lines: list[str]) -> None:
    """Turn lines ``name : meaning`` of a docstring into a list, which reST would run together."""
    out: list[str] = []
    listed = False
    for line in (part for whole in lines for part in _NEXT.split(whole)):
        starts, goes_on = bool(_ARGUMENT.match(line)), listed and line.startswith("    ")
        if starts != listed and not goes_on:
            out.append("")
        listed = starts or goes_on
        # A name that ends in an underscore would be a link.
        out.append(_ARGUMENT.sub(r"- ``\1``: ", line) if starts else line[2:] if goes_on else line)
    lines[:] = out


def setup(app: Any) -> None:
    """Register the rewriting of docstrings."""
    app.connect("autodoc-process-docstring", list_arguments)
