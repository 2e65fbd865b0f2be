"""Fit rest, gains and offsets of an unknown sensor from its own recordings, without known loads."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Sequence
from typing import NamedTuple

import msgspec
import numpy as np

from ..errors import TactileError
from ..files.short_text import listed
from ..recordings import PrepareOptions, Recording, Signals, read
from ..recordings.electrode_faults import named_electrodes
from ..recordings.electrode_gains import LEAST, MOST, ElectrodeGains, SensorFile, units_file
from ..recordings.flags import Flag
from ..recordings.preparer import Preparer
from ..recordings.readers import each_finger, sensor_of
from ..recordings.recording import FINGERS, short_of, split
from ..recordings.tables.column_map import ColumnMap
from ..recordings.unit import film
from ..recordings.unit.contact_law import as_contact
from ..recordings.unit.gain_matching import PRIOR, Match, match
from ..sensors import title, typical_rest
from . import networks, reference_signals
from .card import REST
from .reference_signals import ReferenceSignals
from .unit_rest import Simulated, UnitRest, find_rest, find_rest_sp, read_rest
from .weights import read_card

FEWEST_FRAMES = 50  # in contact, half a second (assumed)
MOST_FRAMES = 3_000  # looked at, evenly spread: neighbours at 100 Hz are alike
FEWEST_CONTACTS = 5  # different ones: fewer do not separate gains from the contacts (assumed)
FEW_CONTACTS = 20  # different ones; with fewer, gains of 30 % are found to 20 % only (simulated contacts at one place)
# Error of gains over the scatter of those found, LEAST_LEFT + LEFT / sqrt(different contacts): measured on simulated
# units of 15 and 30 % scatter, 15 to 320 different contacts, with noise (tests/translation/test_adapt.py). Gains are
# shrunk towards 1, more with fewer contacts; the rest comes from matching by wrong gains.
LEAST_LEFT, LEFT = 0.17, 6.3
BETWEEN = 3600.0  # s between two recordings of a unit, in which its fluid's conductivity may drift (assumed)
TOUCHED = 2.0  # least contacts that determine an electrode's gain, for it to be fitted (assumed)
MOVED = 5.0  # counts, least 99 % quantile of an electrode that was touched: three times the noise
SHOWN = 3  # names spelled out
LARGEST_OFFSET = 30.0  # counts; a larger one is a wrong match, not a tare error (assumed)


class Adapted(NamedTuple):
    """Sensor file's entries for a fitted unit, with warnings for the user."""

    sensor: ElectrodeGains
    warnings: tuple[str, ...]


def adapt(
    paths: Sequence[str | os.PathLike], typical: ReferenceSignals, options: PrepareOptions | None = None,
    rest: UnitRest | None = None,
) -> Adapted:  # fmt: skip
    """Fit rest, gains and offsets of one sensor from all of its recordings (paths) together.

    typical : signals of simulated contacts, to which its own are matched; options : how recordings are prepared
    rest : the unit's rest; None estimates it from all recordings. It serves recordings that are never calm near it
    Raises TactileError for a recording that is unreadable or scaled, signed and rectified ones together, too few frames
    in contact, and an estimated rest that looks like a contact."""
    parts, kinds, restless = [], set(), []
    recordings = [read(path, None if options is None else options.columns) for path in paths]
    rest = _rest(recordings, options) if rest is None else rest
    bare = None if rest is None else _bare(rest, recordings, options)
    for path, recording in zip(paths, recordings, strict=True):
        signals = Preparer(options, bare)(recording)
        if signals.kind == "scaled":
            advice = "Give its counts a unit, or use another recording"
            raise TactileError(path, "a scaled recording, whose unit is not known", "counts", advice)
        if (signals.flags & Flag.NO_QUIET_PART).all():
            restless.append(short_of(path))
        kinds.add(signals.kind == "rectified")
        parts.append(_contacts(signals))
    if len(kinds) > 1:
        raise TactileError(paths[0], "signed and rectified recordings together", "one kind", "Adapt to each by itself")
    note = f"fitted by tactile adapt from {listed([short_of(path) for path in paths], SHOWN)}"
    fitted = _fitted(parts, kinds.pop(), typical, note, bare)
    if not restless:
        return fitted
    warning = f"no quiet part in {listed(restless, SHOWN)}: where the tare is off, so are the gains and offsets"
    return Adapted(fitted.sensor, (warning, *fitted.warnings))


