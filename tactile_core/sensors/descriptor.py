"""Read and check a sensor's descriptor: the folder ``sensors/<name>/`` with ``sensor.toml`` and its tables.

A field's name ends in its unit; in Python it has the name without it, in SI units. Decimals are shifted to SI units
before they are rounded to floats, so that 20.06 mm is the number 20.06e-3 exactly.
"""

from __future__ import annotations

import dataclasses
import functools
import math
import os
import tomllib
import typing
from decimal import Decimal
from pathlib import Path
from typing import Any, TypeVar

from ..errors import TactileError
from ..files.text_file import read_toml_text

FOLDER = Path(__file__).parent
OWN = "TACTILE_SENSORS"  # environment variable: a folder with sensors of one's own
FILE, FORMAT = "sensor.toml", "tactile-sensor-1"
MOST_NODES = 300  # along a line of a lattice: a compliance of 90,000 nodes fits no memory
FALLS, RISES = POLARITIES = ("falls", "rises")
ROUND, SQUARE = TIPS = ("round", "square")

# Decimal places between a unit and SI; degrees become radians.
_UNITS = {
    "mm": -3,
    "um": -6,
    "mpa": 6,
    "pa": 0,
    "ohm": 0,
    "hz": 0,
    "s_per_m": 0,
    "pa_per_count": 0,
    "counts": 0,
    "deg": 0,
}
_OTHERS = ("m", "cm", "in", "kpa", "gpa", "bar", "kohm", "khz", "s", "ms", "rad", "n", "v", "mv")  # units often written
_T = TypeVar("_T")
_S = TypeVar("_S", "Fluid", "Gel")


def _in(unit: str = "", *, above: float = -math.inf, below: float = math.inf) -> Any:
    """A number's unit in the file, and the open interval in which it lies there."""
    return dataclasses.field(metadata={"unit": unit, "above": above, "below": below})


def _beside(*, or_none: bool = False) -> Any:
    """The name of a file beside the descriptor; empty, where it may be left out."""
    return dataclasses.field(metadata={"beside": True}, default="" if or_none else dataclasses.MISSING)


def _one_of(words: tuple[str, ...]) -> Any:
    return dataclasses.field(metadata={"words": words})


@dataclasses.dataclass(frozen=True)
class Material:
    """An isotropic elastic solid at small strain. youngs : Pa; poisson : below 0.5."""

    youngs: float = _in("mpa", above=0)
    poisson: float = _in(above=0, below=0.5)


@dataclasses.dataclass(frozen=True)
class Frame:
    """The maker's frame in the shared one: x = -x_maker - shift_x m, y = z_maker, z = lateral_sign y_maker."""

    shift_x: float = _in("mm")
    lateral_sign: int = _in(above=-2, below=2)


@dataclasses.dataclass(frozen=True)
class Skin:
    """A skin round an axis along x, from a table of its radii. Lengths in m, angles in rad.

    profile : table of stations x and angles, with the radii of outer skin, inner skin and core
    axis_y : of the axis (y, z) = (axis_y, 0); tip_x, base_x : between them the skin is a cylinder
    outer_poles, inner_poles : x where the meridians meet the axis, tip and base
    pad_half_angle : of the part that unrolls, to either side of the lowest line
    """

    profile: str = _beside()
    axis_y: float = _in("mm")
    tip_x: float = _in("mm")
    base_x: float = _in("mm")
    outer_poles: tuple[float, float] = _in("mm")
    inner_poles: tuple[float, float] = _in("mm")
    pad_half_angle: float = _in("deg", above=0, below=180)
    thickness: float = _in("mm", above=0)


@dataclasses.dataclass(frozen=True)
class Core:
    """The rigid core that holds the skin where it lies on it.

    attached : m, inner points this close to the core are glued to it; base_cap_x : m, from where on all are
    """

    attached: float = _in("mm", above=0)
    base_cap_x: float = _in("mm")


