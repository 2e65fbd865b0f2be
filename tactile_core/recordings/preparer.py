"""Prepare a recording's signals, whole or part after part, with its unit's rest and gains. Frames in which the finger
does not respond get a change of 0 and a flag."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import TactileError
from ..sensors import SOURCE, electrode_count, typical_rest
from ..sensors.fluid_sensor import FALLS
from .assemble import check_electrodes
from .doubt import POLARITY, REST, Doubt, Reason, reason_of, without
from .electrode_faults import silent as silent_frames
from .flags import Flag
from .polarity import AUTO
from .preparation import prepare_all
from .quiet import tare_frames
from .recording import Recording
from .rest_level import Baseline, Changes
from .signals import EVERY, FRAMEWISE, PrepareOptions, Rest, Signals
from .unit import film

if TYPE_CHECKING:
    from .electrode_gains import ElectrodeGains

DOUBTS = np.uint16(Flag.POLARITY_ASSUMED | Flag.POLARITY_DOUBTED)


def prepare(recording: Recording, options: PrepareOptions | None = None, frames: slice | np.ndarray = EVERY) -> Signals:
    """Return a recording's signals: glitches repaired, the kind of readings detected, rest and drift subtracted.
    frames : (n,) or slice, frames whose signals are returned; all frames of the recording decide the result
    Raises TactileError for options that this recording cannot meet."""
    options = options or PrepareOptions()
    options.check()
    recording.check()
    check_electrodes(recording.path, recording.electrodes.shape[1], "electrodes", recording.sensor)
    flags = recording.flags.astype(np.uint16)  # as readers set them, of a recording that was changed by hand, too
    flags[~np.isfinite(recording.electrodes).all(axis=1)] |= np.uint16(Flag.REPAIRED)
    flags[1:][np.diff(recording.time) <= 0] |= np.uint16(Flag.TIME_JUMP)
    recording = dataclasses.replace(recording, flags=flags)
    silent = silent_frames(recording.electrodes)
    if silent.any():
        return _prepare_answers(recording, options, silent).at(frames)
    return prepare_all(recording, options, frames)


def _prepare_answers(recording: Recording, options: PrepareOptions, silent: np.ndarray) -> Signals:
    """Return the signals of a recording in which the finger does not respond in some frames, silent (T,) bool: these
    get a change of 0 and a flag. Raises TactileError for a tare among them alone."""
    heard = np.flatnonzero(~silent)
    first = np.flatnonzero(silent)[0]
    where = f"{recording.row_word} {recording.rows[first]}"
    warning = (
        f"the finger does not answer in {silent.sum()} of {len(silent)} frames, first in {where}: no contact there"
    )
    if len(heard):
        found = prepare_all(recording.at(heard), _renumbered(recording, options, silent))
    else:  # a finger at rest stands for it, so that all that is reported of a recording is
        rest = typical_rest(recording.sensor)
        rest = np.full(electrode_count(SOURCE), 1.0) if rest is None else rest
        still = dataclasses.replace(recording, electrodes=np.tile(rest, (len(silent), 1)))
        found = prepare_all(still, dataclasses.replace(options, kind="raw", tare=None))
        found = dataclasses.replace(found, change=np.zeros_like(found.change), warnings=recording.warnings)
        heard = np.arange(len(silent))
    spread: dict[str, Any] = {}
    for name in FRAMEWISE:
        values = getattr(found, name)
        spread[name] = np.zeros((len(silent), *values.shape[1:]), values.dtype)
        spread[name][heard] = values
    spread["electrodes"][silent] = recording.electrodes[silent]
    common = np.bitwise_and.reduce(found.flags)
    spread["flags"][silent] = recording.flags[silent] | common | np.uint16(Flag.DEAD_CHANNEL)
    parts = [[int(heard[a]), int(heard[b - 1]) + 1] for a, b in found.report["quiet_parts"]]
    report = {**found.report, "frames": len(silent), "quiet_parts": parts, "frames_without_answer": int(silent.sum())}
    return dataclasses.replace(found, **spread, report=report, warnings=(warning, *found.warnings))


def _renumbered(recording: Recording, options: PrepareOptions, silent: np.ndarray) -> PrepareOptions:
    """Return the options, the tare counted in frames not silent (T,) bool. Raises TactileError if none is left."""
    if options.tare in (None, "none"):
        return options
    frames = tare_frames(options.tare, len(silent))
    first, last = (int((~silent[:end]).sum()) for end in (frames.start, frames.stop))
    if first == last:
        found = f"frames {frames.start}:{frames.stop}, in which the finger does not answer"
        raise TactileError(f"{recording.path}, option tare", found, "frames without contact", "Name others")
    return dataclasses.replace(options, tare=slice(first, last))


class Preparer:
    """Prepare a recording's parts in order, each with what the earlier ones showed; a single part as `prepare` does."""

    def __init__(
        self,
        options: PrepareOptions | None = None,
        unit: ElectrodeGains | None = None,
        parts: Callable[[], Iterable[Recording]] = tuple,
    ) -> None:
        """Store options and unit (None: a typical one); parts : function to all parts, searched for the polarity"""
        options = options or PrepareOptions()
        self._options = options if unit is None else dataclasses.replace(options, rest=unit.rest(), film=unit.film)
        self._unit, self._parts = unit, parts
        self._rest: np.ndarray | None = None  # at the end of the part before, with its PDC, counts
        self._rest_pdc = np.nan
        self._polarity_found = ""  # in another part than the first
        self._doubts = np.uint16(0)  # of the first part's polarity, which hold for all

    def __call__(self, part: Recording, frames: slice | np.ndarray = EVERY) -> Signals:
        """Return the signals of the next part; frames : (n,) or slice, frames whose signals are returned.
        The first part decides kind, scale, polarity and film for all; a later part without quiet frames takes the rest
        of the part before. Raises TactileError for options that the part cannot meet."""
        options, rest = self._options, self._rest
        first = rest is None
        if not first and options.tare not in (None, "none"):  # frames that the user named lie in the first part
            options = dataclasses.replace(options, tare=slice(0, len(part)), film=1.0, drift=False)
        rows = EVERY if self._unit is not None else frames
        signals = prepare(part, options, rows)
        if rest is None:
            if options.polarity == AUTO and signals.flags[0] & DOUBTS and self._look_for_polarity():
                signals = prepare(part, self._options, rows)
            self._doubts = np.uint16(0) if self._polarity_found else signals.flags[0] & DOUBTS
            factor, polarity, fluid = (signals.report[name] for name in ("counts_per_unit", "polarity", "film"))
            self._options = dataclasses.replace(
                self._options, kind=signals.kind, counts_per_unit=factor, polarity=polarity,
                film=self._options.film if fluid is None else fluid["thickness"],
            )  # fmt: skip
        elif options.tare is not None or (not signals.quiet.any() and signals.kind != "raw"):
            signals = self._carried(part, signals, rest, rows, given=options.tare is not None)
        signals = self._decided_once(signals, first=first)
        self._keep_rest(part, signals, rows)
        if self._unit is None:
            return signals
        from . import electrode_gains  # reads by msgspec, which Blender has by the extension's wheels alone

        return electrode_gains.apply(signals, self._unit).at(frames)

    def _look_for_polarity(self) -> bool:
        """Store the polarity of the first part that shows one; return false if none does."""
        for part in self._parts():
            signals = prepare(part, self._options)
            if not signals.flags[0] & DOUBTS:
                name, self._polarity_found = (signals.report[each] for each in ("polarity", "polarity_evidence"))
                self._options = dataclasses.replace(self._options, polarity=name)
                return True
        return False

    def _decided_once(self, signals: Signals, *, first: bool) -> Signals:
        """Return a part's signals under the whole recording's polarity, of which only the first part warns."""
        report, warnings = signals.report, signals.warnings
        if self._polarity_found:
            report = report | {"polarity_evidence": self._polarity_found}
        if self._polarity_found or not first:
            warnings = without(warnings, POLARITY)
        if not first:  # what the first part takes from its unit, a later one takes from the part before
            carried = Doubt(Reason.REST_CARRIED)
            warnings = tuple(carried if reason_of(one) is Reason.REST_OF_UNIT else one for one in warnings)
        flags = (signals.flags & ~DOUBTS) | self._doubts
        return dataclasses.replace(signals, flags=flags, report=report, warnings=warnings)

    def _carried(
        self, part: Recording, signals: Signals, rest: np.ndarray, rows: slice | np.ndarray, *, given: bool
    ) -> Signals:
        """Return a part's signals against the rest (19,) counts and PDC of the part before.
        rows : (n,) or slice, frames of the part whose signals these are; given : true if the user chose the tare"""
        warnings = without(signals.warnings, REST)
        if not given:
            warnings += (Doubt(Reason.REST_CARRIED),)
        sign = 1.0 if signals.report["polarity"] == FALLS else -1.0
        change, thickness = signals.change + sign * (signals.rest - rest), signals.film
        if given and signals.report["film"] is not None:  # its rest was not known there
            found, change = self._of_typical_film(change, rest, part.time[rows], part.sensor)
            thickness, warnings = found.thickness, (*warnings, *found.warnings)
        unanswered = (signals.flags & Flag.DEAD_CHANNEL > 0) & ~signals.change.any(axis=1)
        change = np.where(unanswered[:, None], 0.0, change)
        pdc = signals.pdc + _rest_pdc(part, signals, rows) - self._rest_pdc
        drift = np.zeros_like(signals.drift)
        return dataclasses.replace(
            signals, change=change, rest=rest, pdc=pdc, drift=drift, warnings=warnings, film=thickness
        )

    def _of_typical_film(
        self, change: np.ndarray, rest: np.ndarray, time: np.ndarray, sensor: str
    ) -> tuple[film.Film, np.ndarray]:
        """Return the film, and change (T, 19) counts from rest (19,) at time (T,) s, converted to a typical film."""
        level, options = Baseline.constant(rest), self._options
        whole = Changes(len(change), change.__getitem__)
        found = film.find(
            whole, Changes(len(change), level.at), time, None, sensor,
            thickness=options.film, own_rest=False, drifts=options.drift,
        )  # fmt: skip
        return found, found.changes(whole, level)[EVERY]

    def _keep_rest(self, part: Recording, signals: Signals, rows: slice | np.ndarray) -> None:
        """Store rest and PDC at the part's end for the next part: a calm level there is rest only if it is near this
        one, as a grip is calm, too. rows : (n,) or slice, frames of the part whose signals these are"""
        rest = self._rest = signals.rest + signals.drift * part.duration
        self._rest_pdc = _rest_pdc(part, signals, rows)
        pdc = self._rest_pdc if np.isfinite(self._rest_pdc) else None
        self._options = dataclasses.replace(self._options, rest=Rest(tuple(rest), (0.0,) * len(rest), pdc))


def _rest_pdc(part: Recording, signals: Signals, rows: slice | np.ndarray) -> float:
    """Return a part's PDC at rest, counts; NaN without PDC. rows : (n,) or slice, frames of the part in `signals`"""
    return np.nan if part.pdc is None else float(part.pdc[rows][0] - signals.pdc[0])
