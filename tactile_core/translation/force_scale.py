"""Find how stiff a unit's skin is from a measured force: one scale of force and pressure, judged on frames not fitted.
Signals cannot show it: a stiffer skin gives the same signals for the same dent, at a larger force and pressure."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Sequence

import msgspec
import numpy as np

from .. import accuracy
from ..errors import TactileError
from ..recordings import PrepareOptions, Recording, read
from ..recordings.electrode_gains import LEAST, MOST, ElectrodeGains
from ..recordings.force_file import read_force
from ..recordings.polarity import spread_out
from .translate import PreparedRows, translated_parts
from .translator import Translator

MOST_FRAMES = 3_000  # translated of a recording, evenly spread
FEWEST_FRAMES = 50  # beside a force, half a second (assumed)
LAGS = np.round(np.arange(-1, 1.001, 0.01), 2)  # s, of the force behind the electrodes, that are tried (assumed)
# Least correlation of measured and translated force of one touch, at the best lag: against the shipped recording's 180
# frames noise reaches .24, the time itself .33.
TOGETHER = 0.4
UNUSUAL = 3.0  # scale, or its inverse, that a unit hardly has: of raw counts .5 to 1.7 (of tared ones .2)
UNTOUCHED = 0.3  # share of the force in contact that a sensor may show without contact; more was not tared (assumed)
PARTS = 8  # of the frames; the scatter of their scales gives the scale's error


@dataclasses.dataclass(frozen=True)
class ForceScale:
    """Scale of the translated force that fits the first half of the frames best, judged on the other half.
    scale : measured over translated force; error : relative error of it, from the scatter of eighths of the frames
    lag : s, by which the force comes later than the electrodes; correlation : of the two forces, on the first half
    without, scaled, constant : N, mean absolute error on the second half: of the translated force, of the scaled one,
        and of the first half's median"""

    scale: float
    error: float
    lag: float
    correlation: float
    without: float
    scaled: float
    constant: float

    @property
    def better(self) -> bool:
        """Return true if the scaled force is nearer the measured one on the half that it was not fitted to."""
        return self.scaled < self.without and self.correlation >= TOGETHER

    def describe(self) -> str:
        """Describe the scale in words, with the errors that decide whether it is kept."""
        said = (
            f"measured over translated force {self.scale:.2f} (to {self.error:.0%}), lag {1e3 * self.lag:.0f} ms, "
            f"correlation {self.correlation:.2f} on the first half; mean error on the second half {self.scaled:.2f} N "
            f"with this scale, {self.without:.2f} N without, {self.constant:.2f} N of a constant force"
        )
        if not 1 / UNUSUAL <= self.scale <= UNUSUAL:
            said += "; is the force in newtons (1 lbf is 4.45 N, 1 ozf 0.28 N)?"
        if self.better:
            return f"stiffness: {said}"
        apart = self.correlation < TOGETHER
        why = "the two do not go together" if apart else "it makes the force no better where it was not fitted"
        return f"no stiffness is written, for {why}: {said}"


def with_stiffness(
    unit: ElectrodeGains, named: str, paths: Sequence[str], translator: Translator, options: PrepareOptions
) -> tuple[ElectrodeGains, str]:
    """Return the unit with the stiffness that a measured force shows, if that improves the force; and a text on the
    fit. Gains and offsets that do not improve the scaled force are dropped as well.
    paths : the unit's recordings; named : file of the force for the first of them, or columns that all have
    Raises TactileError for a force that cannot be read, too few frames in contact, and a scale that no unit has."""
    beside = paths[:1] if os.path.exists(named) else paths
    recordings = [read(path, options.columns, translator.source) for path in beside]
    forces = [read_force(named, recording) for recording in recordings]

    def found_of(one: ElectrodeGains) -> ForceScale:
        """Fit the scale and lag of the force that is translated with a unit's gains."""
        times, sizes = zip(*(_translated(translator, recording, one, options) for recording in recordings), strict=True)

        def measured(lag: float) -> np.ndarray:
            pairs = zip(times, forces, strict=True)
            return np.concatenate([np.interp(time + lag, *force, left=np.nan, right=np.nan) for time, force in pairs])

        return fit(np.concatenate(sizes), measured, named)

    found, count = found_of(unit), len(unit.gain)
    plain = msgspec.structs.replace(unit, gain=[1.0] * count, offset_counts=[0.0] * count)
    if plain != unit:
        without = found_of(plain)
        if without.scaled <= found.scaled:
            off = f"force is off by {found.scaled:.2f} N with them, by {without.scaled:.2f} N without"
            unit, found = msgspec.structs.replace(plain, note=f"{unit.note}; left at 1: {off}"), without
    if found.better:
        known = {"stiffness": round(found.scale, 4), "stiffness_error": round(found.error, 4)}
        unit = msgspec.structs.replace(unit, **known)
    return unit, found.describe()


