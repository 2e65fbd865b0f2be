"""Judge slides of a real BioTac: does translated force follow the fluid's pressure, which the translation never sees?
The protocol is that of the notes beside the public set BioTac_slide_20_50: a fourth-order Butterworth low-pass at 5 Hz,
forward and backward; rows within the time that the robot's wrench and pose cover; samples over 30 counts from the
median of 11 are replaced; and the part that the arm's place explains is subtracted before ranks are compared.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tactile_core import accuracy, sensors
from tactile_core.accuracy import Row, row
from tactile_core.errors import TactileError
from tactile_core.recordings import Recording, read
from tactile_core.recordings.repair import fill
from tactile_core.sensors import SAMPLE_RATE
from tactile_core.translation.translator import Translation

WRENCH_RATE = 150.0  # Hz, nominal; its even grid sets where a recording begins and ends
CUT = 5.0  # Hz
MEDIAN, GLITCH = 11, 30.0  # samples, counts
FEWEST = 100  # frames; a second, less than the filter's own length says nothing (assumed)
DEGREE = 3  # of the polynomial in the arm's place that is removed
CHOOSING = 7  # the sample of each material that may be looked at to choose settings and weights by
BIO, WRENCH, POSE = "_bio.csv", "_cw.csv", "_cp.csv"
CONTACT, SILENT = 15.0, 2.0  # PDC counts: surely in contact; contact lost (notes of the set)
CENTRE_FRAMES, SILENT_FRAMES = 100, 30  # fewer frames of a recording give no metric (protocol)
# Name of a row, its metric, unit of measurement, target (docs/sources.md, Targets), and the percentile over recordings.
ROWS = (
    ("force_rank_median", "rank", "1", 0.92, 50), ("force_rank_quartile", "rank", "1", 0.87, 25),
    ("force_silence", "silence", "1", 0.05, 50), ("contact_missed", "missed", "1", None, 50),
    ("centre_spread_along", "along", "mm", 0.9, 50), ("centre_spread_across", "across", "mm", 0.9, 50),
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Slide:
    """A recording, and the T of its frames that wrench and pose cover.

    time : (T,) unix s; arm : (T,) m, the arm's x; electrodes : (T, 19), pressure : (T,), counts, low-passed at 5 Hz
    """

    recording: Recording
    time: np.ndarray
    arm: np.ndarray
    electrodes: np.ndarray
    pressure: np.ndarray


def rows(
    folder: str | os.PathLike, translate: Callable[[Recording], Translation], most: int | None = None
) -> list[Row]:
    """Return rows on the ``reporting`` recordings of a folder that have wrench and pose beside them.

    translate : function from a recording to its translation; most : use the first so many alone, None for all
    Baselines: the electrodes' sum; for places their centroid, weighted by squared changes. Raises TactileError for a
    folder without such recordings, and for a recording that cannot be read."""
    whole = [path for path in reporting(folder)[:most] if all(beside(path, each).exists() for each in (WRENCH, POSE))]
    if not whole:
        raise TactileError(folder, "none with its _cw.csv and _cp.csv", "at least one", "Copy them beside it")
    judged = [metrics(slide, translate(slide.recording)) for slide in map(load, whole)]
    found = []
    for name, metric, unit, target, percent in ROWS:
        values = np.array([each[metric] for each in judged])
        known = values[np.isfinite(values[:, 0])]
        if len(known):
            value, baseline = np.nanpercentile(known, percent, axis=0).tolist()
            of, more = f"{len(known)} recordings", {"baseline": baseline, "at_least": metric == "rank"}
            found.append(row(f"recordings_{name}", value, unit, target, of=of, **more))
    return found


def reporting(folder: str | os.PathLike) -> list[Path]:
    """List the ``*_bio.csv`` in a folder and its subfolders, sorted. Sample 7 of each material is left out, since
    settings were chosen by it, unless there is nothing else. Raises TactileError if there is no such file."""
    folder = Path(folder)
    paths = sorted([*folder.glob(f"*{BIO}"), *folder.glob(f"*/*{BIO}")], key=lambda path: path.name)
    if not paths:
        raise TactileError(folder, f"no *{BIO}", "recordings of BioTac_slide_20_50", "Name the folder that holds them")
    return [path for path in paths if not path.name.endswith(f"_{CHOOSING}{BIO}")] or paths


def beside(path: Path, topic: str) -> Path:
    """Return the path of the file beside a recording's that ends in ``topic``, WRENCH or POSE."""
    return path.with_name(path.name.removesuffix(BIO) + topic)