def adapt_hand(
    paths: Sequence[str | os.PathLike], typical: ReferenceSignals, options: PrepareOptions | None = None,
    untouched: str | None = None,
) -> tuple[SensorFile, tuple[str, ...]]:  # fmt: skip
    """Fit the unit of recordings (paths) by `adapt`, or one unit for each finger of a hand; also return warnings.
    typical : signals of simulated contacts; options : how recordings are prepared. Without a typical rest, only rest
        and film are found
    untouched : path of a recording without contact, if there is one unit; None finds rest in all recordings
    Raises TactileError like `adapt`, and for a mixture of sensors, or of hands and single fingers."""
    columns = None if options is None else options.columns
    every = [one for path in paths for one in each_finger(path, columns)]
    found = {sensor_of(one, columns) for one in every}
    if len(found) > 1:
        raise TactileError(paths[0], f"recordings of {' and '.join(sorted(found))} together", "one sensor")
    units, sensor = _units(every), found.pop()
    rest = None if untouched is None else _given_rest(untouched, len(units), sensor, columns)
    if typical_rest(sensor) is None:
        rests = {unit: _rest_of_files(files, sensor) for unit, files in units.items()}
        said = f"no gains are fitted to a {title(sensor)}: its recordings give its rest and film"
        return units_file(rests, sensor), (said,)
    fitted: dict[str, ElectrodeGains] = {}
    warnings: list[str] = []
    for unit, files in units.items():
        done = adapt(files, typical, options, rest)
        fitted[unit] = done.sensor
        warnings += [text if unit == "unit" else f"{unit}: {text}" for text in done.warnings]
    return units_file(fitted), tuple(warnings)


def _given_rest(untouched: str, units: int, sensor: str, columns: ColumnMap | None) -> UnitRest:
    """Read a unit's rest from a recording untouched. Raises TactileError for several units, another sensor, or one
    without a typical rest."""
    if units > 1:
        raise TactileError("--rest", f"given for {units} units", "one", "Adapt to each finger by itself: FILE#0")
    if typical_rest(sensor) is None:
        advice = f"Leave --rest out: recordings of contacts give a {title(sensor)}'s rest"
        raise TactileError("--rest", f"given for a {title(sensor)}", "a sensor whose typical rest is known", advice)
    of = sensor_of(untouched, columns)
    if of != sensor:
        advice = "Give an untouched recording of the same unit"
        raise TactileError(untouched, f"a recording of a {title(of)}", f"of a {title(sensor)}, as the others", advice)
    return read_rest(untouched, columns)


def _units(every: Sequence[str]) -> dict[str, list[str]]:
    """Group recordings' paths by their unit's name. Raises TactileError for hands and single fingers together."""
    units: dict[str, list[str]] = {}
    for one in every:
        chosen = split(one)
        if not chosen.topic and (chosen.finger or 0) >= FINGERS:
            raise TactileError(one, f"finger {chosen.finger}", f"a hand of at most {FINGERS} fingers")
        units.setdefault(chosen.section, []).append(one)
    if len(units) > 1 and "unit" in units:
        found = "files of several fingers, and of one"
        raise TactileError(every[0], found, "one kind", "Adapt to each by itself")
    return dict(sorted(units.items()))


