"""Signals that are ready for the networks, and the options of their preparation."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..errors import TactileError, finite_number
from ..sensors import SOURCE, divider, typical_rest
from ..sensors.descriptor import of_kind
from ..sensors.fluid_sensor import POLARITIES, Fluid
from .polarity import AUTO
from .quiet import TARED_PDC
from .rest_level import Changes
from .signal_kind import KINDS
from .tables.column_map import ColumnMap
from .unit import film

EVERY = slice(None)  # of a recording's frames
LONGEST = 101  # frames, a second, to smooth over: beyond, touch itself is smoothed away (assumed)
FRAMEWISE = ("change", "electrodes", "quiet", "flags", "pdc")  # arrays of `Signals` with a row for each frame
UNIT_DRIFT = 60.0  # counts that a unit's rest may drift between recordings (the slide set's: 40 to 51 in two days)
SAME_PRESSURE = 15.0  # counts of PDC, 0.55 kPa: less is no contact (docs/sources.md, BioTac read-out)


@dataclass(frozen=True)
class Rest:
    """A unit's readings without contact, found in other recordings of it. counts : (e,) readings from E1 on
    spread : (e,) counts by which they may be off; pdc : PDC at rest, counts, None if unknown"""

    counts: tuple[float, ...]
    spread: tuple[float, ...]
    pdc: float | None = None

    def agrees(self, level: np.ndarray, pdc: float) -> bool:
        """Return true if a calm level (19,) counts is this unit at rest: if pdc, counts, is near the unit's at rest; if
        PDC is unknown (NaN), or has another zero, if the level is near the unit's counts at rest."""
        if self.pdc is not None and abs(pdc - self.pdc) < TARED_PDC:
            return abs(pdc - self.pdc) < SAME_PRESSURE
        return bool((np.abs(level - np.array(self.counts)) <= np.maximum(UNIT_DRIFT, self.spread)).all())


@dataclass(frozen=True)
class PrepareOptions:
    """Options of the preparation of signals; None leaves a choice to the program.

    kind : "raw", "tared", "scaled" or "rectified"
    tare : frames to take rest from, a slice or "A:B"; "none" takes the file's own zero; None finds quiet parts
    drift : true removes drift between quiet parts
    repair : true interpolates over glitches (unreadable samples are always interpolated)
    counts_per_unit : factor from a recording's unit of measurement to counts
    smooth : odd number of frames over which changes are averaged; None: 3 for a rectified recording, else 1
    polarity : "falls" or "rises", how counts change where the film thins; "auto": as the file states, or as detected
    rest : the unit's readings without contact, for raw recordings that hold no calm part near it
    film : thickness of a raw recording's fluid film, divided by a typical unit's; None: as rest and contacts show it
    columns : map of the file's columns, used when the recording is read; None: its layout names them"""

    kind: str | None = None
    tare: slice | str | None = None
    drift: bool = True
    repair: bool = True
    counts_per_unit: float | None = None
    smooth: int | None = None
    polarity: str = AUTO
    rest: Rest | None = None
    film: float | None = None
    columns: ColumnMap | None = None

    def check(self) -> None:
        """Raise TactileError for options that suit no recording; `tare` can only be checked against a recording."""
        if self.kind is not None and self.kind not in KINDS:
            raise TactileError("option kind", repr(self.kind), ", ".join(KINDS))
        if self.counts_per_unit is not None:
            finite_number(self.counts_per_unit, "option counts_per_unit", "counts a unit, above 0", 1e-9, 1e9)
        if self.smooth is not None and self.smooth not in range(1, LONGEST + 1, 2):
            raise TactileError("option smooth", f"{self.smooth!r} frames", f"an odd number from 1 to {LONGEST}")
        if self.film is not None:
            expected = f"{film.LEAST:g} to {film.MOST:g} of a typical unit's"
            finite_number(self.film, "option film", expected, film.LEAST, film.MOST)
        yes_or_no = bool, "True or False"
        kinds = {"rest": (Rest | None, "a Rest, or None"), "drift": yes_or_no, "repair": yes_or_no}
        for name, (kind, expected) in kinds.items():
            if not isinstance(given := getattr(self, name), kind):
                raise TactileError(f"option {name}", f"{given!r:.80}", expected)
        if self.polarity not in (AUTO, *POLARITIES):
            raise TactileError("option polarity", repr(self.polarity), ", ".join((AUTO, *POLARITIES)))


