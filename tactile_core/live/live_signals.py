"""Signals of a recording of which only the past is known."""

from __future__ import annotations

import numpy as np

from ..flags import Flag
from ..recordings.kinds import detect
from ..recordings.quiet import find_quiet, level, window_frames
from ..recordings.recording import NOMINAL_RATE
from ..recordings.signals import Signals

LONGEST = 10.0  # s that are looked through for rest; then the calmest so far is taken (assumed)


class LiveSignals:
    """The change against rest, frame by frame. Rest is the first quiet part; drift is not removed.

    rate : Hz
    """

    def __init__(self, rate: float = NOMINAL_RATE) -> None:
        self._rate = rate
        self._seen = np.empty((0, 19))
        self.rest: np.ndarray | None = None
        self.kind, self.found = "raw", ""

    def learn(self, electrodes: np.ndarray) -> bool:
        """Look at frames (T, 19) counts for rest; whether it is known."""
        if self.rest is not None:
            return True
        whole = electrodes[np.isfinite(electrodes).all(axis=1)]
        self._seen = np.concatenate([self._seen, whole])[: round(LONGEST * self._rate)]
        if len(self._seen) < window_frames(self._rate):
            return False
        self.kind, _ = detect(self._seen)
        quiet = find_quiet(self._seen, None, self._rate, self.kind)
        if quiet.parts:
            first, last = quiet.parts[0]
            self.rest, self.found = level(self._seen[first:last]), f"frames {first}:{last}"
        elif len(self._seen) >= LONGEST * self._rate:
            n = window_frames(self._rate)
            spread = [self._seen[i : i + n].std(axis=0).max() for i in range(0, len(self._seen) - n, n)]
            first = n * int(np.argmin(spread))
            self.rest, self.found = level(self._seen[first : first + n]), f"no quiet part: a guess, {first}:{first + n}"
        return self.rest is not None

    def signals(self, electrodes: np.ndarray) -> Signals:
        """Signals of frames (T, 19) counts; call when rest is known."""
        flags = Flag.RECTIFIED if self.kind == "rectified" else 0
        count = len(electrodes)
        return Signals(
            change=electrodes - self.rest, rest=self.rest, drift=np.zeros(19), electrodes=electrodes, kind=self.kind,
            quiet=np.zeros(count, bool), flags=np.full(count, flags, np.uint16), warnings=(), report={},
        )  # fmt: skip
