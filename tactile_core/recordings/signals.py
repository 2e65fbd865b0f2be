"""From a Recording to the signals that the networks see: repaired, tared, drift removed, everything reported."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import TactileError
from ..flags import Flag
from .electrode_faults import dead, saturated
from .kinds import KINDS, detect
from .quiet import Quiet, baseline, calmest, find_quiet, level, window_frames
from .recording import Recording
from .repair import fill, find_glitches, is_time_series
from .smoothing import LONGEST, RECTIFIED, SIGNED, smooth

# Counts that the 95th percentile of a scaled recording's largest changes is stretched to (networks.md).
SCALED_PEAK = 150.0
SHOWN = 8  # bad places spelled out one by one in the warnings


@dataclass(frozen=True)
class PrepareOptions:
    """What to override; None is automatic.

    kind : "raw", "tared", "scaled" or "rectified"
    tare : frames to take rest from, a slice or "A:B"; "none" takes the file's own zero; None finds quiet parts
    drift : remove drift between quiet parts
    repair : remove glitches (unreadable samples are always interpolated)
    counts_per_unit : factor from a scaled recording's unit to counts
    smooth : frames, odd, that the changes are averaged over round each; None: 3 of a rectified recording, else 1
    """

    kind: str | None = None
    tare: slice | str | None = None
    drift: bool = True
    repair: bool = True
    counts_per_unit: float | None = None
    smooth: int | None = None

    def check(self) -> None:
        """Raises TactileError for what no recording can meet; whether `tare` fits, a recording must say."""
        if self.kind is not None and self.kind not in KINDS:
            raise TactileError("option kind", repr(self.kind), ", ".join(KINDS))
        if self.counts_per_unit is not None and not 0 < self.counts_per_unit < 1e9:
            raise TactileError("option counts_per_unit", f"{self.counts_per_unit:g}", "counts a unit, above 0")
        if self.smooth is not None and not (1 <= self.smooth <= LONGEST and self.smooth % 2):
            raise TactileError("option smooth", f"{self.smooth} frames", f"an odd number from 1 to {LONGEST}")


@dataclass(frozen=True, eq=False)
class Signals:
    """Signals ready for the networks.

    change : (T, 19) float, counts, plain reading minus rest, drift removed, smoothed as told. Rectified: |change| minus
        its quiet level
    rest : (19,) float, counts, what the electrodes read without contact at the first frame
    drift : (19,) float, counts/s, mean slope of the rest level over the recording
    electrodes : (T, 19) float, counts: the readings after repair, before the tare
    kind : "raw", "tared", "scaled" or "rectified"
    quiet : (T,) bool, frames without contact that rest was taken from
    flags : (T,) uint16, the recording's and those found here
    warnings : the recording's and those found here
    report : what was found and done, fit for JSON
    """

    change: np.ndarray
    rest: np.ndarray
    drift: np.ndarray
    electrodes: np.ndarray
    kind: str
    quiet: np.ndarray
    flags: np.ndarray
    warnings: tuple[str, ...]
    report: dict[str, Any]


def prepare(recording: Recording, options: PrepareOptions | None = None) -> Signals:
    """Repair, detect the kind, tare, remove drift. Raises TactileError for options this recording cannot meet."""
    options = options or PrepareOptions()
    options.check()
    flags, warnings = recording.flags.copy(), list(recording.warnings)
    readings = fill(recording.electrodes, ~np.isfinite(recording.electrodes))
    kind, evidence = _kind(recording, readings, options)
    unit = _counts_per_unit(recording, readings, kind, options, warnings)
    readings = readings * unit
    glitches = _glitches(recording, readings, options, warnings)
    flags[glitches.any(axis=1)] |= np.uint16(Flag.REPAIRED)
    readings = fill(readings, glitches | ~np.isfinite(recording.electrodes))
    if kind == "rectified":
        flags |= np.uint16(Flag.RECTIFIED)
        warnings.append("the recording holds absolute changes (rectified): their sign is lost, and much of the place")
    quiet = _quiet(recording, readings, kind, options)
    rest = _rest(recording, readings, kind, quiet, options, warnings)
    if not quiet.parts:
        flags |= np.uint16(Flag.NO_QUIET_PART)
    flags |= saturated(recording, readings, kind, warnings) | dead(recording, readings, warnings)
    slope = (rest[-1] - rest[0]) / recording.duration if recording.duration > 0 else np.zeros(rest.shape[1])
    frames = _smoothed_over(options, kind)
    report = _report(recording, kind, evidence, options, unit, glitches, quiet, slope) | {"smoothed_frames": frames}
    return Signals(
        change=smooth(readings - rest, frames),
        rest=rest[0].copy(),
        drift=slope,
        electrodes=readings,
        kind=kind,
        quiet=quiet.mask,
        flags=flags,
        warnings=tuple(warnings),
        report=report,
    )


def _kind(recording: Recording, readings: np.ndarray, options: PrepareOptions) -> tuple[str, str]:
    if options.kind is None:
        return detect(readings)
    return options.kind, f"told by the user (the samples look {detect(readings)[0]})"


def _smoothed_over(options: PrepareOptions, kind: str) -> int:
    if options.smooth is None:
        return RECTIFIED if kind == "rectified" else SIGNED
    return options.smooth


def _counts_per_unit(
    recording: Recording, readings: np.ndarray, kind: str, options: PrepareOptions, warnings: list[str]
) -> float:
    """Factor to counts: 1, the user's, or for scaled recordings one that gives the usual size of a press (assumed)."""
    if options.counts_per_unit is not None:
        return float(options.counts_per_unit)
    if kind != "scaled":
        return 1.0
    largest = np.abs(readings - np.median(readings, axis=0)).max(axis=1)
    peak = float(np.percentile(largest, 95))
    factor = SCALED_PEAK / peak if peak > 1e-12 else 1.0
    warnings.append(
        f"the unit of this scaled recording is not known: stretched by {factor:.4g} to a press's usual {SCALED_PEAK:g}"
        " counts, so depths and forces are only relative; give counts_per_unit to fix it"
    )
    return factor