def fit(translated: np.ndarray, measured: Callable[[float], np.ndarray], where: str) -> ForceScale:
    """Fit the scale of translated forces (n,) N, in order of time, to measured ones; where : name of these, for errors
    measured : function from a lag, s, to the forces (n,) N measured so much later, NaN if unknown"""
    half = len(translated) // 2
    correlations = {lag: _correlation(translated[:half], measured(lag)[:half]) for lag in map(float, LAGS)}
    lag = max(correlations, key=lambda one: (correlations[one], -abs(one)))
    force = measured(lag)
    known = np.isfinite(force) & (translated > 0)
    first, second = known.copy(), known.copy()
    first[half:] = second[:half] = False
    if min(first.sum(), second.sum()) < FEWEST_FRAMES:
        found = f"{first.sum()} and {second.sum()} frames in contact in the two halves"
        raise TactileError(where, found, f"at least {FEWEST_FRAMES} each", "Use a longer recording")
    idle, touching = force[np.isfinite(force) & (translated == 0)], float(np.median(force[known]))
    if len(idle) >= FEWEST_FRAMES and np.median(idle) > UNTOUCHED * touching:
        found = f"{np.median(idle):.2g} N where nothing touches, {touching:.2g} N in contact"
        raise TactileError(where, found, "no force without contact", "Take its reading without contact off each column")
    scale = _scale(translated[first], force[first])
    if not LEAST <= scale <= MOST:
        found = f"{scale:.3g} times the translated force: not newtons, or not of this finger"
        raise TactileError(where, found, f"{LEAST:g} to {MOST:g}", "Convert the force to newtons")
    parts = [_scale(translated[part], force[part]) for part in np.array_split(np.flatnonzero(known), PARTS)]

    def off(guess: np.ndarray | float) -> float:
        return float(np.abs(guess - force)[second].mean())

    return ForceScale(
        scale, float(np.std(parts)) / scale, lag, correlations[lag],
        off(translated), off(scale * translated), off(float(np.median(force[first]))),
    )  # fmt: skip


def _translated(
    translator: Translator, recording: Recording, unit: ElectrodeGains, options: PrepareOptions
) -> tuple[np.ndarray, np.ndarray]:
    """Return times (n,) s and sizes (n,) N of the translated force in frames spread evenly over a recording."""
    frames = spread_out(len(recording), MOST_FRAMES)
    rows = PreparedRows(recording, frames, translator.answer, options, unit)
    parts = translated_parts(translator, rows, frames)
    return recording.time[frames], np.concatenate([accuracy.lengths(part.force) for part in parts])


def _scale(translated: np.ndarray, force: np.ndarray) -> float:
    """Return the scale with which translated (n,) N has the least mean absolute error from force (n,) N: the median of
    the ratios, weighted by the translated force."""
    order = np.argsort(force / translated)
    reached = np.cumsum(translated[order])
    return float((force / translated)[order][np.searchsorted(reached, reached[-1] / 2)])


def _correlation(translated: np.ndarray, force: np.ndarray) -> float:
    known = np.isfinite(force)
    enough = known.sum() >= FEWEST_FRAMES and np.ptp(translated[known]) > 0 and np.ptp(force[known]) > 0
    return float(np.corrcoef(translated[known], force[known])[0, 1]) if enough else 0.0
