"""Write ``frames.h5``: arrays of a converted recording, one row per frame, SI units, float32 (time: float64)."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import sensors
from ..files.hdf5_writer import new_hdf5
from ..files.version import __version__
from ..recordings import flags
from ..sensors import PAIR

if TYPE_CHECKING:
    import h5py

    from ..translation.answer import Answer

FORMAT = "tactile-frames-1"

# dataset -> (unit, meaning); T is the number of frames converted
ALWAYS = {
    "frame": ("1", "index of the frame in the recording, from 0; names its picture"),
    "time": ("s", "from the recording's first frame; attribute start_time: unix time of that frame, 0 if unknown"),
    "electrodes": ("count", "(T, 19) E1..E19 as read, bad samples repaired; attribute rest: reading without contact"),
    "force": ("N", "(T, 3) exerted by the object on the sensor, sensor frame; 0 without contact (not where rectified)"),
    "pressure": ("Pa", "rise of the fluid's, estimated from the electrodes alone; 0 where the force is"),
    "contact_center": ("m", "(T, 2) = (x, z) on the DIGIT after unrolling; NaN without contact"),
    "contact_normal": ("1", "(T, 3) unit normal of the resting skin at the dent, inward, sensor frame; NaN likewise"),
    "confidence": ("1", "0 (a guess) to 1"),
    "expected_error_biotac": ("m", "expected largest node error: half of such frames have less"),
    "expected_error_digit": ("m", "as much of the DIGIT's gel"),
    "error_bound_biotac": ("m", "largest node error that 95 of 100 such frames stay below"),
    "error_bound_digit": ("m", "as much of the DIGIT's gel"),
    "pressure_measured": ("Pa", "the fluid's, by PDC, over its level at rest; NaN where the recording has no PDC"),
    "explained": (
        "1",
        "share of the electrodes' change that the translated contact explains, below 0 worse than no change; NaN "
        "without contact",
    ),
    "flags": ("bits", "what is remarkable about a frame; attribute names: JSON, name -> bit"),
}
SAMPLES, SECOND = "samples", "second"  # what --samples and --contacts 2 ask for, no words of --keep
KEPT = {
    "latent": {
        "latent_signal": ("1", "(T, K) code of the electrodes (SVB)"),
        "latent_biotac": ("1", "(T, L) code of the BioTac's deformation (MVB)"),
        "latent_digit": ("1", "(T, L) code of the DIGIT's deformation (MVD)"),
    },
    "displacement": {
        "displacement_biotac": ("m", "(T, N, 3) of the nodes of sensors.biotac_surface()"),
        "displacement_digit": ("m", "(T, M, 3) of the nodes of sensors.digit_surface()"),
    },
    "height": {"height_map": ("m", "(T, 320, 240) of the gel seen by the camera; see pictures.height_map")},
    "image": {},
    "traction": {
        "traction_digit": (
            "Pa",
            "(T, M, 3) of the object on the resting gel: pattern from its displacement, size from force",
        ),
        "traction_force": ("N", "(T, 3) what traction_digit adds up to: as large as force, along the gel's own shear"),
    },
    "marker_motion": {
        "marker_motion": ("px", "(T, n, 2) right and down, of the gel's dots, row by row; attribute rest: n pairs, px")
    },
    SAMPLES: {
        "sample_center": ("m", "(T, S, 2) = (x, z) on the DIGIT of contacts that the frame may be as well; NaN: none"),
        "sample_force": ("N", "(T, S) of these contacts; 0 without contact"),
    },
    SECOND: {
        "second_center": ("m", "(T, 2) = (x, z) on the DIGIT of the weaker of two contacts; NaN without one"),
        "second_force": ("N", "(T, 3) of that contact; 0 without one. Displacements are those of both"),
    },
}
PICTURES = {"image": ("1", "(T, 320, 240, 3) sRGB pictures of the DIGIT")}  # in shards; elsewhere they are PNG files
# Displacements and codes are stored plain: measured on smooth dents, gzip saves 21 % of the bytes for 1.5 ms per frame
# (plain: 0.15 ms). Height maps, the largest and smoothest, are worth it.
PACKED = {
    "height_map": {"compression": "gzip", "compression_opts": 1, "shuffle": True},
    "image": {"compression": "gzip", "compression_opts": 4},
    "traction_digit": {"compression": "gzip", "compression_opts": 1, "shuffle": True},  # zero outside the patch
}
LARGE = 4096  # numbers per frame, from which on a shard gives each frame a chunk of its own


def kept(keep: Sequence[str], answer: Answer) -> tuple[str, ...]:
    """Return `keep`, words of --keep, with "samples" (other possible contacts) and "second" (contact) if asked for."""
    return (*keep, *[SAMPLES] * (answer.samples > 0), *[SECOND] * (answer.contacts > 1))


def arrays_of(keep: Iterable[str], *, shard: bool) -> dict[str, tuple[str, str]]:
    """Return name -> (unit, meaning) of the datasets in a file that keeps these words; a shard has pictures, too."""
    kept = [PICTURES if shard and word == "image" else KEPT[word] for word in keep]
    return {name: meaning for about in (ALWAYS, *kept) for name, meaning in about.items()}


def named(name: str, pair: tuple[str, str]) -> str:
    """Return a dataset's name with a pair (sensor, gel) in place of biotac and digit at its end."""
    stem, _, role = name.rpartition("_")
    sensor = dict(zip(PAIR, pair, strict=True)).get(role)
    return f"{stem}_{sensor}" if sensor else name


