"""Advise how to install an extra, by how this package was installed (its name is not on the package index); and import
the modules in a package: a format, layout, job or indenter is one file there."""

from __future__ import annotations

import importlib
import pkgutil
import re
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

PACKAGE = "tactile-core"


def advice(extra: str) -> str:
    """Return the command, for a message, that installs an extra: in the checkout, or each library by its own name."""
    root = checkout()
    size = " (torch on Linux fetches CUDA's libraries too, some GB)" if extra == "train" else ""
    if root is not None:
        return f'python -m pip install -c constraints.txt -e ".[{extra}]" in {root}{size}'
    found = libraries(extra)
    return f"python -m pip install {' '.join(found)}{size}" if found else f"the libraries of the extra [{extra}]"


def checkout() -> Path | None:
    """Return the folder of the checkout that this package runs from; None if it was installed from a wheel."""
    root = Path(__file__).resolve().parents[2]
    return root if (root / "pyproject.toml").is_file() and (root / "constraints.txt").is_file() else None


@contextmanager
def needing(extra: str) -> Iterator[None]:
    """If the block raises ModuleNotFoundError, add a note to it on how to install the extra that is missing."""
    try:
        yield
    except ModuleNotFoundError as error:
        error.add_note(f"Install it: {advice(extra)}")
        raise


def require(extra: str, library: str) -> None:
    """Raise ModuleNotFoundError, with how to install the extra, if its ``library`` is missing; import nothing."""
    with needing(extra):
        if find_spec(library) is None:
            raise ModuleNotFoundError(f"No module named {library!r}", name=library)


def libraries(extra: str) -> list[str]:
    """Return the requirements of an extra, quoted if a shell needs it; [] if the package has no metadata."""
    from importlib import metadata

    try:
        required = metadata.requires(PACKAGE) or []
    except metadata.PackageNotFoundError:
        return []
    names = []
    for line in required:
        name, _, marker = line.partition(";")
        if not re.search(rf"extra == ['\"]{re.escape(extra)}['\"]", marker):
            continue
        nested = re.fullmatch(rf"{PACKAGE}\[(.+)\]", name.strip())
        names += [each for part in nested[1].split(",") for each in libraries(part)] if nested else [name.strip()]
    return [f'"{name}"' if re.search(r"[<>=\[]", name) and not name.startswith('"') else name for name in names]


@cache
def modules_of(package: str) -> dict[str, ModuleType]:
    """Import all modules of a package, given by its full name; return name -> module, in the order of their names."""
    names = sorted(info.name for info in pkgutil.iter_modules(importlib.import_module(package).__path__))
    return {name: importlib.import_module(f"{package}.{name}") for name in names}