@dataclasses.dataclass(frozen=True)
class SkinLattice:
    """Node intervals of the skin's surface: along a meridian, and round the axis."""

    tip_rows: int = _in(above=1, below=MOST_NODES)
    trunk_rows: int = _in(above=1, below=MOST_NODES)
    base_rows: int = _in(above=1, below=MOST_NODES)
    pad_intervals: int = _in(above=1, below=MOST_NODES)
    back_intervals: int = _in(above=1, below=MOST_NODES)


@dataclasses.dataclass(frozen=True)
class FluidFilm:
    """The conducting fluid between core and skin.

    conductivity : S/m; interface : ohm, in series with every electrode; thinnest : m, film that is still known
    """

    conductivity: float = _in("s_per_m", above=0)
    interface: float = _in("ohm", above=-1)
    thinnest: float = _in("um", above=0)


@dataclasses.dataclass(frozen=True)
class Electrodes:
    """The electrodes on the core. places : table of names, places and counts at rest; radius : m"""

    places: str = _beside()
    radius: float = _in("mm", above=0)


@dataclasses.dataclass(frozen=True)
class Readout:
    """How counts come about: each electrode in a voltage divider with a load, read by a converter.

    polarity : what counts do where a film thins; pressure : Pa a count of the fluid's pressure
    """

    bits: int = _in(above=0, below=32)
    rate: float = _in("hz", above=0)
    load: float = _in("ohm", above=0)
    polarity: str = _one_of(POLARITIES)
    pressure: float = _in("pa_per_count", above=0)


@dataclasses.dataclass(frozen=True)
class Unrolling:
    """How the pad rolls onto the common plane. radius : m, of its cross-section; origin_x : m, where both share x"""

    radius: float = _in("mm", above=0)
    origin_x: float = _in("mm")


@dataclasses.dataclass(frozen=True)
class Outline:
    """The outline of a gel on the plane, even in z. Lengths in m.

    tip : ``"round"``, a half circle of half_width, or ``"square"``; corner_radius : of the corners of square ends
    """

    half_width: float = _in("mm", above=0)
    tip_x: float = _in("mm")
    base_x: float = _in("mm")
    corner_radius: float = _in("mm", above=-1e-9)
    tip: str = _one_of(TIPS)


@dataclasses.dataclass(frozen=True)
class Body:
    """A gel between its surface and its flat back, which is bonded to a rigid window. Lengths in m.

    thickness : at the apex; edge_drop, edge_width : of the rounded edge
    """

    back_y: float = _in("mm")
    thickness: float = _in("mm", above=0)
    edge_drop: float = _in("mm", above=-1e-9)
    edge_width: float = _in("mm", above=0)


@dataclasses.dataclass(frozen=True)
class Dome:
    """The height of a gel over its back. profile : table of heights

    degree_along, degree_across : of the polynomials through the table, in x, and in the square of z
    margin : m, outer edge of the table that is left out
    """

    profile: str = _beside()
    degree_along: int = _in(above=-1, below=30)
    degree_across: int = _in(above=-1, below=30)
    margin: float = _in("mm", above=-1e-9)


@dataclasses.dataclass(frozen=True)
class GelLattice:
    """Nodes of a gel's surface: an even window, m, and how many nodes lead from its edges to the outline."""

    window_x: tuple[float, float] = _in("mm")
    window_z: tuple[float, float] = _in("mm")
    window_nodes: tuple[int, int] = _in(above=1, below=MOST_NODES)
    rim_tip: int = _in(above=0, below=MOST_NODES)
    rim_base: int = _in(above=0, below=MOST_NODES)
    rim_side: int = _in(above=0, below=MOST_NODES)

    def __post_init__(self) -> None:
        """Raise TactileError for an even number of rows or columns, which quadratic cells do not fill."""
        rows = self.rim_tip + self.window_nodes[0] + self.rim_base
        columns = self.window_nodes[1] + 2 * self.rim_side
        if rows % 2 == 0 or columns % 2 == 0:
            found = f"{rows} rows and {columns} columns of nodes, rims included"
            raise TactileError("lattice, window_nodes", found, "odd numbers of both")


