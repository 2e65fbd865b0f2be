"""Prepare a Recording's signals for the networks: repair them, subtract rest and drift, and report all of it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..errors import TactileError
from ..sensors import contacts_of
from ..sensors.descriptor import of_kind
from ..sensors.fluid_sensor import FALLS, Fluid
from .averaged import averaged
from .doubt import LAW, Doubt, Reason, without
from .electrode_faults import dead, mended, saturated, strange_rest
from .flags import Flag
from .polarity import Polarity, choose, polarity_of, polarity_of_sensor
from .quiet import TARED_PDC, Quiet, calmest, find_quiet, tare_frames, window_frames
from .recording import Recording
from .repair import fill, smooth
from .rest_level import Baseline, Changes, Framewise, baseline, level, pressure_rest
from .signal_kind import detect, full_scale, in_counts
from .signals import EVERY, PrepareOptions, Rest, Signals, typical
from .unit import contact_law, film
from .unit.contact_law import as_contact

# Frames to smooth over where the user gives none. Rectified signals need it: folded noise does not average out in the
# networks.
RECTIFIED, SIGNED = 3, 1
# Counts that the 95th percentile of a scaled recording's largest changes is stretched to (docs/sources.md, Networks).
SCALED_PEAK = 150.0


def prepare_all(recording: Recording, options: PrepareOptions, frames: slice | np.ndarray = EVERY) -> Signals:
    """Return a recording's signals: counts repaired, rest and drift subtracted, frames flagged, as the options say.
    Each frame must hold a response of the finger: the caller has removed others.
    frames : (n,) or slice, frames whose signals are returned; rest and flags are found from all"""
    flags, warnings = recording.flags.copy(), list(recording.warnings)
    readings = fill(recording.electrodes, ~np.isfinite(recording.electrodes))
    kind, evidence = _kind(recording, readings, options)
    unit = _counts_per_unit(recording, readings, kind, options, warnings)
    if unit != 1:
        readings = np.multiply(readings, unit, dtype=float)
        if options.kind is None and kind == "scaled" and detect(readings)[0] == "raw":
            kind, evidence = detect(readings)
    if kind == "raw" and recording.pdc is not None:
        recording = replace(recording, pdc=in_counts(recording.pdc, unit, recording.sensor, warnings))
    readings, flags, repaired = mended(recording, readings, flags, warnings, kind, repair=options.repair)
    if kind == "rectified":
        flags |= np.uint16(Flag.RECTIFIED)
        warnings.append("the recording holds absolute changes (rectified): their sign is lost, and much of the place")
    quiet = _quiet(recording, readings, kind, options)
    unit_rest = _unit_rest(recording, readings, kind, quiet, options, warnings)
    if unit_rest is None:
        rest = _rest(recording, readings, kind, quiet, options, warnings)
        if not quiet.parts or _is_loaded(recording, rest, kind, quiet, options, warnings):
            flags |= np.uint16(Flag.NO_QUIET_PART)
    else:
        rest = Baseline.constant(np.array(unit_rest.counts))
        quiet = Quiet(np.zeros(len(readings), bool), (), "the unit's own rest: no calm part near it")
    flags |= saturated(recording, readings, kind, warnings) | dead(recording, readings, warnings)
    if kind == "raw" and strange_rest(rest.at(np.array([0]))[0], recording.sensor, warnings):
        flags |= np.uint16(Flag.OUT_OF_RANGE)
    at_start, at_end = rest.at(np.array([0, len(recording) - 1]))
    slope = (at_end - at_start) / recording.duration if recording.duration > 0 else np.zeros(len(at_start))
    window = options.smooth or (RECTIFIED if kind == "rectified" else SIGNED)
    change = _changes(readings, rest, window)
    if kind == "raw":
        flags |= averaged(recording, readings, change, warnings)
    polarity = _polarity(recording, readings, change, kind, quiet, options, rest_known=unit_rest is not None)
    flags |= np.uint16(polarity.doubt)
    warnings += polarity.warnings
    if polarity.sign < 0:
        change = change.then(np.negative)
    pdc = _pressure_change(recording, kind, quiet, unit_rest)
    pressure, fluid = of_kind(recording.sensor, Fluid).readout.pressure * pdc, None
    if kind == "raw" and polarity.name == FALLS and (unit_rest is not None or quiet.parts):
        fluid = _film(recording, change, rest, pressure, options, own_rest=unit_rest is None)
    if fluid is not None:
        elsewhere = unit_rest is not None and any(unit_rest.spread)  # that of the part before has none
        change = fluid.changes(change, rest, ~(pressure > film.PRESSED) if elsewhere else None)
        warnings += fluid.warnings
    if recording.pdc is not None and not np.isfinite(recording.pdc).all():
        unread = int(np.sum(~np.isfinite(recording.pdc)))
        warnings.append(f"PDC has no number in {unread} of {len(recording)} frames: no pressure is known there")
    as_typical = change.then(lambda each: typical(each, kind, at_start, recording.sensor))
    flags, doubt = contact_law.flagged(as_typical, kind, quiet.mask, flags, pdc, recording.sensor)
    report = _report(recording, kind, evidence, options, unit, quiet, slope) | repaired | {
        "smoothed_frames": window, "polarity": polarity.name, "polarity_evidence": polarity.evidence,
        "film": None if fluid is None else fluid.report(),
    }  # fmt: skip
    return Signals(
        change=change[frames], rest=at_start.copy(), drift=slope, electrodes=readings[frames], kind=kind,
        quiet=quiet.mask[frames], flags=flags[frames], pdc=pdc[frames],
        warnings=(*warnings, *filter(None, [doubt])), report=report, sensor=recording.sensor,
        film=1.0 if fluid is None else fluid.thickness,
    )  # fmt: skip


def _film(
    recording: Recording, change: Changes, rest: Baseline, pressure: np.ndarray, options: PrepareOptions, *,
    own_rest: bool,
) -> film.Film | None:  # fmt: skip
    """Return the fluid film of a raw recording whose rest is known, by its contacts; for a sensor without simulated
    contacts the film in the options, or None.
    change, rest : (T, e) counts; pressure : (T,) Pa over rest, NaN if unknown
    own_rest : true if rest was found in this recording"""
    if contacts_of(recording.sensor) is None:
        return None if options.film is None else film.Film.given(options.film)
    return film.find(
        change, Changes(len(recording), rest.at), np.nan_to_num(recording.time),
        pressure if np.isfinite(pressure).any() else None, recording.sensor,
        thickness=options.film, own_rest=own_rest, drifts=options.drift,
    )  # fmt: skip


def doubt_law(signals: Signals) -> Signals:
    """Return the signals after checking anew whether their contacts, taken together, resemble simulated contacts of the
    sensor: if not, all frames in contact are flagged ``LAW_DOUBTED``, and a warning is added."""
    changes = Changes(len(signals.change), signals.typical_of)
    flags, doubt = contact_law.flagged(changes, signals.kind, signals.quiet, signals.flags, signals.pdc, signals.sensor)
    return replace(signals, flags=flags, warnings=(*without(signals.warnings, LAW), *filter(None, [doubt])))


def _changes(readings: np.ndarray, rest: Baseline, window: int) -> Changes:
    """Return the changes of readings (T, 19) against rest, smoothed over ``window`` frames."""
    change = Changes(len(readings), lambda frames: readings[frames] - rest.at(frames))
    return change if window == 1 else Changes(len(readings), smooth(change[EVERY], window).__getitem__)


def _kind(recording: Recording, readings: np.ndarray, options: PrepareOptions) -> tuple[str, str]:
    if options.kind is None:
        unit = full_scale(readings) if options.counts_per_unit is None else None
        return ("raw", f"{unit[1]}, all far above any change") if unit else detect(readings)
    return options.kind, f"given by the user (the samples look {detect(readings)[0]})"


def _unit_rest(
    recording: Recording, readings: np.ndarray, kind: str, quiet: Quiet, options: PrepareOptions, warnings: list[str]
) -> Rest | None:
    """Return the unit's own rest if no quiet part lies near it, since a calm level may be a steady grip; else None,
    also if no rest is given, if a tare is, and for another kind than "raw".
    readings : (T, e) counts; quiet : the recording's quiet parts; warnings : list, extended if the rest is returned"""
    if options.rest is None or kind != "raw" or options.tare is not None:
        return None
    reason = "no quiet part"
    if quiet.parts:
        still = level(readings[quiet.mask])
        pdc = np.nan if recording.pdc is None else float(np.median(recording.pdc[quiet.mask]))
        if options.rest.agrees(still, pdc):
            return None
        off = np.abs(still - np.array(options.rest.counts))
        reason = f"what is calm lies up to {off.max():.0f} counts from it (E{off.argmax() + 1})"
    warnings.append(Doubt(Reason.REST_OF_UNIT, found=reason))
    return options.rest


