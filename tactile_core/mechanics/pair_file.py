"""The file of paired contacts: HDF5 of compressed blocks, the same bytes whoever made them."""

from __future__ import annotations

import json
import pathlib

import numpy as np

from .. import __version__, atomic, pack, sensors
from ..errors import TactileError
from ..hdf5_disk import Disk

FORMAT = "tactile-pairs-1"
SCALE = 1e-7  # m a unit of the int16 displacements: 0.1 um steps, up to 3.2 mm

# Unit of each dataset; the leading axis counts contacts. A place is (x, z) on the DIGIT's plane, tilt and heading.
DATASETS = {
    "displacement_biotac": "m", "displacement_digit": "m", "signal": "counts", "gap": "m", "force": "N",
    "force_digit": "N", "pressure": "Pa", "depth_biotac": "m", "depth_digit": "m", "contact_center": "m",
    "place": "m, m, rad, rad", "slide": "m", "contact_patch_biotac": "1", "contact_patch_digit": "1",
    "beyond_digit": "1", "press": "1", "indenter": "1",
}  # fmt: skip


def merge(files: list[pathlib.Path], count: int, out: pathlib.Path, text: str, seed: int, names: list[str]) -> None:
    """One HDF5 file from the blocks in order, cut to ``count`` contacts; written beside and renamed."""
    try:
        _write_merged(files, count, out, text, seed, names)
    except (OSError, RuntimeError) as error:  # h5py reports a full disk as either
        raise no_room(out, error) from error


def _write_merged(files, count, out, text, seed, names) -> None:  # noqa: ANN001
    import h5py

    with atomic.new_file(out) as partial, Disk(partial) as disk, h5py.File(disk, "w") as file:
        file.attrs.update({
            "format": FORMAT, "scene": text, "seed": seed, "version": __version__, "indenters": json.dumps(names),
            "biotac_nodes_sha256": sensors.biotac_surface().sha256,
            "digit_nodes_sha256": sensors.digit_surface().sha256,
        })  # fmt: skip
        done = 0
        for path in files:
            block = pack.read(path)
            take = min(int(block["count"]), count - done)
            for name in DATASETS if take else ():
                _append(file, name, block[name][:take], count, done)
            done += take
            disk.check()


def _append(file, name: str, values: np.ndarray, count: int, start: int) -> None:  # noqa: ANN001
    if name not in file:
        chunk = (min(32, count), *values.shape[1:])
        dataset = file.create_dataset(
            name,
            (count, *values.shape[1:]),
            values.dtype,
            chunks=chunk,
            compression="gzip",
            compression_opts=1,
            shuffle=True,
            track_times=False,
        )
        dataset.attrs["unit"] = DATASETS[name]
        if values.dtype == np.int16 and name.startswith("displacement"):
            dataset.attrs["scale"] = SCALE
    file[name][start : start + len(values)] = values


def quantise(displacement: np.ndarray, scale: float = SCALE) -> np.ndarray:
    """Displacement in m as int16 steps of ``scale`` m."""
    return np.round(displacement / scale).astype(np.int16)


def no_room(path: pathlib.Path, error: OSError | RuntimeError) -> TactileError:
    """What is said where a file cannot be written."""
    reason = getattr(error, "strerror", None) or str(error).split("\n")[0]
    return TactileError(path, f"cannot be written ({reason})", "room for it", "Make room, then give the command again")
