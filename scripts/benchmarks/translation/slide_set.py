"""Sliding recordings with the robot's wrench and pose beside them, on the common clock of the judging protocol.

The protocol is that of the notes beside the public set BioTac_slide_20_50: fourth-order Butterworth at 5 Hz forth and
back, rows within the time that wrench and pose cover, glitches over 30 counts from the median of 11 samples replaced.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tactile_core.errors import TactileError
from tactile_core.recordings import Recording, read
from tactile_core.recordings.repair import fill
from tactile_core.sensors import SAMPLE_RATE

WRENCH_RATE = 150.0  # Hz, nominal; its even grid sets where a recording begins and ends
CUT = 5.0  # Hz
HALF_MEDIAN, GLITCH = 5, 30.0  # samples to each side, counts
FEWEST = 100  # frames; a second, less than the filter's own length says nothing (assumed)
DEGREE = 3  # of the polynomial in the arm's place that is removed
CHOOSING = 7  # the sample of each material that may be looked at to choose settings and weights by
BIO, WRENCH, POSE = "_bio.csv", "_cw.csv", "_cp.csv"


@dataclass(frozen=True, eq=False)
class Slide:
    """The rows of a recording that wrench and pose cover.

    name : such as "mat3_7"; recording : the file as read, all of its rows
    time : (T,) unix s; arm : (T,) m, the arm's x
    electrodes : (T, 19) counts, glitches replaced; smooth : (T, 19) the same below 5 Hz
    pdc : (T,) counts as read; pressure : (T,) the same below 5 Hz
    """

    name: str
    recording: Recording
    time: np.ndarray
    arm: np.ndarray
    electrodes: np.ndarray
    smooth: np.ndarray
    pdc: np.ndarray
    pressure: np.ndarray


def find(folder: str | os.PathLike) -> list[Path]:
    """The ``*_bio.csv`` of a folder and of the folders in it, by name; raises TactileError where there is none."""
    folder = Path(folder)
    paths = sorted([*folder.glob(f"*{BIO}"), *folder.glob(f"*/*{BIO}")], key=lambda path: path.name)
    if not paths:
        raise TactileError(folder, f"no *{BIO}", "recordings of BioTac_slide_20_50", "Name the folder that holds them")
    return paths


def reporting(folder: str | os.PathLike) -> list[Path]:
    """List the recordings of `find` by which nothing is chosen: all but sample 7 of each material, or all of one.

    Raises TactileError where there is none.
    """
    paths = find(folder)
    return [path for path in paths if not path.name.endswith(f"_{CHOOSING}{BIO}")] or paths


def name_of(path: Path) -> str:
    """Return ``mat3_7`` of ``mat3_7_bio.csv``."""
    return path.name.removesuffix(BIO)


def is_whole(path: Path) -> bool:
    """Return true if wrench and pose lie beside a recording; without them its strength cannot be evaluated."""
    return all(path.with_name(name_of(path) + topic).exists() for topic in (WRENCH, POSE))


def load(path: Path) -> Slide:
    """Read a recording and what lies beside it. Raises TactileError: unreadable, no PDC, under 100 common frames."""
    recording = read(path)
    wrench, pose = (_table(path.with_name(name_of(path) + topic), n) for topic, n in ((WRENCH, 7), (POSE, 4)))
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
    return Slide(
        name_of(path), recording, time[inside], np.interp(time[inside], pose[:, 0], pose[:, 1]),
        electrodes[inside], lowpass(electrodes)[inside], pdc[inside], lowpass(pdc)[inside],
    )  # fmt: skip


def _table(path: Path, columns: int) -> np.ndarray:
    """Read numbers (n, columns) of a comma-separated file with a header; raises TactileError."""
    try:
        values = np.atleast_2d(np.genfromtxt(path, delimiter=",", skip_header=1, usecols=range(columns)))
    except (OSError, ValueError, UnicodeDecodeError) as error:
        raise TactileError(path, f"cannot be read ({error})", f"{columns} columns of numbers") from error
    if not len(values) or not np.isfinite(values).all():
        raise TactileError(path, "a cell without a number, or no rows", f"{columns} columns of numbers")
    return values


def replace_glitches(electrodes: np.ndarray) -> np.ndarray:
    """Interpolate the samples of (T, 19) counts that are further than 30 counts from their median of 11."""
    padded = np.pad(electrodes, ((HALF_MEDIAN, HALF_MEDIAN), (0, 0)), mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * HALF_MEDIAN + 1, axis=0)
    return fill(electrodes, np.abs(electrodes - np.median(windows, axis=-1)) > GLITCH)


def lowpass(values: np.ndarray) -> np.ndarray:
    """Keep what lies below 5 Hz of (T, ...) at 100 Hz, without delay."""
    from scipy.signal import butter, filtfilt

    return filtfilt(*butter(4, CUT / (SAMPLE_RATE / 2)), values, axis=0)


def without_pose(values: np.ndarray, arm: np.ndarray) -> np.ndarray:
    """Subtract from (T,) the cubic in the arm's place (T,) that fits it best."""
    powers = np.vander((arm - arm.mean()) / (arm.std() + 1e-12), DEGREE + 1)
    return values - powers @ np.linalg.lstsq(powers, values, rcond=None)[0]