def load(path: Path) -> Slide:
    """Read a recording with the wrench and pose files beside it. Raises TactileError if it has no PDC, or if under 100
    frames are in the time of all three."""
    recording, wrench, pose = read(path), _table(beside(path, WRENCH), 7), _table(beside(path, POSE), 4)
    time = recording.start_time + recording.time
    even = np.arange(wrench[0, 0], wrench[-1, 0], 1 / WRENCH_RATE)
    if recording.pdc is None or not len(even):
        raise TactileError(path, "no PDC, or a wrench without time", "a recording of BioTac_slide_20_50")
    inside = (time >= max(even[0], pose[0, 0])) & (time <= min(even[-1], pose[-1, 0]))
    if inside.sum() < FEWEST:
        found = f"{inside.sum()} frames in the time of its {WRENCH} and {POSE}"
        raise TactileError(path, found, f"at least {FEWEST}", "Check the time stamps of the three files")
    electrodes = replace_glitches(fill(recording.electrodes, ~np.isfinite(recording.electrodes)))
    pdc = fill(recording.pdc[:, None], ~np.isfinite(recording.pdc[:, None]))[:, 0]
    arm = np.interp(time[inside], pose[:, 0], pose[:, 1])
    return Slide(recording, time[inside], arm, lowpass(electrodes)[inside], lowpass(pdc)[inside])


def _table(path: Path, columns: int) -> np.ndarray:
    """Read numbers (n, columns) of a comma-separated file with a header. Raises TactileError if a cell is no number."""
    try:
        values = np.atleast_2d(np.genfromtxt(path, delimiter=",", skip_header=1, usecols=range(columns)))
    except (OSError, ValueError, UnicodeDecodeError) as error:
        raise TactileError(path, f"cannot be read ({error})", f"{columns} columns of numbers") from error
    if not len(values) or not np.isfinite(values).all():
        raise TactileError(path, "a cell without a number, or no rows", f"{columns} columns of numbers")
    return values


def replace_glitches(electrodes: np.ndarray) -> np.ndarray:
    """Replace samples of electrodes (T, 19) counts that are over 30 counts from the median of 11, by interpolation."""
    from scipy.ndimage import median_filter

    usual = median_filter(electrodes, (MEDIAN, 1), mode="nearest")
    return fill(electrodes, np.abs(electrodes - usual) > GLITCH)


def lowpass(values: np.ndarray) -> np.ndarray:
    """Low-pass values (T, ...), sampled at 100 Hz, at 5 Hz, without delay."""
    from scipy.signal import butter, filtfilt

    return filtfilt(*butter(4, CUT / (SAMPLE_RATE / 2)), values, axis=0)


def metrics(slide: Slide, found: Translation) -> dict[str, tuple[float, float]]:
    """Return metrics by name, each as (of the translation, of the electrodes alone): "rank", "silence", "missed", the
    share of touched time without a contact found, and "along" and "across", the spread of places, mm."""
    frames = slide.recording.start_time + slide.recording.time
    lost = ~np.isfinite(found.contact_center)
    columns = (accuracy.lengths(found.force), lost.any(axis=1), *1e3 * fill(found.contact_center, lost).T)
    force, missed, x, z = (np.interp(slide.time, frames, each) for each in columns)
    total, weights, touching = slide.electrodes.sum(axis=1), np.square(slide.electrodes), slide.pressure > CONTACT
    centroid = weights @ (1e3 * sensors.electrodes()[:, [0, 2]]) / np.maximum(weights.sum(axis=1, keepdims=True), 1e-9)
    strengths = lowpass(force), total
    spreads = spread(np.column_stack([x, z]), touching), spread(centroid, touching)
    return {
        "rank": tuple(rank(each, slide) for each in strengths),
        "silence": tuple(silence(each, slide.pressure < SILENT) for each in strengths),
        "missed": (float(missed[touching].mean()) if touching.any() else np.nan, 1.0),
        **dict(zip(("along", "across"), zip(*spreads, strict=True), strict=True)),
    }


def rank(strength: np.ndarray, slide: Slide) -> float:
    """Return the rank correlation of a smooth strength (T,) with the slide's pressure, after the part that follows the
    arm's place is subtracted from both."""
    return rank_correlation(without_pose(strength, slide.arm), without_pose(slide.pressure, slide.arm))


def rank_correlation(a: np.ndarray, b: np.ndarray) -> float:
    """Return Spearman's rank correlation of a and b, (T,) each; NaN if one of them does not change."""
    from scipy.stats import rankdata

    a, b = rankdata(a), rankdata(b)
    return float(np.corrcoef(a, b)[0, 1]) if min(a.std(), b.std()) >= 1e-9 else np.nan


def without_pose(values: np.ndarray, arm: np.ndarray) -> np.ndarray:
    """Return values (T,) less the cubic polynomial in the arm's place (T,) that fits them best."""
    powers = np.vander((arm - arm.mean()) / (arm.std() + 1e-12), DEGREE + 1)
    return values - powers @ np.linalg.lstsq(powers, values, rcond=None)[0]


def silence(strength: np.ndarray, lost: np.ndarray) -> float:
    """Return the median of a smooth strength (T,) while contact is lost (T,) bool, divided by its 95 % quantile; NaN if
    30 frames or fewer are lost."""
    if lost.sum() <= SILENT_FRAMES:
        return np.nan
    return float(np.median(strength[lost]) / np.percentile(strength, 95))


def spread(centre: np.ndarray, touching: np.ndarray) -> np.ndarray:
    """Return the standard deviation (2,) of centre (T, 2) while touching (T,) bool; NaN if that is too short."""
    return centre[touching].std(axis=0) if touching.sum() > CENTRE_FRAMES else np.full(2, np.nan)
