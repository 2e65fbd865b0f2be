"""Draw the newest frame as a picture, and measure how long that takes."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ... import accuracy
from ...pictures.height_map import folds_counted
from ...recordings.flags import Flag
from ...recordings.recording import Recording
from ...recordings.signals import PrepareOptions
from ...translation.contact_track import ForwardTracker
from ...translation.trust_words import in_words
from ..frame_pass import Tools
from .live_signals import LiveSignals

if TYPE_CHECKING:
    from ...recordings.electrode_gains import ElectrodeGains

REMEMBERED = 1000  # latencies whose quantiles are reported


@dataclass(frozen=True, eq=False)
class Shown:
    """A picture on display.
    frame : its index; confidence : 0..1; flags : bits of ``recordings.flags.Flag``; words : a text on both
    picture : (H, W, 3) uint8; force : (3,) N, of the object on the sensor
    latency : s from the rows' arrival to the picture; work : s of CPU time in that"""

    frame: int
    picture: np.ndarray
    force: np.ndarray
    latency: float
    work: float
    confidence: float
    flags: int
    words: str

    @property
    def newtons(self) -> float:
        """Return the magnitude of the force, N."""
        return float(np.linalg.norm(self.force))


class View:
    """Translate arriving rows to pictures: always the newest row; older ones that arrived meanwhile are skipped.
    signals : `LiveSignals`, rest and polarity so far; frames, passed : number of rows that arrived, and were skipped"""

    def __init__(
        self, tools: Tools, rate: float, options: PrepareOptions | None = None, unit: ElectrodeGains | None = None
    ) -> None:
        """Make a view of a recording. rate : Hz; options, unit : see `LiveSignals`"""
        self.signals = LiveSignals(rate, options, unit, tools.translator.source)
        self._tools, self._rate = tools, rate
        self._track = ForwardTracker()
        tools.drawer.warm_up()  # else the first row would wait a second for it
        self.frames, self.passed = 0, 0
        self._counts: np.ndarray | None = None  # (e,), the last of each electrode that could be read
        self.latencies: deque[tuple[float, float]] = deque(maxlen=REMEMBERED)

    def show(self, rows: Recording, came: float) -> Shown | None:
        """Translate and draw the last of rows that came at `came`, s of perf_counter; None before rest is known."""
        began = time.thread_time()
        self.frames += len(rows)
        self._counts = _newest(rows.electrodes, self._counts)
        if not self.signals.learn(rows):
            return None
        self.passed += len(rows) - 1
        pdc = np.full(1, np.nan) if rows.pdc is None else rows.pdc[-1:]
        signals = self.signals.signals(self._counts[None], pdc)
        drawer, translator = self._tools.drawer, self._tools.translator
        evidence = translator.encode(signals)
        state = self._track(evidence, self.frames / self._rate) if translator.answer.follows else None
        translation = translator.decode(signals, evidence, state)
        gel = drawer.gel(vars(translation))["displacement_digit"]
        with folds_counted():  # a line for each such picture would hide the latencies
            heights = drawer.height_map(gel)
        picture = drawer.draw(heights[0], gel[0])
        latency, work = time.perf_counter() - came, time.thread_time() - began
        force, confidence = translation.force[0], float(translation.confidence[0])
        unread = not np.isfinite(rows.electrodes[-1]).all()
        flags = int(translation.flags[0]) | (Flag.REPAIRED if unread else 0)
        words = in_words(confidence, flags, translation.expected_error_digit[0], accuracy.lengths(gel[0]).max(), force)
        shown = Shown(self.frames - 1, picture, force, latency, work, confidence, flags, words)
        self.latencies.append((latency, work))
        return shown

    def describe_latency(self) -> str:
        """Return a sentence: median and 99th percentile of the last latencies, median of computing, frames skipped."""
        if not self.latencies:
            return "no picture yet: waiting for a quiet part"
        (middle, work), (late, _) = 1e3 * np.percentile(np.array(self.latencies), [50, 99], axis=0)
        return (
            f"{middle:.1f} ms from frame to picture (99 of 100 below {late:.1f} ms; {work:.1f} ms of them computing),"
            f" {self.passed} frames passed over"
        )


def _newest(electrodes: np.ndarray, before: np.ndarray | None) -> np.ndarray:
    """Return the last counts (e,) of rows electrodes (T, e); NaN cells take earlier rows' values, those before, or 0.
    before : (e,) counts held so far, None at the start"""
    found = np.zeros(electrodes.shape[1]) if before is None else before
    for row in electrodes:
        found = np.where(np.isfinite(row), row, found)
    return found
