"""Estimate a unit's electrode readings without contact from recordings that may hold no quiet part at all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import TactileError
from ..recordings import Recording, read
from ..recordings.polarity import spread_out
from ..recordings.quiet import TARED_PDC, window_frames
from ..recordings.repair import fill
from ..recordings.rest_level import level
from ..recordings.signal_kind import detect, full_scale, in_counts
from ..recordings.signals import UNIT_DRIFT
from ..recordings.tables.column_map import ColumnMap
from ..sensors import COUNT_MAX, divider

FEWEST = 3  # recordings: of fewer nothing says how far a grip is from rest (assumed)
LEAST_PRESSED = 0.25  # share of the recordings, those of the lowest pressure, whose mean is taken for rest
SPREAD_OVER = 0.5  # share of the recordings whose range estimates the error of rest
LEAST_LOADED = 0.1  # share of a BioTac SP's highest readings of an electrode, whose median is the first rest (assumed)
FRAMES, STEPS = 500, 40  # frames used, evenly spread; steps of rest toward the residual (more change nothing)
SIZES = 0.5, 2.0  # least and largest size of a real contact's changes over a simulated one's (assumed)
SMALL = 1000.0  # counts, root of the sum of squares: smaller changes weigh less. Chosen on one half of 35 recordings
THICKNESSES = 1.0, 0.7, 0.5, 0.35  # of the films over a typical unit's, that are tried


@dataclass(frozen=True)
class UnitRest:
    """Readings of a unit without contact.
    counts : (19,); spread : (19,) counts, half the range of levels in the less pressed half of the recordings (or the
        middle half)
    pdc : counts of the fluid's pressure, None if the recordings have none
    recordings : number that counts are averaged over, 0 for a recording of the rest itself
    film : thickness, divided by a typical unit's, None if it was not looked for"""

    counts: np.ndarray
    spread: np.ndarray
    pdc: float | None
    recordings: int
    film: float | None = None


@dataclass(frozen=True)
class Simulated:
    """Changes (P, e) counts in simulated contacts of a unit that reads rest (e,) counts without contact."""

    changes: np.ndarray
    rest: np.ndarray


def find_rest(recordings: Sequence[Recording]) -> UnitRest:
    """Find one unit's rest in recordings that may all be of contacts.

    Each recording gives the electrodes' level while its fluid pressure is lowest; the least pressed quarter of the
    levels is averaged. If a recording has no PDC (fluid pressure), each electrode's median over the recordings is taken
    instead: that works while different contacts leave different electrodes unloaded (on two real fingers, trials 01 to
    03 of the PHAC set, 17 and 34 counts rms from the result by pressure; the least squeezed recordings by the sum of
    counts: 32 and 49). Raises TactileError for fewer than three recordings, and for recordings that are not raw."""
    if len(recordings) < FEWEST:
        advice = "Give more recordings of the unit, among them softly touched ones"
        raise TactileError("rest of the unit", f"{len(recordings)} recordings", f"at least {FEWEST}", advice)
    recordings = [_raw(one) for one in recordings]
    pressures = [one.pdc for one in recordings if one.pdc is not None and np.isfinite(one.pdc).all()]
    if len(pressures) < len(recordings):
        levels = np.array([level(one.electrodes) for one in recordings])
        low, middle, high = np.percentile(levels, [25, 50, 75], axis=0)
        return UnitRest(middle, (high - low) / 2, None, len(levels))
    levels, pressed = zip(*map(_least_pressed, recordings, pressures), strict=True)
    order = np.argsort(pressed, kind="stable")
    levels, pressed = np.array(levels)[order], np.array(pressed)[order]
    few = max(1, round(LEAST_PRESSED * len(levels)))
    half = levels[: max(2, round(SPREAD_OVER * len(levels)))]
    tared = any(np.median(pdc) < TARED_PDC for pdc in pressures)  # each to a zero of its own
    pdc = None if tared else float(pressed[:few].mean())
    return UnitRest(levels[:few].mean(axis=0), np.ptp(half, axis=0) / 2, pdc, few)