def described(meaning: str, pair: tuple[str, str]) -> str:
    """Return a dataset's meaning with a pair (sensor, gel) in place of BioTac and DIGIT."""
    for role, sensor in zip(PAIR, pair, strict=True):
        if role != sensor:
            meaning = meaning.replace(f"{role}_surface()", f"sensor_surface({sensor!r})")
            meaning = meaning.replace(sensors.title(role), sensors.title(sensor))
    count = sensors.electrode_count(pair[0])
    return meaning.replace("(T, 19) E1..E19", f"(T, {count}) E1..E{count}")


def netcdf_value(value: Any) -> Any:
    """Return an attribute as netCDF can hold it: a boolean as an integer, an array flat."""
    if isinstance(value, bool | np.bool_):
        return int(value)
    return value.ravel() if isinstance(value, np.ndarray) else value


class FramesFile:
    """Writer of the kept arrays to ``frames.h5``, part by part. Raises OSError if the disk refuses."""

    def __init__(
        self, path: Path, count: int, keep: tuple[str, ...], attributes: dict[str, Any], *, room: int = 0,
        pair: tuple[str, str] = PAIR,
    ) -> None:  # fmt: skip
        """Create the file.

        path : of the new file; count : T, number of frames; keep : words of `KEPT`; attributes : those of the file
        itself
        room : bytes before the HDF5 part: 0, or 512, 1024 ... for a shard's checksum; a shard holds pictures, too, and
            its large arrays have one chunk per frame; pair : names of the sensor that was read and the gel"""
        self._about = arrays_of(keep, shard=bool(room))
        self._count, self._framed, self._pair = count, bool(room), pair
        about = {"format": FORMAT, "tactile_core": __version__, **attributes}
        self._opened = new_hdf5(path, {name: netcdf_value(value) for name, value in about.items()}, room)

    def __enter__(self) -> FramesFile:
        self._file, self._disk = self._opened.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
        self._opened.__exit__(*error)

    def write(self, start: int, arrays: dict[str, np.ndarray]) -> None:
        """Write the kept ones of arrays, name -> (n, ...), for the rows from `start` on. Floats become float32."""
        for name, array in arrays.items():
            if name in self._about:
                own = named(name, self._pair)
                data = self._file[own] if own in self._file else self._create(name, array)
                data[start : start + len(array)] = array
                data.flush()  # else its chunks may lie elsewhere where another thread delays Python's letting go
        self._disk.check()

    def write_labels(self, labels: dict[str, np.ndarray]) -> None:
        """Write labels, name -> (T,) texts of the converted frames, to the group ``labels``, as UTF-8 text."""
        import h5py

        for name, column in labels.items():
            self._file.create_dataset(f"labels/{name}", data=column, dtype=h5py.string_dtype(), track_times=False)

    def annotate(self, name: str, **attributes: Any) -> None:
        """Add attributes to the dataset called `name` in the file; booleans become integers, arrays flat."""
        self._file[name].attrs.update({key: netcdf_value(value) for key, value in attributes.items()})

    def _create(self, name: str, array: np.ndarray) -> h5py.Dataset:
        kind = "float32" if array.dtype.kind == "f" and name != "time" else array.dtype  # an hour has 4e8 us
        packing = PACKED.get(name, {})
        large = self._framed and array[0].size >= LARGE
        chunks = (1, *array.shape[1:]) if packing or large else None
        shape = (self._count, *array.shape[1:])
        own = named(name, self._pair)
        data = self._file.create_dataset(own, shape, kind, chunks=chunks, track_times=False, **packing)
        unit, meaning = self._about[name]
        data.attrs.update({"unit": unit, "description": described(meaning, self._pair)})
        if name == "flags":
            data.attrs["names"] = json.dumps(flags.names())
        return data