def _pressure_change(recording: Recording, kind: str, quiet: Quiet, unit_rest: Rest | None) -> np.ndarray:
    """Return PDC's change (T,) counts over its level at rest; NaN if the recording has no PDC."""
    if recording.pdc is None:
        return np.full(len(recording), np.nan)
    if unit_rest is not None and unit_rest.pdc is not None and not _is_tared(recording.pdc, unit_rest.pdc):
        return recording.pdc - unit_rest.pdc
    return recording.pdc - pressure_rest(recording.pdc, kind, quiet)


def _is_tared(pdc: np.ndarray, rest: float) -> bool:
    """Return true if pdc (T,) counts was tared: its median lies over `TARED_PDC` below the unit's rest, counts."""
    finite = pdc[np.isfinite(pdc)]
    return bool(len(finite)) and rest - float(np.median(finite)) > TARED_PDC


def _polarity(
    recording: Recording, readings: np.ndarray, change: Framewise, kind: str, quiet: Quiet, options: PrepareOptions,
    *, rest_known: bool,
) -> Polarity:  # fmt: skip
    if kind == "rectified":
        return Polarity(FALLS, "the sign is lost")
    if contacts_of(recording.sensor) is None:
        return choose(polarity_of_sensor(recording.sensor, kind), options.polarity, recording.about.get("polarity", ""))
    shown = polarity_of(change, quiet.mask, readings, recording.pdc, rest_known=rest_known, sensor=recording.sensor)
    return choose(shown, options.polarity, recording.about.get("polarity", ""))