@dataclass(frozen=True, eq=False)
class Signals:
    """Signals ready for the networks.

    change : (T, 19) float, counts: reading minus rest, drift removed, smoothed as reported, converted to a typical
        unit's film where ``film`` is another. Its sign is that of a raw reading, which falls where a film thins,
        whatever the file's own polarity. Rectified: |change| minus its quiet level
    rest : (19,) float, counts, readings without contact at the first frame
    drift : (19,) float, counts/s, mean slope of the rest level over the recording
    electrodes : (T, 19) float, counts: the readings after repair, before the tare
    kind : "raw", "tared", "scaled" or "rectified"
    quiet : (T,) bool, frames without contact that rest was taken from
    flags : (T,) uint16, bits of ``flags.Flag``: the recording's and those found here
    pdc : (T,) float, counts, the fluid's pressure over its level at rest; NaN where the recording has none
    warnings : sentences, the recording's and those found here; a `Doubt` among them carries its reason
    report : what was found and done, fit for JSON
    sensor : name of the sensor; 19 in the shapes is the BioTac's number of electrodes
    film : thickness of the unit's film, divided by a typical unit's, from which the changes were converted
    stiffness : of the unit's skin, divided by a typical one's: force and pressure are to be multiplied by it"""

    change: np.ndarray
    rest: np.ndarray
    drift: np.ndarray
    electrodes: np.ndarray
    kind: str
    quiet: np.ndarray
    flags: np.ndarray
    pdc: np.ndarray
    warnings: tuple[str, ...]
    report: dict[str, Any]
    sensor: str = SOURCE
    film: float = 1.0
    stiffness: float = 1.0

    def at(self, frames: np.ndarray | slice) -> Signals:
        """Return the signals of frames (n,) or a slice alone; rest and drift stay those of the recording."""
        return replace(self, **{name: getattr(self, name)[frames] for name in FRAMEWISE})

    @property
    def pressure_measured(self) -> np.ndarray:
        """Return the rise (T,) Pa of the fluid's pressure over rest, by PDC; NaN if that was not recorded."""
        return of_kind(self.sensor, Fluid).readout.pressure * self.pdc

    @property
    def typical(self) -> np.ndarray:
        """Return the networks' input: change (T, 19) counts that a unit with a typical rest would show. Only raw
        readings are converted, as others do not show their unit's rest, and only if the sensor has a typical rest."""
        return Changes(len(self.change), self.typical_of)[EVERY]  # by blocks: a third of the memory

    def relative_to(self, rest: np.ndarray) -> np.ndarray:
        """Return change (T, e) counts; if the recording is raw, that of a unit that rests at rest (e,) counts."""
        return divider.typical(self.change, self.rest, rest) if self.kind == "raw" else self.change

    def of_typical(self, change: np.ndarray, at: np.ndarray | None) -> np.ndarray:
        """Return the change (T, e) counts that this unit would show where a typical one shows change (T, e) counts; not
        converted if the recording is not raw, or `at` None. Gains and the fluid's drift are not put back.
        at : (e,) counts at which the typical unit rests"""
        if self.kind != "raw" or at is None:
            return change
        own = divider.of_unit(change, self.rest, at)
        return own if self.film == 1 else divider.of_typical_film(own, self.rest, 1 / self.film)

    def typical_of(self, rows: slice | np.ndarray) -> np.ndarray:
        """Return the rows (n,), or a slice, of ``typical`` alone: (n, 19) counts."""
        return typical(self.change[rows], self.kind, self.rest, self.sensor)


def typical(change: np.ndarray, kind: str, rest: np.ndarray, sensor: str) -> np.ndarray:
    """Return change (n, 19) counts, if "raw" converted from a unit at rest (19,) counts to a typical unit."""
    to = typical_rest(sensor)
    return divider.typical(change, rest, to) if kind == "raw" and to is not None else change
