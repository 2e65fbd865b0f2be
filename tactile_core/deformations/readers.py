"""The registry of layouts, and the one way in."""

from __future__ import annotations

import importlib
import os
import pkgutil
from collections.abc import Iterator
from contextlib import ExitStack
from functools import cache
from types import ModuleType

from ..errors import TactileError
from ..hdf5_checked import open_checked
from ..recordings.store import damage_told
from . import formats
from .deformation import Deformation


@cache
def layouts() -> tuple[ModuleType, ...]:
    """All modules of ``formats/``, in the order of their names."""
    names = sorted(info.name for info in pkgutil.iter_modules(formats.__path__))
    return tuple(importlib.import_module(f"{formats.__name__}.{name}") for name in names)


def read(path: str | os.PathLike[str]) -> Iterator[Deformation]:
    """The frames of a file in the order of trial, step, environment and sensor; which layout is told from its names.

    Raises TactileError for a file that is no such HDF5 file, and for a frame that lacks a part.
    """
    path = os.fspath(path)
    with ExitStack() as stack:
        with damage_told(path, "HDF5"):
            file = stack.enter_context(open_checked(path))
        names: list[str] = []
        with damage_told(path, "HDF5"):
            file.visit(lambda name: names.append(name) if isinstance(name, str) else None)  # bytes: no UTF-8
        for layout in layouts():
            frames = sorted((found for name in names if (found := layout.PATTERN.fullmatch(name))), key=_place)
            if frames:
                for found in frames:
                    yield layout.read(file, found)
                return
    known = " | ".join(layout.NAME for layout in layouts())
    raise TactileError(path, "no known deformations", known, "Compare the names of its groups")


def _place(found: object) -> tuple:
    parts = found.groupdict()
    return int(parts.get("trial", 0)), int(parts["step"]), int(parts["environment"]), parts.get("sensor", "")
