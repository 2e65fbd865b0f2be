"""Find what a folder holds: a format, layout, job or indenter is one file there."""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache
from types import ModuleType


@cache
def modules_of(package: str) -> dict[str, ModuleType]:
    """Import all modules of a package, given by its full name; return name -> module, in the order of names."""
    names = sorted(info.name for info in pkgutil.iter_modules(importlib.import_module(package).__path__))
    return {name: importlib.import_module(f"{package}.{name}") for name in names}