@dataclasses.dataclass(frozen=True)
class Camera:
    """What the camera looks at. height_zero_y : m, of the plane whose height is zero in pictures

    calibration : of a unit's camera and lights, see ``calibration_file``; empty where there is none
    """

    height_zero_y: float = _in("mm")
    calibration: str = _beside(or_none=True)


@dataclasses.dataclass(frozen=True)
class Fluid:
    """A finger of skin, fluid and core with electrodes, as the BioTac. title : its name in words"""

    folder: Path
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


@dataclasses.dataclass(frozen=True)
class Gel:
    """A gel on a window that a camera looks through, as the DIGIT. title : its name in words; dome : None for flat"""

    folder: Path
    title: str
    sources: tuple[str, ...]
    outline: Outline
    body: Body
    lattice: GelLattice
    material: Material
    camera: Camera
    dome: Dome | None = None

    def __post_init__(self) -> None:
        """Raise TactileError for a window that does not lie inside the outline, whose mesh would fold."""
        outline, (low, high) = self.outline, self.lattice.window_z
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


KINDS: dict[str, type[Fluid] | type[Gel]] = {"fluid": Fluid, "gel": Gel}


def _folders() -> dict[str, Path]:
    """Folders with a descriptor by their names: those that ship, and those in ``$TACTILE_SENSORS``."""
    own = os.environ.get(OWN)
    places = [Path(own), FOLDER] if own else [FOLDER]
    return {path.parent.name: path.parent for place in places for path in sorted(place.glob(f"*/{FILE}"))}


def names() -> tuple[str, ...]:
    """List the sensors that are there: those that ship, and folders of one's own in ``$TACTILE_SENSORS``."""
    return tuple(sorted(_folders()))


@functools.cache
def describe(name: str) -> Fluid | Gel:
    """Read the descriptor of a sensor that is there. Raises TactileError for a name that is none."""
    folder = _folders().get(name)
    if folder is None:
        raise TactileError(
            "sensor", repr(name), ", ".join(names()), f"Name one that is there, or put its folder into ${OWN}"
        )
    return read(folder)


def of_kind(name: str, form: type[_S]) -> _S:
    """Read the descriptor of a sensor of one kind, ``Fluid`` or ``Gel``. Raises TactileError for another's."""
    found = describe(name)
    if not isinstance(found, form):
        kinds = {form: kind for kind, form in KINDS.items()}
        raise TactileError(f"sensor {name!r}", f"of kind {kinds[type(found)]}", f"a sensor of kind {kinds[form]}")
    return found


def read(folder: Path) -> Fluid | Gel:
    """Read the descriptor in a folder.

    Raises TactileError naming file and field for one that is missing, unknown, in another unit or out of its range.
    """
    file = folder / FILE
    try:
        content = tomllib.loads(read_toml_text(file), parse_float=Decimal)
    except OSError as error:
        raise TactileError(file, f"cannot be read ({error.strerror})", "a sensor's descriptor") from error
    except (ValueError, RecursionError) as error:
        raise TactileError(file, str(error), "a sensor's descriptor") from error
    try:
        return _sensor(content, folder)
    except TactileError as error:
        raise TactileError(f"{file}, {error.where}", error.found, error.expected, error.advice) from error