def _rest_of_files(files: list[str], sensor: str) -> ElectrodeGains:
    """Estimate rest and film of a unit whose sensor has no gains."""
    folder = networks.shipped_folder(sensor)
    simulated = Simulated(reference_signals.read(folder).typical, np.array(read_card(folder)[0][REST]))
    rest = find_rest_sp([read(path, sensor=sensor) for path in files], simulated)
    return _rest_alone(rest, f"rest and film that bring {rest.recordings} contacts nearest to simulated ones")


def _rest(recordings: Sequence[Recording], options: PrepareOptions | None) -> UnitRest | None:
    """Find the unit's rest; None if the recordings are too few or not raw. If the rest found looks like a contact, it
    is None as well if a recording has a quiet part, else TactileError is raised."""
    try:
        found = find_rest(recordings)
    except TactileError:
        return None
    if (share := as_contact(found.counts, recordings[0].sensor, [one.electrodes for one in recordings])) is not None:
        if not all((Preparer(options)(one).flags & Flag.NO_QUIET_PART).all() for one in recordings):
            return None
        held = f"even the least pressed recordings look like a contact, which explains {share:.0%} of their levels"
        advice = "Add softer touches, or name a recording of the untouched finger (--rest)"
        of = f"{listed([one.name for one in recordings], SHOWN)}: rest of the unit"
        raise TactileError(of, held, "some that are hardly pressed", advice)
    return found


def _film(recordings: Sequence[Recording], options: PrepareOptions | None, bare: ElectrodeGains) -> float:
    """Return the thickness of the unit's film, estimated from all its raw recordings together."""
    plain = dataclasses.replace(options or PrepareOptions(), film=1.0, drift=False)
    every = [Preparer(plain, bare)(one) for one in recordings]
    change = np.concatenate([one.change for one in every])
    rest = np.concatenate([np.broadcast_to(one.rest, one.change.shape) for one in every])
    starts = np.cumsum([0.0, *(one.duration + BETWEEN for one in recordings[:-1])])
    time = np.concatenate([start + one.time for start, one in zip(starts, recordings, strict=True)])
    pressure = np.concatenate([one.pressure_measured for one in every])
    return film.find(change, rest, time, pressure, recordings[0].sensor, own_rest=False).thickness


def rest_unit(path: str, columns: ColumnMap | None = None) -> SensorFile:
    """Return a unit with only its rest known, from a recording (path) of it untouched. Raises TactileError if it is not
    raw or an electrode moves more than drift does."""
    name = os.path.basename(path)
    return units_file({"unit": _rest_alone(read_rest(path, columns), f"rest from {name}, a recording without contact")})


def _bare(rest: UnitRest, recordings: Sequence[Recording], options: PrepareOptions | None) -> ElectrodeGains:
    """Return a unit's entry with its rest and film alone; the film is estimated from its recordings."""
    source = f"the {rest.recordings} least pressed recordings" if rest.recordings else "a recording without contact"
    bare = _rest_alone(rest, f"rest from {source}")
    return msgspec.structs.replace(bare, film=_film(recordings, options, bare))


def _rest_alone(rest: UnitRest, note: str) -> ElectrodeGains:
    counts, spread = ([round(value, 4) for value in each.tolist()] for each in (rest.counts, rest.spread))
    ones, zeros = [1.0] * len(counts), [0.0] * len(counts)
    pdc = None if rest.pdc is None else round(rest.pdc, 4)
    return ElectrodeGains(note, ones, zeros, counts, spread, pdc, rest.film)


def _fitted(
    parts: list[np.ndarray], rectified: bool, typical: ReferenceSignals, note: str, bare: ElectrodeGains | None
) -> Adapted:
    """Fit gains and offsets to recordings' parts (n, 19) counts, frames in contact, and add the unit's rest ``bare``
    (None: not known); if there is too little contact to fit gains, return the rest alone."""
    change = np.concatenate(parts)
    if bare is None:
        return fit(change, rectified, typical, note)
    try:
        found = fit(change, rectified, typical, f"{note}; {bare.note}")
    except TactileError as error:
        return Adapted(bare, (f"no gains: {error}",))
    fields = {name: getattr(bare, name) for name in ("rest_counts", "rest_spread_counts", "rest_pdc", "film")}
    return Adapted(msgspec.structs.replace(found.sensor, **fields), found.warnings)


