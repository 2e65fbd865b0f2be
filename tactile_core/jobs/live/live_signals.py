"""Signals of a recording of which only the past is known."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...recordings.electrode_faults import alike
from ...recordings.flags import Flag
from ...recordings.polarity import AUTO, TOUCHING, Basis, Polarity, polarity_of, polarity_of_sensor
from ...recordings.quiet import find_quiet, tare_frames, window_frames
from ...recordings.rest_level import level
from ...recordings.signal_kind import detect, full_scale
from ...recordings.signals import Rest, Signals
from ...sensors import SAMPLE_RATE, SOURCE, contacts_of, electrode_count
from ...sensors.fluid_sensor import FALLS, POLARITIES

if TYPE_CHECKING:
    from ...recordings.electrode_gains import ElectrodeGains

LONGEST = 10.0  # s that are looked through for rest and polarity; then the calmest so far is taken (assumed)
AGAIN = 25  # new frames after which the polarity is looked at again


class LiveSignals:
    """The change against rest, frame by frame. Rest is the first quiet part; drift is not removed.

    rate : Hz; polarity : "falls", "rises" or "auto", which is decided by the first contacts, and "falls" until then
    tare : frames of the first LONGEST s to take rest from, "A:B"; "none" takes the file's own zero
    unit : gains and offsets to take off, and its rest, which is taken where the first window is not calm near it
    sensor : whose counts they are

    Raises TactileError for a tare of other frames.
    """

    def __init__(
        self,
        rate: float = SAMPLE_RATE,
        polarity: str = AUTO,
        tare: str | None = None,
        unit: ElectrodeGains | None = None,
        sensor: str = SOURCE,
    ) -> None:
        self._rate, self._unit, self._sensor = rate, unit, sensor
        self._zero = tare == "none"
        self._tare = None if tare is None or self._zero else tare_frames(tare, round(LONGEST * rate))
        self._seen, self._pdc, self._looked_at = np.empty((0, electrode_count(sensor))), np.empty(0), 0
        self.polarity = _stated_polarity(polarity, "as given")
        self.rest: np.ndarray | None = None
        self.kind, self.found = "raw", ""
        self._factor: float | None = None  # counts a unit of the file
        self._unheard = 0  # frames so far whose electrodes all read the same
        self.silent = False

    def learn(self, electrodes: np.ndarray, pdc: np.ndarray | None = None, polarity: str = AUTO) -> bool:
        """Look at frames (T, 19) counts for rest, and for their polarity; returns true once rest is known.

        pdc : (T,) counts, where there are; polarity : what the file says of its counts, where it does
        """
        if not self.polarity.sure and polarity in POLARITIES:
            self.polarity = _stated_polarity(polarity, "as the file says")
        same = alike(electrodes)
        self.silent = bool(len(same)) and bool(same[-1]) and self.kind == "raw"
        if self.rest is not None and self.polarity.sure:
            return True
        whole = np.isfinite(electrodes).all(axis=1) & ~same
        self._unheard += int(same.sum())
        electrodes = electrodes * (self._factor or 1.0)
        pdc = np.full(len(electrodes), np.nan) if pdc is None else pdc
        most = round(LONGEST * self._rate)
        self._seen = np.concatenate([self._seen, electrodes[whole]])[:most]
        self._pdc = np.concatenate([self._pdc, pdc[whole]])[:most]
        if self.rest is None:
            self._find_rest()
        if self.rest is not None:
            self._decide()
        return self.rest is not None

    def _find_rest(self) -> None:
        """Take the first quiet part for rest, or the calmest one when LONGEST has passed."""
        if self._tare is not None and len(self._seen) >= self._tare.stop:
            self._find_kind()
            first, last = self._tare.start, self._tare.stop
            self.rest, self.found = level(self._seen[first:last]), f"frames {first}:{last}, as given"
        if self._tare is not None or len(self._seen) < window_frames(self._rate):
            return
        self._find_kind()
        if self._zero:
            self.rest, self.found = np.zeros(self._seen.shape[1]), "the file's own zero, as asked for"
            return
        quiet = find_quiet(self._seen, None, self._rate, self.kind)
        known = None if self._unit is None or self.kind != "raw" else self._unit.rest()
        if known is not None and not (quiet.parts and self._agrees(known, *quiet.parts[0])):
            self.rest, self.found = np.array(known.counts), "the unit's own: the first frames are not calm near it"
        elif quiet.parts:
            first, last = quiet.parts[0]
            self.rest, self.found = level(self._seen[first:last]), f"frames {first}:{last}"
        elif len(self._seen) >= LONGEST * self._rate:
            n = window_frames(self._rate)
            spread = [self._seen[i : i + n].std(axis=0).max() for i in range(0, len(self._seen) - n, n)]
            first = n * int(np.argmin(spread))
            self.rest, self.found = level(self._seen[first : first + n]), f"no quiet part: a guess, {first}:{first + n}"

    def _find_kind(self) -> None:
        """Detect unit and kind of the frames so far; changes that were all 0 at first were no silence, but rest."""
        if self._factor is None:
            unit = full_scale(self._seen)
            self._factor = unit[0] if unit else 1.0
            self._seen = self._seen * self._factor
        self.kind, _ = detect(self._seen)
        if self.kind != "raw" and self._unheard:
            count = min(self._unheard, window_frames(self._rate))
            self._seen = np.concatenate([np.zeros((count, self._seen.shape[1])), self._seen])
            self._pdc, self._unheard = np.concatenate([np.full(count, np.nan), self._pdc]), 0

    def _agrees(self, known: Rest, first: int, last: int) -> bool:
        """Return true if these calm frames are at the unit's rest."""
        return known.agrees(level(self._seen[first:last]), float(np.median(self._pdc[first:last])))

    def _decide(self) -> None:
        """Decide the polarity from the frames so far, repeated from time to time; once it is sure it stays."""
        if self.kind == "rectified":
            self.polarity = Polarity(FALLS, "the sign is lost")
        if not self.polarity.sure and contacts_of(self._sensor) is None:
            self.polarity = polarity_of_sensor(self._sensor, self.kind)
        elif not self.polarity.sure and len(self._seen) >= self._looked_at + AGAIN:
            self._look()

    def _look(self) -> None:
        """Look at what the frames show."""
        self._looked_at = len(self._seen)
        change = self._seen - self._known_rest()
        still = np.sqrt(np.square(change).sum(axis=1)) < TOUCHING
        pdc = self._pdc if np.isfinite(self._pdc).all() else None
        self.polarity = polarity_of(change, still, self._seen, pdc, sensor=self._sensor)

    def _known_rest(self) -> np.ndarray:
        if self.rest is None:
            raise ValueError("no rest is known yet")
        return self.rest

    def signals(self, electrodes: np.ndarray) -> Signals:
        """Return the signals of frames (T, 19) counts; call when rest is known."""
        count, rest = len(electrodes), self._known_rest()
        silent = alike(electrodes) & (self.kind == "raw")
        flags = np.full(count, Flag.RECTIFIED if self.kind == "rectified" else 0, np.uint16)
        flags[silent] |= np.uint16(Flag.DEAD_CHANNEL)
        electrodes = electrodes * (self._factor or 1.0)
        change = np.where(silent[:, None], 0.0, self.polarity.sign * (electrodes - rest))
        signals = Signals(
            change=change, rest=rest, drift=np.zeros_like(rest),
            electrodes=electrodes, kind=self.kind,
            quiet=np.zeros(count, bool), flags=flags, pdc=np.full(count, np.nan),
            warnings=(), report={}, sensor=self._sensor,
        )  # fmt: skip
        if self._unit is None:
            return signals
        from ...recordings import electrode_gains

        return electrode_gains.apply(signals, self._unit)


def _stated_polarity(polarity: str, who: str) -> Polarity:
    """Return the polarity stated by ``who``; an assumed one where nobody states it."""
    if polarity in POLARITIES:
        return Polarity(polarity, who)
    return Polarity(FALLS, "no contact has shown it yet", Basis.ASSUMED)
