"""Find and interpolate faulty electrodes and rows: glitches, repeated rows, dead channels, unlikely rest counts.

A `recording` is as it was read: its rows name the places of faults in `warnings`, a list that the functions extend."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..errors import TactileError
from ..sensors import COUNT_MAX, divider, typical_rest
from .flags import Flag
from .recording import Recording
from .repair import END, SHORT, faded_ends, fill, find_glitches, is_time_series
from .signal_kind import FULL_SCALES, RAW_LEVEL, full_scale

DEAD_FRAMES = 100  # a channel with 0.7-1.5 counts of noise does not stand still for 1 s
# counts: a channel is dead if it stands still while half of all electrodes move by more. In 36 steady grips (PHAC,
# trials 01 to 03), in which units of little noise stand still too, the median moved by 4 at most
STEADY = 6.0
NOISY = 0.3  # share of the samples that differ from the one before: 0.6 at 0.7 counts of noise (assumed: half of it)
ALIKE = 0.75  # of the electrodes that read the same where a finger does not answer: a dead one may differ (assumed)
FROZEN = 50  # frames, half a second, of noise that stops in all electrodes (assumed)
SHOWN = 8  # bad places spelled out one by one in the warnings
MOST_STALE = 0.45  # of the rows; with more, they were recorded faster than the finger answers (assumed)
# Share of the samples at which a reading turns from rising to falling or back, by noise: .15 and more in 3 real units,
# .39 simulated with noise, below .02 without (assumed: between)
TURNS = 0.08
STALE = 3  # equal rows in a run: noise does not repeat in all electrodes (assumed)
# Largest ratio of an impedance at rest to a typical unit's, or of an electrode's ratio to the median one, or the
# reverse (assumed): .75 to 3.3 in real units, .45 to 3.4 in electrodes; one of 10 bits is at 9 and more, one in mV at 2
STRANGE_REST = 8.0
# Readings in mV look like counts at 3.3 to 4.3 times a typical unit's impedance. Its logarithms then spread over the
# electrodes by .36 to .68 of the typical unit's. Film and fluid change all alike: .95 to 1.6 in 4 real units, .66 in a
# fifth, at 1.8 times the impedance (assumed limits)
MILLIVOLTS, LEAST_SPREAD = 2.5, 0.55
MOST_ABSENT = 0.5  # of the electrodes; the others then say too little (assumed)


def without_absent(
    path: str, electrodes: np.ndarray, names: Sequence[str], sensor: str
) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Fill electrodes that a file lacks with a constant: a typical unit's rest, or 0 if the readings are not raw.

    electrodes : (T, e) float, in any unit of measurement, with NaN; names : their columns' names, "" for a missing one
    Returns the electrodes, a mask (e,) bool of filled ones, and a list of one sentence on them, or none. Raises
    TactileError if half of the electrodes are missing."""
    unread = ~np.isfinite(electrodes)
    empty = unread.all(axis=0) & (len(electrodes) >= DEAD_FRAMES) & ~unread.all()  # where all are, rows are to blame
    absent = np.array([not name for name in names]) | empty
    if not absent.any():
        return electrodes, absent, []
    named = named_electrodes(absent)
    if absent.mean() >= MOST_ABSENT:
        raise TactileError(path, f"no readings of {named}", "most of the electrodes", "Check the export of this file")
    held, rest = electrodes[np.isfinite(electrodes[:, ~absent]).all(axis=1)][:, ~absent], typical_rest(sensor)
    unit = full_scale(held) if len(held) else None
    raw = len(held) and (unit is not None or np.median(held) > RAW_LEVEL)
    electrodes = np.where(absent, 0.0 if rest is None or not raw else rest / (unit[0] if unit else 1.0), electrodes)
    return electrodes, absent, [f"the file has no readings of {named}: taken for dead channels"]


