"""Write the file of paired contacts, compressed HDF5, the same bytes whoever made its blocks; and its card: counts,
hash and histograms, small enough to keep beside the code.
"""

from __future__ import annotations

import json
import os
import pathlib
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .. import sensors
from ..errors import TactileError
from ..files import atomic, checksummed
from ..files.hdf5_writer import new_hdf5
from ..files.provenance import sha256
from ..files.version import __version__
from ..sensors import PAIR, SOURCE, TARGET
from ..sensors.descriptor import NODES
from ..sensors.fluid_sensor import FALLS
from .pairs_file import FORMAT, KEEPABLE, SCALE, SHEET

if TYPE_CHECKING:
    import h5py

_DEPTHS_MM = (0, 0.05, 0.1, 0.2, 0.3, 0.45, 0.6, 0.9, 1.2, 1.6, 2.0, 2.4)
_FORCES_N = (0, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100)
_X_MM, _Z_MM = tuple(range(-21, 7, 3)), tuple(range(-10, 11, 4))
_TILTS_DEG = tuple(range(0, 46, 5))


def card(path: str | os.PathLike, source: str = SOURCE, target: str = TARGET) -> dict:
    """Return a file's card: scene, seed, sha256, counts, histograms, not its name; source, target : its sensors"""
    import h5py

    with h5py.File(path) as file:
        values = {name: file[name][()] for name in (*_READ, f"depth_{source}", f"depth_{target}", f"beyond_{target}")}
        names = json.loads(file.attrs["indenters"])
        attributes = {name: _plain(file.attrs[name]) for name in ("scene", "seed", "version", "electrodes")}
    force = np.linalg.norm(values["force"], axis=1)
    x, z, tilt, _ = values["place"].T
    places, _, _ = np.histogram2d(1e3 * x, 1e3 * z, bins=(_X_MM, _Z_MM))
    return {
        **attributes,
        "sha256": sha256(path),
        "contacts": len(force),
        "presses": len(np.unique(values["press"])),
        "contacts_by_indenter": {name: int((values["indenter"] == i).sum()) for i, name in enumerate(names)},
        "contacts_sliding": int(values["slide"].any(axis=1).sum()),
        f"contacts_beyond_{target}": int(values[f"beyond_{target}"].sum()),
        f"depth_{source}_mm": _histogram(1e3 * values[f"depth_{source}"], _DEPTHS_MM),
        f"depth_{target}_mm": _histogram(1e3 * values[f"depth_{target}"], _DEPTHS_MM),
        "force_n": _histogram(force, _FORCES_N),
        "tilt_deg": _histogram(np.degrees(tilt), _TILTS_DEG),
        "place_mm": {"x_edges": list(_X_MM), "z_edges": list(_Z_MM), "counts": places.astype(int).tolist()},
    }  # fmt: skip


def card_path(path: str | os.PathLike) -> pathlib.Path:
    """Return the path of the card of a file of pairs: ``<file>.card.json``."""
    path = pathlib.Path(path)
    return path.with_name(path.name + ".card.json")


_READ = ("force", "place", "slide", "press", "indenter")


def _histogram(values: np.ndarray, edges: tuple[float, ...]) -> dict[str, list]:
    """Return the numbers of values (n,) between edges; the first and the last number include what lies beyond."""
    counts, _ = np.histogram(np.clip(values, edges[0], edges[-1]), edges)
    return {"edges": list(edges), "counts": counts.tolist()}


def _plain(value: object) -> object:
    return value.item() if isinstance(value, np.generic) else value


def units(source: str = SOURCE, target: str = TARGET, keep: Sequence[str] = ()) -> dict[str, str]:
    """Return the unit of each dataset of a file, by name; its first axis counts contacts. Some are named after the two
    sensors. A place is (x, z) on the gel's plane, tilt and heading. keep : ``("traction",)`` adds tractions"""
    fields = {f"{word}_{sensor}": KEEPABLE[word] for word in keep for sensor in (source, target)}
    return fields | {
        f"displacement_{source}": "m", f"displacement_{target}": "m", "signal": "counts", "gap": "m", "force": "N",
        f"force_{target}": "N", "pressure": "Pa", f"depth_{source}": "m", f"depth_{target}": "m",
        "contact_center": "m", "place": "m, m, rad, rad", "slide": "m", f"contact_patch_{source}": "1",
        f"contact_patch_{target}": "1", f"beyond_{target}": "1", "press": "1", "indenter": "1",
    }  # fmt: skip


class Made(NamedTuple):
    """Origin of a file's contacts. scene : its text; indenters : their names; pair : source and target
    keep : ``("traction",)`` if the file holds the surfaces' tractions"""

    scene: str
    indenters: list[str]
    seed: int
    pair: tuple[str, str] = PAIR
    keep: Sequence[str] = ()


def merge(files: list[pathlib.Path], count: int, out: pathlib.Path, made: Made) -> None:
    """Join blocks, shards ``files`` in order, into the HDF5 file ``out`` of their first ``count`` contacts; it states
    their origin, ``made``. Raises TactileError if it cannot be written."""
    about = {
        "format": FORMAT, "scene": made.scene, "seed": made.seed, "version": __version__,
        "indenters": json.dumps(made.indenters),
        **{f"{sensor}{NODES}": sensors.sensor_surface(sensor).sha256 for sensor in made.pair},
        "polarity": FALLS, "electrodes": SHEET,
    }  # fmt: skip
    try:
        with atomic.new_file(out) as partial, new_hdf5(partial, about) as (file, disk):
            done, unit_of = 0, units(*made.pair, made.keep)
            for path in files:
                block = checksummed.read(path)
                take = min(int(block["count"]), count - done)
                for name in unit_of if take else ():
                    _append(file, name, unit_of[name], block[name][:take], count, done)
                done += take
                disk.check()
    except (OSError, RuntimeError) as error:  # h5py reports a full disk as either
        reason = getattr(error, "strerror", None) or str(error).split("\n")[0]
        advice = "Make room, then give the command again"
        raise TactileError(out, f"cannot be written ({reason})", "room for it", advice) from error


def _append(file: h5py.File, name: str, unit: str, values: np.ndarray, count: int, start: int) -> None:
    if name not in file:
        shape, chunk = (count, *values.shape[1:]), (min(32, count), *values.shape[1:])
        packed = {"compression": "gzip", "compression_opts": 1, "shuffle": True, "track_times": False}
        dataset = file.create_dataset(name, shape, values.dtype, chunks=chunk, **packed)
        dataset.attrs["unit"] = unit
        if values.dtype == np.int16 and name.startswith("displacement"):
            dataset.attrs["scale"] = SCALE
    file[name][start : start + len(values)] = values
