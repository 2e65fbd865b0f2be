"""Read and check a sensor's descriptor: the folder ``sensors/<name>/`` with ``sensor.toml`` and its tables."""

from __future__ import annotations

import functools
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any, TypeVar

from ..errors import TactileError
from .fluid_sensor import Fluid
from .gel_sensor import GelSensor
from .toml_fields import read_table, read_toml

FOLDER = Path(__file__).parent
OWN = "TACTILE_SENSORS"  # environment variable: a folder with the user's own sensors
FILE, FORMAT = "sensor.toml", "tactile-sensor-1"
NODES = "_nodes_sha256"  # after a sensor's name in a file, the hash of its surface's nodes
_S = TypeVar("_S", Fluid, GelSensor)

KINDS: dict[str, type[Fluid] | type[GelSensor]] = {"fluid": Fluid, "gel": GelSensor}


def _folders() -> dict[str, Path]:
    """Return the folders that hold a descriptor, by their names: those that ship, and those in ``$TACTILE_SENSORS``."""
    own = os.environ.get(OWN)
    places = [Path(own), FOLDER] if own else [FOLDER]
    return {path.parent.name: path.parent for place in places for path in sorted(place.glob(f"*/{FILE}"))}


def passed_over(name: str) -> tuple[Path, ...]:
    """Return the user's folder of a sensor, one or none, that is ignored: a sensor that ships has the same name."""
    own, ships = os.environ.get(OWN), FOLDER / name
    folder = Path(own or FOLDER) / name
    return (folder,) if (folder / FILE).is_file() and (ships / FILE).is_file() and not folder.samefile(ships) else ()


def _advice() -> str:
    """Return advice on how to make a sensor known, and on what is wrong with the folder meant for the user's own."""
    own = os.environ.get(OWN)
    if own and (Path(own) / FILE).is_file():
        return f"${OWN} is {own}, a sensor's own folder: name the folder that holds it"
    if own and not Path(own).is_dir():
        return f"${OWN} is {own}, which is no folder: name the one that holds the sensor's"
    return f"Name a known one, or put its folder into ${OWN}"


def names() -> tuple[str, ...]:
    """Return the names of the known sensors, sorted: those that ship, and the user's own in ``$TACTILE_SENSORS``."""
    return tuple(sorted(_folders()))


def pair_of(keys: Iterable[str], where: str | os.PathLike, what: str, advice: str) -> tuple[str, str] | None:
    """Return the names of a file's sensor of skin and fluid and of its gel; None if its keys do not name two sensors.
    keys : the file's attributes, of which ``<name>_nodes_sha256`` name sensors
    where, what, advice : for errors: the file, its content in words, what to do
    Raises TactileError for an unknown sensor, and for two of the same kind."""
    of = sorted(key.removesuffix(NODES) for key in keys if key.endswith(NODES))
    if len(of) != 2:
        return None
    found, missing = f"{what} of {' and '.join(of)}", [name for name in of if name not in names()]
    if missing:
        put = f"Put the folder of {missing[0]} into the one that ${OWN} names"
        raise TactileError(where, found, f"of {', '.join(names())}", put)
    source, target = sorted(of, key=lambda name: isinstance(describe(name), GelSensor))
    if not isinstance(describe(source), Fluid) or not isinstance(describe(target), GelSensor):
        raise TactileError(where, found, "a sensor of skin and fluid, and a gel", advice)
    return source, target


def describe(name: str) -> Fluid | GelSensor:
    """Return the descriptor of a known sensor. Raises TactileError for an unknown name or a bad descriptor."""
    return _described(name if isinstance(name, str) else f"{name!r:.80}")


@functools.cache
def _described(name: str) -> Fluid | GelSensor:
    folder = _folders().get(name)
    if folder is None:
        raise TactileError("sensor", repr(name), ", ".join(names()), _advice())
    return read(folder)


def of_kind(name: str, form: type[_S]) -> _S:
    """Return the descriptor of the sensor ``name``, of the class ``form``, ``Fluid`` or ``GelSensor``. Raises
    TactileError for a sensor of the other kind."""
    found = describe(name)
    if not isinstance(found, form):
        kinds = {form: kind for kind, form in KINDS.items()}
        raise TactileError(f"sensor {name!r}", f"of kind {kinds[type(found)]}", f"a sensor of kind {kinds[form]}")
    return found


def read(folder: Path) -> Fluid | GelSensor:
    """Read the descriptor in a folder. Raises TactileError naming file and field for one missing, unknown or wrong."""
    return read_toml(folder / FILE, lambda content: _sensor(content, folder), "a sensor's descriptor")


def _sensor(content: dict[str, Any], folder: Path) -> Fluid | GelSensor:
    if content.get("format") != FORMAT:
        raise TactileError("format", repr(content.get("format")), repr(FORMAT))
    kind = content.get("kind")
    if not isinstance(kind, str) or kind not in KINDS:
        raise TactileError("kind", repr(kind), " or ".join(KINDS))
    tables = {key: table for key, table in content.items() if key not in ("format", "kind")}
    return read_table(KINDS[kind], tables, folder=folder)