def silent(electrodes: np.ndarray) -> np.ndarray:
    """Return (T,) bool, true for frames in which the finger does not respond; up to a few in a row are a glitch.

    electrodes : (T, e) float, in any unit of measurement. A frame has no response if most electrodes read one end of
        the range, if nothing changes in the whole recording, or if the noise of all electrodes stops for `FROZEN`
        frames, which repeats an old response. (Only beside raw readings: changes against rest may all be 0.)"""
    same = _lasting(alike(electrodes))
    change = electrodes[1:] != electrodes[:-1]
    if same.all() or (len(electrodes) >= FROZEN and not change.any()):
        return np.ones(len(electrodes), bool)
    found = same | _frozen(electrodes, change & ~same[1:, None])
    if not found.any():
        return found
    answers = electrodes[~same]
    answers = answers[np.isfinite(answers).all(axis=1)]
    if not len(answers) or not (np.median(answers) > RAW_LEVEL or full_scale(answers)):
        return np.zeros(len(electrodes), bool)
    return found


def alike(electrodes: np.ndarray) -> np.ndarray:
    """Return (T,) bool, true where most electrodes (T, e), in any unit, read the same end of the range."""
    found = (electrodes[:, 1:] == electrodes[:, :-1]).any(axis=1)  # where most are the same, two neighbours are
    middle = np.median(electrodes[found], axis=1)
    same = (electrodes[found] == middle[:, None]).mean(axis=1) >= ALIKE
    found[found] = same & ((middle <= 0) | (middle >= COUNT_MAX) | np.isin(middle, list(FULL_SCALES)))
    return found


def _lasting(same: np.ndarray) -> np.ndarray:
    """Return same (T,) bool without the runs of true values that are as short as a glitch may be."""
    found = same.copy()
    for first, last in runs(same):
        longest = END if first == 0 or last == len(same) else SHORT
        found[first:last] = last - first > longest or last - first == len(same)
    return found


def runs(mask: np.ndarray) -> list[tuple[int, int]]:
    """Return the pairs (first frame, one past the last) of the runs of true values in a mask (T,)."""
    bounds = np.flatnonzero(np.diff(np.r_[False, mask, False].astype(int))).tolist()
    return list(zip(bounds[::2], bounds[1::2], strict=True))