def _contacts(signals: Signals) -> np.ndarray:
    """Return the changes (n, 19) counts in frames in contact, absolute for a rectified recording."""
    change = np.abs(signals.typical) if signals.kind == "rectified" else signals.typical
    return change[reference_signals.touching(change) & ~signals.quiet]


def fit(change: np.ndarray, rectified: bool, typical: ReferenceSignals, note: str) -> Adapted:
    """Fit gains and offsets by matching change (n, 19) counts, the frames in contact of all recordings, to typical
    signals. rectified : true if change has lost its signs; note : how it was fitted, kept in the result
    Raises TactileError for fewer than FEWEST_FRAMES frames, and for fewer than FEWEST_CONTACTS different contacts."""
    frames = len(change)
    if frames < FEWEST_FRAMES:
        advice = "Use recordings with more contact"
        raise TactileError("adapt", f"{frames} frames in contact", f"at least {FEWEST_FRAMES}", advice)
    change = change[np.linspace(0, frames - 1, min(frames, MOST_FRAMES)).round().astype(int)]
    found = match(change, typical.typical, rectified)
    if found.matched < FEWEST_CONTACTS:
        advice = "Touch more places, softly and hard"
        raise TactileError("adapt", f"{found.matched} different contacts", f"at least {FEWEST_CONTACTS}", advice)
    log_gain = found.log_gain - typical.bias(rectified) * found.contacts / (found.contacts + PRIOR)
    touched = (found.contacts >= TOUCHED) & (np.quantile(np.abs(change), 0.99, axis=0) >= MOVED)
    gain, fitted, warnings = _believable(np.exp(log_gain), touched, found)
    offset = np.where(np.abs(found.offset) <= LARGEST_OFFSET, found.offset, 0.0)
    if (np.abs(found.offset) > LARGEST_OFFSET).any():
        warnings.append(f"{named_electrodes(np.abs(found.offset) > LARGEST_OFFSET)}: no believable offset; taken as 0")
    signs = "rectified, so no offsets" if rectified else "signed"
    note = f"{note}; {frames} frames in contact ({signs}), {found.matched} different contacts"
    if fitted.any():
        uncertainty = np.log(gain[fitted]).std() * (LEAST_LEFT + LEFT / np.sqrt(found.matched))
        note += f"; gains to about {uncertainty:.0%}"
    sensor = ElectrodeGains(note, [round(g, 4) for g in gain.tolist()], [round(o, 4) for o in offset.tolist()])
    return Adapted(sensor, tuple(warnings))


def _believable(gain: np.ndarray, touched: np.ndarray, found: Match) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Set gains to 1 that the frames do not determine or that are out of range; return gains (19,), a mask (19,) bool
    of those fitted, and warnings.
    gain : (19,) as matched; touched : (19,) bool, electrodes with enough contact; found : the whole match"""
    wild = touched & ~((gain >= LEAST) & (gain <= MOST))
    warnings = []
    if not touched.all():
        warnings.append(f"{named_electrodes(~touched)}: hardly touched in these recordings; gain kept at 1")
    for electrode in np.flatnonzero(wild):
        outcome = f"outside {LEAST:g} to {MOST:g}; kept at 1 (a dead channel?)"
        warnings.append(f"E{electrode + 1}: gain {gain[electrode]:.2f} is {outcome}")
    if found.matched < FEW_CONTACTS:
        warnings.append(
            f"only {found.matched} different contacts: gains are uncertain; touch more places, softly and hard"
        )
    if not found.settled:
        warnings.append("the fit did not settle: gains are uncertain")
    fitted = touched & ~wild
    return np.where(fitted, gain, 1.0), fitted, warnings
