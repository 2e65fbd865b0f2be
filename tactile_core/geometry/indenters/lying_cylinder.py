"""A cylinder that lies on its side."""

from __future__ import annotations

import dataclasses
from typing import ClassVar

from ...errors import TactileError
from .cylinder import Cylinder
from .indenter import SceneForm, Size, check_length


@dataclasses.dataclass(frozen=True)
class LyingCylinder(Cylinder):
    """A cylinder along its own x that touches with its side. Lengths in m; ``edge`` is the radius of its rounded rims.

    length : whole, rims included; more than twice `edge`. An edge as large as the radius makes the ends half balls"""

    length: float = 20e-3
    axis: ClassVar[int] = 0

    def __post_init__(self) -> None:
        for name in ("radius", "edge", "length"):
            check_length("lying cylinder", name, getattr(self, name))
        if self.edge > self.radius or 2 * self.edge >= self.length:
            expected = "at most the radius and less than half the length"
            raise TactileError("lying cylinder, edge", f"{self.edge * 1e3:g} mm", expected)


SCENE = SceneForm(
    "lying_cylinder",
    LyingCylinder,
    "The side of a cylinder along the finger",
    {
        "radius": Size("radius_mm", slider="radius"),
        "edge": Size("edge_mm", 0.5, slider="edge"),
        "length": Size("length_mm", 20.0, slider="length"),
    },
    "Lying Cylinder",
    "MESH_CAPSULE",
)