def _frozen(electrodes: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Return (T,) bool, true in runs of `FROZEN` and more frames without a change, if the other frames are noisy.
    electrodes : (T, e) readings; change : (T - 1, e) bool, true if a reading differs from that of the frame before"""
    still = np.r_[False, ~change.any(axis=1)]
    found = np.zeros(len(still), bool)
    for first, last in runs(still):
        found[first:last] = last - first >= FROZEN
    return found if found.any() and noise_turns(electrodes[~still]) >= TURNS else np.zeros(len(still), bool)


def noise_turns(electrodes: np.ndarray) -> float:
    """Return the share of rows at which an electrode's readings turn from rising to falling or back, the median over
    electrodes (T, e), in any unit of measurement; 0 for fewer than three rows. No row may equal the one before."""
    moves = np.diff(electrodes, axis=0)
    return float(np.median(np.mean(moves[1:] * moves[:-1] < 0, axis=0))) if len(moves) > 1 else 0.0


def mended(
    recording: Recording, readings: np.ndarray, flags: np.ndarray, warnings: list[str], kind: str, *, repair: bool
) -> tuple[np.ndarray, np.ndarray, dict[str, Any]]:
    """Interpolate unreadable readings (T, e) counts and, if `repair` is true, glitches and, in a raw recording,
    repeated rows and ends that fade.
    Returns the readings, flags (T,) uint16 with REPAIRED and DEAD_CHANNEL added, and a report: samples_interpolated,
    samples_glitch, rows_repaired. kind : the recording's, such as "raw"; warnings : list, extended by what was found"""
    unreadable = ~np.isfinite(recording.electrodes)
    glitches, interpolated = np.zeros_like(unreadable), int(unreadable.sum())
    if repair:
        if kind == "raw" and np.isfinite(recording.time).all():  # others may stand still, and snapshots be alike
            (again, long), faded = _stale(recording, readings, warnings), faded_ends(readings)
            flags = flags | np.where(again, Flag.REPAIRED, 0).astype(np.uint16)
            flags |= np.where(long | faded, Flag.DEAD_CHANNEL, 0).astype(np.uint16)
            unreadable |= (again | faded)[:, None]
            if faded.any():
                warnings.append(
                    f"{faded.sum()} rows at the ends fade to half of their neighbours, all electrodes alike: averaged "
                    "with zeros beyond the ends? Not believed; average with the ends repeated, or not at all"
                )
        glitches = _glitches(recording, fill(readings, unreadable), warnings)
    flags = np.where(glitches.any(axis=1), flags | np.uint16(Flag.REPAIRED), flags)
    bad = glitches | unreadable
    return fill(readings, bad), flags, {
        "samples_interpolated": interpolated,
        "samples_glitch": int(glitches.sum()),
        "rows_repaired": recording.rows[bad.any(axis=1)].tolist(),
    }  # fmt: skip


def repeats(electrodes: np.ndarray) -> tuple[np.ndarray, bool]:
    """Return (T,) bool, true for rows of electrodes (T, e) that repeat the last; and true if these are faults."""
    same = np.r_[False, (electrodes[1:] == electrodes[:-1]).all(axis=1)]
    return same, bool(same.mean() <= MOST_STALE) and noise_turns(electrodes[~same]) >= TURNS


def _stale(recording: Recording, electrodes: np.ndarray, warnings: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """Return two masks (T,) bool of frames that repeat the row before, in runs of `STALE` and more equal rows: those in
    runs short enough to interpolate, and those in longer runs. The warnings are extended by a sentence on them.

    In electrodes (T, e) counts, whose noise should differ, these are lost packets or a driver that stood still."""
    found, long = np.zeros((2, len(electrodes)), bool)
    same, noisy = repeats(electrodes)
    again = [(first, last) for first, last in runs(same) if last - first >= STALE - 1] if noisy else []
    for first, last in again:
        (long if last - first > SHORT else found)[first:last] = True
    if again:
        longest = max(last - first for first, last in again)
        warnings.append(
            f"{(found | long).sum()} frames repeat the row before, up to {longest} in a run, first in "
            f"{recording.row_word} {recording.rows[again[0][0]]}: lost packets, or a driver that stood still; up to "
            f"{SHORT} in a run are interpolated"
        )
    return found, long


def _glitches(recording: Recording, readings: np.ndarray, warnings: list[str]) -> np.ndarray:
    """Return (T, 19) bool, true for samples of readings (T, 19) counts that are glitches; extend the warnings by these.
    None are if so many rows hold one that neighbouring rows seem not to belong together."""
    found = find_glitches(readings)
    if not is_time_series(found):
        warnings.append(
            f"{found.any(axis=1).mean():.0%} of the frames look like glitches: neighbouring rows seem not to belong"
            " together, nothing was repaired"
        )
        return np.zeros(readings.shape, bool)
    frames = np.flatnonzero(found.any(axis=1))
    for frame in frames[:SHOWN]:
        cells = [f"E{j + 1} {recording.electrodes[frame, j]:g}" for j in np.flatnonzero(found[frame])]
        warnings.append(f"{recording.row_word} {recording.rows[frame]}: glitch in {', '.join(cells)}; interpolated")
    if len(frames) > SHOWN:
        warnings.append(
            f"{len(frames) - SHOWN} more frames with glitches, the last in {recording.row_word}"
            f" {recording.rows[frames[-1]]}"
        )
    return found


def strange_rest(rest: np.ndarray, sensor: str, warnings: list[str]) -> bool:
    """Return true and add a warning if rest (e,) counts, or that of one electrode, is no rest of any of its units."""
    typical = typical_rest(sensor)
    if typical is None:
        return False
    own, usual = divider.film_impedance(rest), divider.film_impedance(typical)
    ratios, spread = own / usual, float(np.std(np.log(own)) / np.std(np.log(usual)))
    ratio = float(np.median(ratios))
    if MILLIVOLTS < ratio <= STRANGE_REST and spread < LEAST_SPREAD:
        warnings.append(
            f"electrodes rest at impedances {ratio:.2g} times a typical unit's and {spread:.2g} times as far apart, as "
            "no film makes them: readings in mV? (--counts-per-unit 1.241)"
        )
        return True
    if 1 / STRANGE_REST <= ratio <= STRANGE_REST:
        strange = (np.abs(np.log(ratios / ratio)) > np.log(STRANGE_REST)) & (rest > 0) & (rest < COUNT_MAX) | (rest < 0)
        if strange.any():
            warnings.append(
                f"{named_electrodes(strange)} at {', '.join(f'{each:.4g}' for each in rest[strange])} counts at rest, "
                "as no electrode is: broken, or in another unit of measurement than the others"
            )
        return bool(strange.any())
    warnings.append(
        f"electrodes rest at {np.median(rest):.0f} counts, an impedance {ratio:.2g} times a typical unit's, which no "
        "film gives: counts of another number of bits? (--counts-per-unit)"
    )
    return True


def saturated(recording: Recording, readings: np.ndarray, kind: str, warnings: list[str]) -> np.ndarray:
    """Return flags (T,) uint16: SATURATED if one of raw readings (T, 19) is at an end of 12 bits; extend warnings."""
    if kind != "raw":
        return np.zeros(len(readings), np.uint16)
    ends = (readings <= 0) | (readings >= COUNT_MAX)
    frames = np.flatnonzero(ends.any(axis=1))
    if len(frames):
        warnings.append(
            f"{named_electrodes(ends.any(axis=0))} at an end of the 12-bit range in {len(frames)} frames, first in "
            f"{recording.row_word} {recording.rows[frames[0]]}"
        )
    return np.where(ends.any(axis=1), Flag.SATURATED, 0).astype(np.uint16)


def dead(recording: Recording, readings: np.ndarray, warnings: list[str]) -> np.ndarray:
    """Return flags (T,) uint16: DEAD_CHANNEL if one of readings (T, 19) counts stands still; extend warnings."""
    still = _still(readings)
    whole = still.all(axis=0)
    if whole.any():
        warnings.append(f"{named_electrodes(whole)} never changes: dead channel")
    for j in np.flatnonzero(still.any(axis=0) & ~whole):
        frames = np.flatnonzero(still[:, j])
        warnings.append(
            f"E{j + 1} stands still in {len(frames)} frames, first in {recording.row_word} "
            f"{recording.rows[frames[0]]}: dead channel"
        )
    return np.where(still.any(axis=1), Flag.DEAD_CHANNEL, 0).astype(np.uint16)


def _still(readings: np.ndarray) -> np.ndarray:
    """Return (T, 19) bool, true for samples in runs of ``DEAD_FRAMES`` or more equal readings (T, 19) counts of an
    electrode. Unless it spans the whole recording, a run is no fault if the other electrodes hardly move in it, nor if
    the electrode rarely changes elsewhere."""
    still = np.zeros(readings.shape, bool)
    for j in range(readings.shape[1]):
        column = readings[:, j].copy()
        change = column[1:] != column[:-1]
        bounds = np.r_[0, np.flatnonzero(change) + 1, len(readings)]
        runs = np.flatnonzero(np.diff(bounds) >= DEAD_FRAMES)
        if not len(runs):
            continue
        for run in runs:
            first, last = bounds[run], bounds[run + 1]
            others_move = np.median(np.ptp(readings[first:last], axis=0)) > STEADY
            if last - first == len(readings) or others_move:
                still[first:last, j] = True
        moving = ~still[1:, j]
        if moving.any() and change[moving].mean() < NOISY:
            still[:, j] = False
    return still


def named_electrodes(mask: np.ndarray | np.bool) -> str:
    """Return the names of the electrodes that are true in a mask (19,) bool, as ``"E3, E7"``."""
    return ", ".join(f"E{j + 1}" for j in np.flatnonzero(mask))
