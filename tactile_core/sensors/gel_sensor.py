"""Descriptor of a gel on a window, such as the DIGIT's: ``GelSensor``, and a class for each of its tables."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

from ..errors import TactileError
from .toml_fields import IN_PYTHON, LARGEST_MM, LEAST_MM, MAY_MISS, MOST_NODES, Material, file_beside, number, one_of

ROUND, SQUARE = TIPS = ("round", "square")
ZERO_WITHIN = 0.2e-3  # m: a dome, fitted to a table, may be lower at its apex than the body says (assumed)


@dataclasses.dataclass(frozen=True)
class Outline:
    """The gel's outline on the plane, m: from x = tip_x to base_x, and |z| up to half_width.
    tip : "round", a half circle, or "square"; corner_radius : of the base's corners, and of a square tip's"""

    half_width: float = number("mm", above=LEAST_MM, below=LARGEST_MM)
    tip_x: float = number("mm")
    base_x: float = number("mm")
    corner_radius: float = number("mm", above=-1e-9)
    tip: str = one_of(TIPS)


@dataclasses.dataclass(frozen=True)
class Body:
    """A gel between its surface and a flat bonded back at y = back_y; all m. thickness : at the apex
    edge_drop, edge_width : by how much its surface falls toward the outline, and over what width"""

    back_y: float = number("mm")
    thickness: float = number("mm", above=LEAST_MM, below=LARGEST_MM)
    edge_drop: float = number("mm", above=-1e-9)
    edge_width: float = number("mm", above=0)


@dataclasses.dataclass(frozen=True)
class Dome:
    """The height of a domed gel over its back. profile : file of a table of heights
    degree_along, degree_across : of the fitted polynomials, in x, and in the square of z
    margin : m, width along the outline in which the table's heights are left out"""

    profile: str = file_beside()
    degree_along: int = number(above=-1, below=30)
    degree_across: int = number(above=-1, below=30)
    margin: float = number("mm", above=-1e-9)


@dataclasses.dataclass(frozen=True)
class GelLattice:
    """Nodes of a gel's surface. window_x, window_z : m, ends of the window, the part with even steps
    window_nodes : numbers of nodes along x and z in it
    rim_tip, rim_base, rim_side : numbers of nodes from the window's edges to the outline"""

    window_x: tuple[float, float] = number("mm")
    window_z: tuple[float, float] = number("mm")
    window_nodes: tuple[int, int] = number(above=1, below=MOST_NODES)
    rim_tip: int = number(above=0, below=MOST_NODES)
    rim_base: int = number(above=0, below=MOST_NODES)
    rim_side: int = number(above=0, below=MOST_NODES)

    def __post_init__(self) -> None:
        """Raise TactileError for an even number of rows or columns, which quadratic cells do not fill."""
        rows = self.rim_tip + self.window_nodes[0] + self.rim_base
        columns = self.window_nodes[1] + 2 * self.rim_side
        if rows % 2 == 0 or columns % 2 == 0:
            found = f"{rows} rows and {columns} columns of nodes, rims included"
            raise TactileError("lattice, window_nodes", found, "odd numbers of both")


@dataclasses.dataclass(frozen=True)
class CameraMount:
    """Place of the camera. height_zero_y : m, y of the plane from which pictures' heights count
    calibration : name of a unit's calibration file beside the descriptor, empty if there is none"""

    height_zero_y: float = number("mm")
    calibration: str = file_beside(or_none=True)


@dataclasses.dataclass(frozen=True)
class GelSensor:
    """A gel on a window that a camera looks through, such as the DIGIT. title : its name in words; dome : None for flat
    sources : where its numbers are from, in words; folder : that of its descriptor"""

    title: str
    sources: tuple[str, ...]
    outline: Outline
    body: Body
    lattice: GelLattice
    material: Material
    camera: CameraMount
    folder: Path = dataclasses.field(metadata=IN_PYTHON)
    dome: Dome | None = dataclasses.field(default=None, metadata=MAY_MISS)

    def __post_init__(self) -> None:
        """Raise TactileError for tables that contradict each other, such as a window outside the outline."""
        outline, (low, high) = self.outline, self.lattice.window_z
        if outline.corner_radius >= outline.half_width:
            found, expected = (f"{1e3 * each:g}" for each in (outline.corner_radius, outline.half_width))
            raise TactileError("outline, corner_radius_mm", found, f"below half_width_mm, {expected}")
        lowest = self.body.back_y - self.body.thickness
        if abs(self.camera.height_zero_y - lowest) > ZERO_WITHIN:
            expected = f"{1e3 * lowest:g}, back_y_mm less thickness_mm, within {1e3 * ZERO_WITHIN:g}"
            raise TactileError("camera, height_zero_y_mm", f"{1e3 * self.camera.height_zero_y:g}", expected)
        if not outline.tip_x < self.lattice.window_x[0] < self.lattice.window_x[1] < outline.base_x:
            expected = f"growing, between {1e3 * outline.tip_x:g} and {1e3 * outline.base_x:g} mm"
            raise TactileError("lattice, window_x_mm", _mm(self.lattice.window_x), expected)
        straight = outline.half_width - outline.corner_radius  # of a square end
        if not (low == -high and 0 < high < straight):
            expected = f"even about 0, below {1e3 * straight:g} mm, half_width_mm less corner_radius_mm"
            raise TactileError("lattice, window_z_mm", _mm(self.lattice.window_z), expected)
        beyond = math.hypot(outline.tip_x + outline.half_width - self.lattice.window_x[0], high)
        if outline.tip == ROUND and beyond >= outline.half_width:
            raise TactileError("lattice, window_x_mm", _mm(self.lattice.window_x), "corners inside the round tip")


def _mm(lengths: tuple[float, ...]) -> str:
    return f"[{', '.join(f'{1e3 * each:g}' for each in lengths)}]"
