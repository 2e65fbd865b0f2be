"""The file of paired contacts: HDF5 of compressed blocks, the same bytes whoever made them; it is checked when read."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .. import accuracy, sensors
from ..errors import TactileError
from ..files.hdf5_checked import declared, open_checked
from ..sensors import PAIR
from ..sensors.descriptor import NODES, pair_of
from ..sensors.fluid_sensor import FALLS

if TYPE_CHECKING:
    import h5py

FORMAT = "tactile-pairs-2"
ADVICE = "Make the file again with `tactile pairs`"
SHEET = "sheet"  # the law of electrodes; older files may have another
ATTRIBUTES = ("electrodes", "indenters", "polarity", "scene", "seed", "version")  # and two of ``NODES``
MIN_PRESSES = 5  # at least three to train on, one to validate, one to test
# dataset of the pair that ships -> trailing shape and kind of numbers (i whole, f real, b yes or no); None: as many
# nodes as the surface has, or electrodes as the source has
DATASETS: dict[str, tuple[tuple[int | None, ...], str]] = {
    "displacement_biotac": ((None, 3), "i"),
    "displacement_digit": ((None, 3), "i"),
    "signal": ((None,), "f"),
    "force": ((3,), "f"),
    "pressure": ((), "f"),
    "contact_center": ((2,), "f"),
    "contact_patch_digit": ((None,), "b"),
    "depth_biotac": ((), "f"),
    "depth_digit": ((), "f"),
    "place": ((4,), "f"),
    "slide": ((2,), "f"),
    "press": ((), "i"),
    "indenter": ((), "i"),
}
# Smallest and largest median size of a fingertip's contacts, and its unit (assumed; single ones of ours reach 98 N).
SIZES = {
    "signal": (0.1, 2e3, "counts"), "force": (1e-3, 20.0, "N"), "pressure": (10.0, 1e6, "Pa"),
    "depth_biotac": (1e-5, 0.02, "m"), "depth_digit": (1e-5, 0.02, "m"),
}  # fmt: skip
SCALED = ("displacement_biotac", "displacement_digit")
SCALE = 1e-7  # m per unit of the int16 displacements: 0.1 um steps, up to 3.2 mm

KEEPABLE = {"traction": "Pa"}  # what a file may hold beside, of each sensor's surface, with its unit


@dataclass(frozen=True)
class Pairs:
    """Paired contacts, C of them. Displacements are the file's integers; times their scale they are metres.
    Fields are named after the pair that ships; for another ``pair`` they hold its source and target, and signals have
    as many columns as the source has electrodes.
    displacement_biotac : (C, N, 3) int16            displacement_digit : (C, M, 3) int16
    scale_biotac, scale_digit : m per unit           signal : (C, 19) float32 counts, noise-free change from rest
    force : (C, 3) float32 N, on the source          contact_center : (C, 2) float32 m, (x, z) on the DIGIT
    pressure : (C,) float32 Pa, rise of the fluid's
    depth_biotac, depth_digit : (C,) float32 m, from first touch
    contact_patch_digit : (C, M) bool                place : (C, 4) float32, (x, z) m, tilt and heading rad
    slide : (C, 2) float32 m, along the indenter's own axes, as of ``Step``
    press : (C,) int32, number of the press          indenter : (C,) int16, index in ``indenter_names``
    attributes : of the file, as text                sha256 : of the content, whatever the HDF5 layout"""

    displacement_biotac: np.ndarray
    displacement_digit: np.ndarray
    scale_biotac: float
    scale_digit: float
    signal: np.ndarray
    force: np.ndarray
    pressure: np.ndarray
    contact_center: np.ndarray
    contact_patch_digit: np.ndarray
    depth_biotac: np.ndarray
    depth_digit: np.ndarray
    place: np.ndarray
    slide: np.ndarray
    press: np.ndarray
    indenter: np.ndarray
    attributes: dict[str, str]
    sha256: str
    pair: tuple[str, str] = PAIR

    def select_rows(self, rows: np.ndarray) -> Pairs:
        """Return the contacts with indices rows (n,) alone."""
        return dataclasses.replace(self, **{name: getattr(self, name)[rows] for name in DATASETS})

    @property
    def indenter_names(self) -> list[str]:
        """Names of the indenters; ``indenter`` holds indices into them."""
        return json.loads(self.attributes["indenters"])


@dataclass(frozen=True)
class Split:
    """Indices (int), ascending, of the contacts to train on, validate on and test on; no press is in two of these."""

    train: np.ndarray
    validation: np.ndarray
    test: np.ndarray


def read_pairs(path: str | os.PathLike) -> Pairs:
    """Read and check a pairs file. Raises TactileError for one that is missing, truncated, or holds something else."""
    try:
        with open_checked(path) as file:
            found = str(file.attrs.get("format", ""))
            if found != FORMAT:
                raise TactileError(path, f"format {found!r}", f"format {FORMAT!r}", ADVICE)
            pair = pair_of(file.attrs, path, "pairs", ADVICE) or PAIR
            wanted = sorted((*ATTRIBUTES, *(f"{sensor}{NODES}" for sensor in pair)))
            missing = [name for name in wanted if name not in file.attrs]
            if missing:
                raise TactileError(path, f"no attribute {missing[0]}", ", ".join(wanted), ADVICE)
            attributes = {name: str(file.attrs[name]) for name in wanted}
            if attributes["polarity"] != FALLS:
                expected = f"{FALLS!r}, as raw counts do where a film thins"
                raise TactileError(f"{os.fspath(path)}, polarity", repr(attributes["polarity"]), expected, ADVICE)
            if attributes["electrodes"] != SHEET:
                where, found = f"{os.fspath(path)}, electrodes", repr(attributes["electrodes"])
                raise TactileError(where, found, f"{SHEET!r}, the law of electrodes", ADVICE)
            names = _named(pair)
            shapes = DATASETS | {"signal": ((sensors.electrode_count(pair[0]),), "f")}
            arrays = {name: _dataset(file, shapes[name], names, names[name], path) for name in DATASETS}
            scales = {name: _scale(file[names[name]], f"{os.fspath(path)}, {names[name]}") for name in SCALED}
    except TactileError:
        raise
    except Exception as error:  # h5py raises a dozen types on damaged bytes
        found = "cannot be read as HDF5, it is damaged or cut off" if os.path.exists(path) else "no such file"
        raise TactileError(path, found, "a whole HDF5 file of pairs", ADVICE) from error
    _check_values(arrays, path)
    if len(arrays["press"]):
        _check_sizes(arrays, scales, path)
    _check_names(attributes["indenters"], arrays["indenter"], path)
    digest = _content_hash(
        {names[name]: array for name, array in arrays.items()},
        {names[name]: scale for name, scale in scales.items()}, attributes,
    )  # fmt: skip
    return Pairs(
        scale_biotac=scales["displacement_biotac"],
        scale_digit=scales["displacement_digit"],
        attributes=attributes,
        sha256=digest,
        pair=pair,
        **arrays,
    )


def _named(pair: tuple[str, str]) -> dict[str, str]:
    """Return the file's name of each of ``DATASETS``; some are named after the pair's sensors."""
    of = dict(zip(PAIR, pair, strict=True))
    parts = {name: name.rpartition("_") for name in DATASETS}
    return {name: f"{stem}_{of[role]}" if role in of else name for name, (stem, _, role) in parts.items()}


def _dataset(
    file: h5py.File, form: tuple[tuple[int | None, ...], str], names: dict[str, str], name: str, path: str | os.PathLike
) -> np.ndarray:
    """Read the dataset `name`, checked for the kind and trailing shape of ``form``, from ``DATASETS``. names : all in
    the file"""
    place = f"{os.fspath(path)}, {name}"
    if name not in file:
        raise TactileError(place, "no such dataset", f"the datasets {', '.join(names.values())}", ADVICE)
    data, (shape, kind) = file[name], form
    expected = "(C, " + ", ".join("n" if size is None else str(size) for size in shape) + ")"
    fits = len(data.shape) == len(shape) + 1 and all(
        size in (None, found) and found > 0 for size, found in zip(shape, data.shape[1:], strict=True)
    )
    if not fits:
        raise TactileError(place, f"shape {data.shape}", expected, ADVICE)
    if data.dtype.kind != kind or (shape == (None, 3) and data.dtype != np.int16):
        expected = {"i": "int16", "f": "float32", "b": "bool"}[kind]
        raise TactileError(place, f"dtype {data.dtype}", expected, ADVICE)
    declared(data, place)
    values = data[:]
    return values.astype(np.float32) if kind == "f" else values


def _scale(data: h5py.Dataset, place: str) -> float:
    """Return the metres per unit of a displacement dataset; place : its file and name, for errors"""
    scale = np.asarray(data.attrs.get("scale", np.nan), np.float64)
    if scale.shape != () or not 0.0 < scale < 1.0:
        raise TactileError(place, f"scale {scale}", "metres per unit, a number above 0", ADVICE)
    return float(scale)


def _check_values(arrays: dict[str, np.ndarray], path: str | os.PathLike) -> None:
    """Raise TactileError unless all arrays have equally many rows, and only finite numbers."""
    count = len(arrays["press"])
    for name, array in arrays.items():
        if len(array) != count:
            raise TactileError(f"{os.fspath(path)}, {name}", f"{len(array)} contacts", f"{count} as in press", ADVICE)
        if array.dtype.kind == "f" and name != "contact_center" and not np.isfinite(array).all():
            bad = int(np.flatnonzero(~np.isfinite(array.reshape(count, -1)).all(-1))[0])
            raise TactileError(f"{os.fspath(path)}, {name}, contact {bad}", "NaN or infinite", "finite numbers", ADVICE)


def _check_sizes(arrays: dict[str, np.ndarray], scales: dict[str, float], path: str | os.PathLike) -> None:
    """Raise TactileError if the contacts' sizes show another unit, or a dent does not go inward with its depth.
    arrays : of the file, name -> (C, ...); scales : m per unit of the displacements"""
    sizes = arrays | {"force": accuracy.lengths(arrays["force"])}
    found = {name: float(np.median(np.abs(sizes[name]))) for name in SIZES}
    skin, gel = arrays["displacement_biotac"], arrays["displacement_digit"][:, :, 1]
    for name, dent in (("biotac", np.maximum(skin.max((1, 2)), -skin.min((1, 2)))), ("digit", gel.max(1))):
        share = scales[f"displacement_{name}"] * dent / np.maximum(arrays[f"depth_{name}"], 1e-9)
        found[f"displacement_{name}"] = float(np.median(share))
    for name, size in found.items():
        least, most, unit = SIZES.get(name, (0.4, 2.5, "times the depth, inward"))  # ours: .88 on gel, .80 on skin
        if not least <= size <= most:
            expected = f"{least:g} to {most:g} {unit}"
            raise TactileError(f"{os.fspath(path)}, {name}", f"a median of {size:.3g}", expected, ADVICE)


def _check_names(names: str, indenter: np.ndarray, path: str | os.PathLike) -> None:
    """Raise TactileError unless attribute `names` is a JSON list of texts, one for each number in `indenter` (C,)."""
    place = f"{os.fspath(path)}, attribute indenters"
    try:
        found = json.loads(names)
        if not isinstance(found, list) or not all(isinstance(name, str) for name in found):
            raise ValueError(f"a {type(found).__name__}")
    except (ValueError, RecursionError) as error:
        raise TactileError(place, str(error), "a JSON list of names", ADVICE) from error
    if indenter.size and not 0 <= indenter.min() <= indenter.max() < len(found):
        listed = f"{len(found)} names for numbers {indenter.min()} to {indenter.max()}"
        raise TactileError(place, listed, "a name for each number of the dataset indenter, from 0", ADVICE)


def _content_hash(arrays: dict[str, np.ndarray], scales: dict[str, float], attributes: dict[str, str]) -> str:
    """Return the SHA-256 over names, types, shapes and values of arrays, their scales (m per unit), and attributes."""
    digest = hashlib.sha256()
    for name, array in sorted(arrays.items()):
        digest.update(f"{name} {array.dtype.str} {array.shape}\n".encode())
        digest.update(np.ascontiguousarray(array).data)
    digest.update(repr((sorted(scales.items()), sorted(attributes.items()))).encode())
    return digest.hexdigest()


def split_presses(press: np.ndarray, seed: int, where: str | os.PathLike) -> Split:
    """Split contacts into 80 % training, 10 % validation, 10 % test by whole presses, as contacts of one are alike.
    press : (C,), each one's press, by number; seed : of the draw. Raises TactileError, naming where, for under five."""
    presses = np.unique(press)
    if len(presses) < MIN_PRESSES:
        advice = "Make more contacts with `tactile pairs --count`"
        raise TactileError(f"{os.fspath(where)}, press", f"{len(presses)} presses", f"at least {MIN_PRESSES}", advice)
    order = np.random.default_rng([seed, len(presses)]).permutation(presses)
    share = max(1, round(0.1 * len(presses)))
    groups = order[2 * share :], order[:share], order[share : 2 * share]
    return Split(*(np.flatnonzero(np.isin(press, group)) for group in groups))


def quantise(displacement: np.ndarray) -> np.ndarray:
    """Convert displacement (...) m to int16 steps of 0.1 um. Raises TactileError beyond 3.2767 mm."""
    steps = np.round(displacement / SCALE)
    if not np.all(np.abs(steps) <= np.iinfo(np.int16).max):  # false for NaN too
        found = f"{1e3 * np.abs(displacement).max():.2f} mm"
        raise TactileError("pairs, displacement", found, "at most 3.27 mm", "Lower depth_max_percent in the scene")
    return steps.astype(np.int16)
