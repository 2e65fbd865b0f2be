"""Descriptor of a finger of skin, fluid and core, such as the BioTac: ``Fluid``, and a class for each of its tables."""

from __future__ import annotations

import dataclasses
import itertools
from pathlib import Path

from ..errors import TactileError
from .toml_fields import IN_PYTHON, LARGEST_MM, LEAST_MM, MOST_NODES, Material, file_beside, number, one_of

MOST_ELECTRODES = 1000  # of a finger (assumed)
FALLS, RISES = POLARITIES = ("falls", "rises")


@dataclasses.dataclass(frozen=True)
class Frame:
    """Transformation from the maker's frame to the shared one, in m.
    x = -x_maker - shift_x, y = z_maker + shift_y, z = lateral_sign y_maker; lateral_sign : 1 or -1"""

    shift_x: float = number("mm")
    shift_y: float = number("mm")
    lateral_sign: int = number(above=-2, below=2)

    def __post_init__(self) -> None:
        """Raise TactileError for a sign of z other than +1 or -1."""
        if not self.lateral_sign:
            raise TactileError("frame, lateral_sign", "0", "1 or -1")


@dataclasses.dataclass(frozen=True)
class Skin:
    """A skin around an axis along x, from a table of its radii. Lengths in m, angles in rad.
    profile : file of the table: stations x and angles, and there the radii of outer skin, inner skin and core
    axis_y : y of the axis, whose z is 0; tip_x, base_x : ends of the part that is a cylinder
    outer_poles, inner_poles : x at which the meridians meet the axis, at tip and base
    pad_half_angle : of the part that unrolls, to either side of the lowest line; thickness : of the skin"""

    profile: str = file_beside()
    axis_y: float = number("mm")
    tip_x: float = number("mm")
    base_x: float = number("mm")
    outer_poles: tuple[float, float] = number("mm")
    inner_poles: tuple[float, float] = number("mm")
    pad_half_angle: float = number("deg", above=0, below=180)
    thickness: float = number("mm", above=LEAST_MM, below=LARGEST_MM)

    def __post_init__(self) -> None:
        """Raise TactileError for stations that do not run from the tip (-x) to the base."""
        (outer_tip, outer_base), (inner_tip, inner_base) = self.outer_poles, self.inner_poles
        along = outer_tip, inner_tip, self.tip_x, self.base_x, inner_base, outer_base
        if not all(low < high for low, high in itertools.pairwise(along)):
            found = ", ".join(f"{1e3 * each:g}" for each in along)
            expected = "growing: first outer_poles_mm, first inner_poles_mm, tip_x_mm, base_x_mm, then the last of both"
            raise TactileError("skin, along x", f"{found} mm", expected)


@dataclasses.dataclass(frozen=True)
class Core:
    """The rigid core, to which the skin is bonded in places.
    attached : m, inner nodes this close to the core are bonded to it
    tip_cap_x, base_cap_x : m, x beyond which all inner nodes are bonded
    contact_x, contact_half_angle : m and rad, part of the surface for which the distance to the core is tabulated
    facing_half_angle : rad, of the part of the skin that may touch the core"""

    attached: float = number("mm", above=0)
    tip_cap_x: float = number("mm")
    base_cap_x: float = number("mm")
    contact_x: tuple[float, float] = number("mm")
    contact_half_angle: float = number("deg", above=0, below=180)
    facing_half_angle: float = number("deg", above=0, below=180)


@dataclasses.dataclass(frozen=True)
class SkinLattice:
    """Numbers of intervals between the skin's surface nodes: along a meridian in tip, trunk and base (``*_rows``), and
    round the axis in pad and back (``*_intervals``)."""

    tip_rows: int = number(above=1, below=MOST_NODES)
    trunk_rows: int = number(above=1, below=MOST_NODES)
    base_rows: int = number(above=1, below=MOST_NODES)
    pad_intervals: int = number(above=1, below=MOST_NODES)
    back_intervals: int = number(above=1, below=MOST_NODES)


@dataclasses.dataclass(frozen=True)
class FluidFilm:
    """Fluid between core and skin. conductivity : S/m; interface : ohm, in series; thinnest : m, least film modelled"""

    conductivity: float = number("s_per_m", above=0)
    interface: float = number("ohm", above=-1)
    thinnest: float = number("um", above=0)


@dataclasses.dataclass(frozen=True)
class Electrodes:
    """The electrodes on the core. count : number that are read; radius : m, of each
    places : file of the table of their names, places and counts at rest, which ``electrodes`` reads
    contacts : file of counts by which simulated contacts change readings, which show a recording's polarity and faults;
        empty if only weights bring such
    contact_pressures : file of the fluid's pressure rise, Pa, in the same contacts; empty if unknown"""

    places: str = file_beside()
    count: int = number(above=0, below=MOST_ELECTRODES)
    radius: float = number("mm", above=0)
    contacts: str = file_beside(or_none=True)
    contact_pressures: str = file_beside(or_none=True)


@dataclasses.dataclass(frozen=True)
class Readout:
    """Voltage dividers and a converter. bits : of a count; rate : Hz, of frames
    load : ohm, a divider's fixed resistor
    polarity : "falls" or "rises", what raw counts do as a film thins; pressure : Pa per count of PDC"""

    bits: int = number(above=0, below=32)
    rate: float = number("hz", above=0)
    load: float = number("ohm", above=0)
    polarity: str = one_of(POLARITIES)
    pressure: float = number("pa_per_count", above=0)


@dataclasses.dataclass(frozen=True)
class Unrolling:
    """Unrolling of the pad onto the common plane. radius : m, of the pad's cross-section
    origin_x : m, the x of the pad that stays the same when it is unrolled"""

    radius: float = number("mm", above=0)
    origin_x: float = number("mm")


@dataclasses.dataclass(frozen=True)
class Fluid:
    """A finger of skin, fluid and core with electrodes, such as the BioTac. title : its name in words
    sources : where its numbers are from, in words; folder : that of its descriptor"""

    title: str
    sources: tuple[str, ...]
    frame: Frame
    skin: Skin
    core: Core
    lattice: SkinLattice
    material: Material
    fluid: FluidFilm
    electrodes: Electrodes
    readout: Readout
    unrolling: Unrolling
    folder: Path = dataclasses.field(metadata=IN_PYTHON)