def _glitches(recording: Recording, readings: np.ndarray, options: PrepareOptions, warnings: list[str]) -> np.ndarray:
    """(T, 19) bool, samples to repair, told in the warnings."""
    none = np.zeros(readings.shape, bool)
    if not options.repair:
        return none
    found = find_glitches(readings)
    if not is_time_series(found):
        warnings.append(
            f"{found.any(axis=1).mean():.0%} of the frames look like glitches: neighbouring rows seem not to belong"
            " together, nothing was repaired"
        )
        return none
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


def _quiet(recording: Recording, readings: np.ndarray, kind: str, options: PrepareOptions) -> Quiet:
    if options.tare is None:
        return find_quiet(readings, recording.pdc, recording.rate, kind)
    if options.tare == "none":
        if kind == "raw":
            raise TactileError(
                "option tare",
                "'none' for a raw recording, which has no zero of its own",
                "frames A:B",
                "Name frames without contact, or leave the option out",
            )
        return Quiet(np.zeros(len(readings), bool), (), "the file's own zero, as told by the user")
    frames = _frames(options.tare, len(readings))
    mask = np.zeros(len(readings), bool)
    mask[frames] = True
    return Quiet(mask, ((frames.start, frames.stop),), "told by the user")


def _frames(tare: slice | str, count: int) -> slice:
    """The tare frames as a plain slice. Raises TactileError where they are not inside the recording."""
    asked = tare
    if isinstance(tare, str):
        ends = tare.split(":")
        try:
            tare = slice(*(int(end) if end.strip() else None for end in ends))
        except (ValueError, TypeError):
            ends = []
        if len(ends) != 2:
            raise TactileError("option tare", repr(asked), "frames A:B, such as 0:50, or 'none'")
    first = 0 if tare.start is None else tare.start + (count if tare.start < 0 else 0)
    last = count if tare.stop is None else tare.stop + (count if tare.stop < 0 else 0)
    if tare.step not in (None, 1) or not 0 <= first < last <= count:
        raise TactileError(
            "option tare",
            f"frames {asked if isinstance(asked, str) else f'{tare.start}:{tare.stop}'}",
            f"A:B inside the {count} frames of the recording, without a step",
            "Name frames without contact",
        )
    return slice(first, last)


def _rest(
    recording: Recording, readings: np.ndarray, kind: str, quiet: Quiet, options: PrepareOptions, warnings: list[str]
) -> np.ndarray:
    """(T, 19) counts that are subtracted."""
    if quiet.parts:
        return baseline(
            readings, quiet, options.drift and kind != "rectified"
        )  # drift of a rectified signal has no sign
    if options.tare == "none":
        warnings.append("no tare, as told: the file's own zero is taken for rest")
        return np.zeros(readings.shape)
    if kind == "raw":
        guess = calmest(readings, recording.pdc, recording.rate)
        warnings.append(
            f"no quiet part ({quiet.evidence}): rest is guessed from the calmest {guess.stop - guess.start} frames, "
            f"{guess.start}:{guess.stop}"
        )
        return np.broadcast_to(level(readings[guess]), readings.shape).copy()
    warnings.append(f"no quiet part ({quiet.evidence}): the file's own zero is taken for rest")
    return np.zeros(readings.shape)


def _report(
    recording: Recording,
    kind: str,
    evidence: str,
    options: PrepareOptions,
    unit: float,
    glitches: np.ndarray,
    quiet: Quiet,
    slope: np.ndarray,
) -> dict[str, Any]:
    unreadable = ~np.isfinite(recording.electrodes)
    return {
        "layout": recording.layout,
        "frames": len(recording),
        "rate_hz": round(recording.rate, 3),
        "duration_s": round(recording.duration, 3),
        "kind": kind,
        "kind_evidence": evidence,
        "counts_per_unit": unit,
        "tare": "none" if options.tare == "none" else "told" if options.tare is not None else "automatic",
        "tare_window_frames": window_frames(recording.rate),
        "quiet_parts": [list(part) for part in quiet.parts],
        "quiet_evidence": quiet.evidence,
        "drift_removed": bool(options.drift and len(quiet.parts) > 1 and kind != "rectified"),
        "drift_counts_per_s": [round(float(value), 4) for value in slope],
        "samples_interpolated": int(unreadable.sum()),
        "samples_glitch": int(glitches.sum()),
        "rows_repaired": _rows(recording.rows[(glitches | unreadable).any(axis=1)]),
    }


def _rows(rows: np.ndarray) -> Sequence[int]:
    return [int(row) for row in rows]