def _sensor(content: dict[str, Any], folder: Path) -> Fluid | Gel:
    if content.get("format") != FORMAT:
        raise TactileError("format", repr(content.get("format")), repr(FORMAT))
    kind = content.get("kind")
    if not isinstance(kind, str) or kind not in KINDS:
        raise TactileError("kind", repr(kind), " or ".join(KINDS))
    form = KINDS[kind]
    types = {name: _required(hint) for name, hint in typing.get_type_hints(form).items()}
    fields = [field for field in dataclasses.fields(form) if field.name != "folder"]
    parts = [field.name for field in fields if field.name in content or field.default is dataclasses.MISSING]
    _check_names("top level", content, ("format", "kind", *parts))
    found = {
        name: _table(types[name], content[name], name) if dataclasses.is_dataclass(types[name])
        else _value(types[name], content[name], name, {})
        for name in parts
    }  # fmt: skip
    return form(folder=folder, **found)


def _required(hint: Any) -> Any:
    """The type of a field that may be left out, where it is there."""
    return next((each for each in typing.get_args(hint) if dataclasses.is_dataclass(each)), hint)


def _table(form: type[_T], content: Any, where: str) -> _T:
    if not isinstance(content, dict):
        raise TactileError(where, repr(content), "a table")
    types = typing.get_type_hints(form)
    fields = {
        key: field for field in dataclasses.fields(form)  # type: ignore[arg-type]
        if (key := _key(field)) in content or field.default is dataclasses.MISSING
    }  # fmt: skip
    _check_names(where, content, tuple(fields))
    return form(**{
        field.name: _value(types[field.name], content[key], f"{where}, {key}", field.metadata)
        for key, field in fields.items()
    })  # fmt: skip


def _key(field: dataclasses.Field) -> str:
    """A field's name in the file, which ends in its unit."""
    unit = field.metadata.get("unit")
    return f"{field.name}_{unit}" if unit else field.name


def _check_names(where: str, content: dict[str, Any], names: tuple[str, ...]) -> None:
    fields = f"the fields {', '.join(names)}"
    for name in sorted(set(content) - set(names)):
        for right in names:
            if right not in content and _without_unit(right) == _without_unit(name):
                raise TactileError(where, name, right, "Give the number in the unit that the field's name ends in")
        raise TactileError(where, f"unknown {name}", fields)
    missing = [name for name in names if name not in content]
    if missing:
        raise TactileError(where, f"{', '.join(missing)} missing", fields)


def _without_unit(name: str) -> str:
    for unit in sorted((*_UNITS, *_OTHERS), key=len, reverse=True):
        if name.endswith(f"_{unit}"):
            return name.removesuffix(f"_{unit}")
    return name


def _value(kind: Any, value: Any, where: str, meta: Any) -> Any:
    """A value of the file as a field's type, in SI units."""
    if typing.get_origin(kind) is tuple:
        items = typing.get_args(kind)
        length = None if items[-1] is Ellipsis else len(items)
        if not isinstance(value, list) or length not in (None, len(value)):
            raise TactileError(where, repr(value), "a list" if length is None else f"a list of {length}")
        return tuple(_value(items[0], item, where, meta) for item in value)
    if kind is str:
        words = meta.get("words")
        if not isinstance(value, str) or (words and value not in words):
            raise TactileError(where, repr(value), " or ".join(words) if words else "text")
        if meta.get("beside") and Path(value).name != value:
            raise TactileError(where, repr(value), "the name of a file beside the descriptor")
        return value
    return _number(kind, value, where, meta)


def _number(kind: type[float] | type[int], value: Any, where: str, meta: Any) -> float | int:
    whole = isinstance(value, int) and not isinstance(value, bool)
    if not whole and (kind is int or not isinstance(value, Decimal)):
        raise TactileError(where, repr(value), "a whole number" if kind is int else "a number")
    above, below, unit = meta["above"], meta["below"], meta["unit"]
    if not above < float(Decimal(value)) < below:  # also refuses nan
        limits = [f"above {above:g}"] * (above > -math.inf) + [f"below {below:g}"] * (below < math.inf)
        raise TactileError(where, str(value), " and ".join(limits) or "a finite number")
    if kind is int:
        return int(value)
    return math.radians(value) if unit == "deg" else float(Decimal(value).scaleb(_UNITS.get(unit, 0)))
