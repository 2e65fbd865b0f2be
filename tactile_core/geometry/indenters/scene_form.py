"""Describe a shape, in its own file, to scenes and menus: its kind, its sizes in millimetres, its menu entry."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ...files.registry import modules_of
from .indenter import Indenter


@dataclasses.dataclass(frozen=True)
class Size:
    """A size of a shape as scene files give it.

    field : its name in scenes, which ends in its unit, ``_mm`` or ``_deg``; count : how many numbers it takes
    default : its value, in that unit, where a scene leaves it out; None: it must be given
    slider : name of the size in Blender's Add menu that sets it; empty: a new object has the default"""

    field: str
    default: float | None = None
    slider: str = ""
    count: int = 1

    def in_si(self, value: Any) -> Any:
        """Convert a scene's ``value``, a number or a tuple of them in the field's unit, to metres or radians."""
        if isinstance(value, tuple):
            return tuple(self.in_si(one) for one in value)
        return float(np.deg2rad(value)) if self.field.endswith("_deg") else value * 1e-3


@dataclasses.dataclass(frozen=True)
class SceneForm:
    """Entry of a shape in scenes and in Blender's Add menu; every module here with a ``SCENE`` of this type has one.

    kind : its name in scenes; says : what it is, in a line; sizes : argument of the shape -> its ``Size``, those
    without a default first; label, icon : of the menu's entry, which is left out without a label
    """

    kind: str
    shape: Callable[..., Indenter]
    says: str
    sizes: dict[str, Size]
    label: str = ""
    icon: str = ""

    def build(self, values: Mapping[str, Any]) -> Indenter:
        """Build the shape from values, mm or degrees, by ``Size.field``. Raises TactileError for an impossible body."""
        return self.shape(**{argument: size.in_si(values[size.field]) for argument, size in self.sizes.items()})


@functools.cache
def forms() -> dict[str, SceneForm]:
    """Return the ``SceneForm`` of each shape in this folder, by its kind."""
    found = [getattr(module, "SCENE", None) for module in modules_of(__name__.rpartition(".")[0]).values()]
    return {form.kind: form for form in found if form is not None}