def read_rest(path: str, columns: ColumnMap | None = None) -> UnitRest:
    """Read the rest of a unit from a recording of it untouched; columns : map of its columns, or None. Raises
    TactileError for a recording that is not raw, or in which an electrode moves more than drift does."""
    recording = _raw(read(path, columns))
    readings, pressure = recording.electrodes, recording.pdc
    spread = np.ptp(np.quantile(readings, [0.01, 0.99], axis=0), axis=0)
    if spread.max() > UNIT_DRIFT:
        found = f"E{spread.argmax() + 1} moves by {spread.max():.0f} counts"
        raise TactileError(path, found, f"an untouched finger, at most {UNIT_DRIFT:g}", "Record it without contact")
    pdc = None if pressure is None else float(np.nanmedian(pressure))
    return UnitRest(level(readings), spread / 2, pdc, 0)


def find_rest_sp(recordings: Sequence[Recording], simulated: Simulated) -> UnitRest:
    """Find rest and film of a BioTac SP's unit in recordings that have no PDC and all begin in contact.

    Counts fall under load, so rest is first each electrode's median over the tenth of all frames in which it reads
    highest. The skin bulges there, so this is too high (in 35 slips by 57 to 258 counts): rest and film are then
    moved to those with which simulated contacts explain most of the changes. Tested on halves of 35 recordings and of
    six sets of grasps: the translation then explains a third to two thirds of the other half, and a tenth at most
    without (docs/units.md). ``spread`` is half the range of that tenth without its ends. Raises TactileError for
    fewer than three recordings or snapshots, and for recordings that are not raw."""
    contacts = sum(len(one) if np.isnan(one.time).all() else 1 for one in recordings)
    if contacts < FEWEST:
        advice = "Give more recordings of the unit, among them softly touched ones"
        raise TactileError("rest of the unit", f"{contacts} recordings", f"at least {FEWEST}", advice)
    readings = np.concatenate([_raw(one).electrodes for one in recordings])
    low, middle, high = np.quantile(readings, 1 - LEAST_LOADED * np.array([0.9, 0.5, 0.1]), axis=0)
    seen = readings[spread_out(len(readings), FRAMES)]
    moved = [_moved(seen, middle, simulated, film) for film in THICKNESSES]
    least = int(np.argmin([left for _, left in moved]))
    return UnitRest(moved[least][0], (high - low) / 2, None, contacts, THICKNESSES[least])


def _moved(readings: np.ndarray, rest: np.ndarray, simulated: Simulated, film: float) -> tuple[np.ndarray, float]:
    """Return rest (e,) counts moved to where simulated contacts explain readings (n, e) counts best, and the mean share
    of the changes' squares that they leave. film : thickness, divided by a typical unit's"""
    share = np.inf
    for _ in range(STEPS):
        change = readings - rest
        told = divider.of_unit(simulated.changes, rest, simulated.rest)
        told = divider.of_typical_film(told, rest, 1 / film)
        products, squares, whole = change @ told.T, np.square(told).sum(axis=1), np.square(change).sum(axis=1)
        size = np.clip(products / squares, *SIZES)
        left = whole[:, None] - 2 * size * products + size**2 * squares  # |change - size told|^2 of each pair
        row, nearest = np.arange(len(change)), left.argmin(axis=1)
        weight = 1 / np.maximum(whole, SMALL**2)
        share = float((left[row, nearest] * weight).mean())
        off = change - size[row, nearest][:, None] * told[nearest]
        rest = np.clip(rest + weight @ off / weight.sum(), 1.0, COUNT_MAX - 1.0)
    return rest, share


def _least_pressed(recording: Recording, pdc: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the recording's level (19,) counts in its window of lowest pressure, and that pressure, counts of PDC.
    pdc : (T,) counts, the recording's fluid pressure"""
    electrodes = recording.electrodes
    n = min(window_frames(recording.rate), len(electrodes))
    windows = np.convolve(pdc, np.full(n, 1 / n), mode="valid")
    start = int(np.argmin(windows))
    return level(electrodes[start : start + n]), float(windows[start])


def _raw(recording: Recording) -> Recording:
    """Return the recording repaired, its electrodes and PDC in counts. Raises TactileError for one of another kind than
    raw readings."""
    electrodes = fill(recording.electrodes, ~np.isfinite(recording.electrodes))
    unit, _ = full_scale(electrodes) or (1.0, "")
    electrodes = unit * electrodes
    kind, evidence = detect(electrodes)
    if kind != "raw":
        raise TactileError(recording.path, f"a {kind} recording ({evidence})", "raw counts, which have a rest to find")
    pdc = None if recording.pdc is None else in_counts(recording.pdc, unit, recording.sensor, [])
    return replace(recording, electrodes=electrodes, pdc=pdc)
