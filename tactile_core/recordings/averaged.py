"""Find recordings whose readings lack a finger's noise: moving averages, filtered ones, simulations without noise."""

from __future__ import annotations

import numpy as np

from .electrode_faults import TURNS, noise_turns, repeats
from .flags import Flag
from .polarity import TOUCHING
from .recording import BLOCK, Recording
from .rest_level import Framewise

# Share of samples at which readings turn, below which they lack noise. Rounded to counts half of 142 real recordings
# turn in .149 and more, the other half in .147; averaged over 50 rows in .03 at most, over 20 in .06; through a
# Butterworth filter of 20 Hz, which does no harm, in .033.
LEAST_TURNS = TURNS / 2
FEWEST_TURNS = 0.003  # averaged over 100 rows and more; through a filter of 10 Hz .003 to .007 in real recordings
AT = 100.0  # Hz at which turns are counted: rows interpolated to a higher rate are no averages
FEWEST = 100  # rows whose turns tell anything (assumed): a few rising ones have none
HALF = 0.25  # s to either side, within which averages of 50 rows mix readings
MOVES = 0.5  # share of a change by which it moves within them, to be doubted (assumed)
COARSE = 2.0  # counts between readings from which noise is lost in their steps, so that nothing is known


def averaged(recording: Recording, readings: np.ndarray, change: Framewise, warnings: list[str]) -> np.ndarray:
    """Return flags (T,) uint16. If readings lack a finger's noise, frames that move within half a second are
    OUT_OF_RANGE, since averages are wrong there; all frames are if no noise at all is left.
    readings : (T, e) counts; change : (T, e) counts against rest; warnings : list, extended if noise is missing"""
    flags = np.zeros(len(readings), np.uint16)
    if recording.simulated or not np.isfinite(recording.time).all():
        return flags
    turns = _turns(readings, recording.rate)
    if turns >= LEAST_TURNS:
        return flags
    warnings.append(
        "readings lack the noise of a finger: averaged, filtered, or simulated without noise. Where they move within "
        "half a second, averages of many rows give forces too low or too late, and are flagged: give raw readings"
    )
    if turns < FEWEST_TURNS:
        warnings.append("no noise at all is left, as by averages over a second: no frame is believed")
        return flags | np.uint16(Flag.OUT_OF_RANGE)
    half = max(1, round(HALF * recording.rate))
    for start in range(0, len(readings), BLOCK):
        rows = np.arange(start, min(start + BLOCK, len(readings)))
        before, after = np.maximum(rows - half, 0), np.minimum(rows + half, len(readings) - 1)
        moved = np.linalg.norm(change[after] - change[before], axis=1)
        moving = moved > np.maximum(TOUCHING, MOVES * np.linalg.norm(change[rows], axis=1))
        flags[rows[moving]] = np.uint16(Flag.OUT_OF_RANGE)
    return flags


def _turns(readings: np.ndarray, rate: float) -> float:
    """Return the share of samples at which readings (T, e) counts turn; 1 if too few tell it. rate : Hz"""
    step = max(1, round(rate / AT))
    whole = np.rint(readings[: BLOCK * step : step])
    whole = whole[~repeats(whole)[0]]
    if len(whole) < FEWEST:
        return 1.0
    moves = np.abs(np.diff(whole, axis=0))
    fine = bool((moves > 0).any()) and np.percentile(moves[moves > 0], 5) < COARSE
    return noise_turns(whole) if fine else 1.0