def _counts_per_unit(
    recording: Recording, readings: np.ndarray, kind: str, options: PrepareOptions, warnings: list[str]
) -> float:
    """Return the factor from readings (T, e) to counts: the user's; for raw ones in volts or shares that of the range;
    for scaled ones that by which a press has its usual size (assumed); else 1. Extends the warnings."""
    if options.counts_per_unit is not None:
        return float(options.counts_per_unit)
    if kind == "raw" and (found := full_scale(readings)):
        warnings.append(
            f"electrodes are taken as {found[1]}: {found[0]:.5g} counts a unit (--counts-per-unit says else: 1000 "
            "where 3.315 stands for 3,315)"
        )
        return found[0]
    if kind != "scaled":
        return 1.0
    largest = np.zeros(len(readings))
    for column in readings.T:
        np.maximum(largest, np.abs(column - np.median(column)), out=largest)
    peak = float(np.percentile(largest, 95))
    factor = SCALED_PEAK / peak if peak > 1e-12 else 1.0
    warnings.append(
        f"the unit of this scaled recording is not known: stretched by {factor:.4g} to a press's usual {SCALED_PEAK:g}"
        " counts, so depths and forces are only relative; counts_per_unit fixes it: 4095 for shares of the range, 1241"
        " for volts of 3.3 V"
    )
    return factor


def _quiet(recording: Recording, readings: np.ndarray, kind: str, options: PrepareOptions) -> Quiet:
    if options.tare is None:
        return find_quiet(readings, recording.pdc, recording.rate, kind)
    if options.tare == "none":
        if kind == "raw":
            found, advice = "'none' for a raw recording, which has no zero of its own", "Name frames without contact"
            raise TactileError("option tare", found, "frames A:B", f"{advice}, or leave the option out")
        return Quiet(np.zeros(len(readings), bool), (), "the file's own zero, as asked for")
    frames = tare_frames(options.tare, len(readings))
    mask = np.zeros(len(readings), bool)
    mask[frames] = True
    return Quiet(mask, ((frames.start, frames.stop),), "given by the user")


def _rest(
    recording: Recording, readings: np.ndarray, kind: str, quiet: Quiet, options: PrepareOptions, warnings: list[str]
) -> Baseline:
    """Return the rest of readings (T, e) counts: of quiet parts, else a guess if raw, 0 if not, with a warning."""
    if quiet.parts:
        # drift of a rectified signal has no sign
        return baseline(readings, quiet, options.drift and kind != "rectified")
    if options.tare == "none":
        warnings.append("no tare, as asked for: the file's own zero is taken for rest")
        return Baseline.constant(np.zeros(readings.shape[1]))
    if kind == "raw":
        guess = calmest(readings, recording.pdc, recording.rate)
        frames = {"frames": guess.stop - guess.start, "first": guess.start, "last": guess.stop}
        warnings.append(Doubt(Reason.REST_GUESSED, found=quiet.evidence, **frames))
        return Baseline.constant(level(readings[guess]))
    warnings.append(Doubt(Reason.REST_OF_FILE, found=quiet.evidence))
    return Baseline.constant(np.zeros(readings.shape[1]))


def _is_loaded(
    recording: Recording, rest: Baseline, kind: str, quiet: Quiet, options: PrepareOptions, warnings: list[str]
) -> bool:
    """Return true, and add a warning, if a raw recording's rest is like a contact, and the user gave none."""
    if kind != "raw" or options.tare is not None or options.rest is not None:
        return False
    level_there = rest.at(np.array([quiet.parts[-1][0]]))[0]
    share = as_contact(level_there, recording.sensor, [recording.electrodes])
    if share is not None:
        warnings.append(Doubt(Reason.REST_LOADED, share=share))
    return share is not None


def _report(
    recording: Recording,
    kind: str,
    evidence: str,
    options: PrepareOptions,
    unit: float,
    quiet: Quiet,
    slope: np.ndarray,
) -> dict[str, Any]:
    return {
        "layout": recording.layout,
        "frames": len(recording),
        "rate_hz": round(recording.rate, 3),
        "duration_s": round(recording.duration, 3),
        "kind": kind,
        "kind_evidence": evidence,
        "counts_per_unit": unit,
        "tare": "none" if options.tare == "none" else "given" if options.tare is not None else "automatic",
        "tare_window_frames": window_frames(recording.rate),
        "quiet_parts": [list(part) for part in quiet.parts],
        "quiet_evidence": quiet.evidence,
        "drift_removed": bool(options.drift and len(quiet.parts) > 1 and kind != "rectified"),
        "drift_counts_per_s": [round(float(value), 4) for value in slope],
    }
