"""Draw the newest frame of a recording of which only the past is known, and measure how long that takes."""

from __future__ import annotations

import dataclasses
import time
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ... import accuracy
from ...pictures.height_map import folds_counted
from ...recordings.doubt import REST, Reason, reason_of
from ...recordings.electrode_faults import STALE, alike, repeats, silent
from ...recordings.flags import Flag
from ...recordings.preparer import DOUBTS, prepare
from ...recordings.quiet import tare_frames, window_frames
from ...recordings.recording import Recording
from ...recordings.rest_level import Baseline, Changes
from ...recordings.signal_kind import counts_a_unit, full_scale
from ...recordings.signals import EVERY, PrepareOptions, Signals
from ...recordings.unit import film
from ...sensors import SAMPLE_RATE, SOURCE
from ...sensors.descriptor import of_kind
from ...sensors.fluid_sensor import FALLS, POLARITIES, Fluid
from ...translation.contact_track import ForwardTracker
from ...translation.trust_words import in_words
from ..frame_pass import Tools

if TYPE_CHECKING:
    from ...recordings.electrode_gains import ElectrodeGains

LONGEST = 10.0  # s that are looked through for rest and polarity; then the calmest so far is taken (assumed)
LEAST_RATE, MOST_RATE = 1.0, 1e4  # Hz
AGAIN = 25  # new frames after which they are looked at again
REMEMBERED = 1000  # latencies whose quantiles are reported


class LiveSignals:
    """Changes against rest, frame by frame, with rest and film from the first frames, which are prepared together.

    Rest and film are those of the first quiet part; drift and glitches are not removed. The first contacts decide the
    polarity; until then it is the given one, or "falls".
    rate : Hz, None for that of the first rows' stamps
    options : of the preparation, without effect of drift, repair and smooth; tare is of the first 10 s
    unit : gains, offsets and rest, which is taken if the first window is not calm near it; sensor : the sensor's name
    found : where the rest is from, in words, "" until it is known; polarity : "falls" or "rises"; evidence : what
        shows that, in words; sure : true once it is final
    silent : true if the finger does not respond: its electrodes all read the same
    Raises TactileError for a tare of other frames."""

    def __init__(
        self,
        rate: float | None = SAMPLE_RATE,
        options: PrepareOptions | None = None,
        unit: ElectrodeGains | None = None,
        sensor: str = SOURCE,
    ) -> None:
        options = options or PrepareOptions()
        self._unit, self._sensor = unit, sensor
        self._options = dataclasses.replace(options, drift=False, repair=False, smooth=1)
        if unit is not None:
            self._options = dataclasses.replace(self._options, rest=unit.rest(), film=unit.film)
        self.rate = rate or 0.0  # Hz; 0 until the first rows tell it
        if rate:
            self._begin(rate)
        self._seen: Recording | None = None
        self._known: Signals | None = None  # the first frames', once they show rest
        self._rest_pdc, self._pdc_factor = np.nan, 1.0  # counts at rest; counts that 1 in the file's PDC means
        self._factor = 1.0  # counts that an electrode's 1 in the file means
        self.polarity = options.polarity if options.polarity in POLARITIES else FALLS
        self.sure, self.silent = options.polarity in POLARITIES, False
        self._noisy, self._last = False, np.zeros((0, 0))  # whether noise keeps rows apart; the last rows
        self.found, self.evidence = "", "as given" if self.sure else "no contact has shown it yet"

    def _begin(self, rate: float) -> None:
        """Find, for a rate in Hz, the frames of the first look for rest and of the last."""
        self.rate, self._most, self._next_look = rate, round(LONGEST * rate), window_frames(rate)
        if self._options.tare not in (None, "none"):
            tare = tare_frames(self._options.tare, self._most)
            self._options, self._next_look = dataclasses.replace(self._options, tare=tare), tare.stop

    def learn(self, rows: Recording) -> bool:
        """Search new frames, rows, for rest and polarity; return true once rest is known."""
        if not self.rate:
            self._begin(_stamped_rate(rows))
        self.silent = bool(alike(rows.electrodes)[-1]) and (self._known is None or self._known.kind == "raw")
        self._last = np.concatenate([self._last, rows.electrodes] if len(self._last) else [rows.electrodes])[-STALE:]
        if self._known is None or not self.sure:
            self._seen = seen = self._joined(rows)
            if len(seen) >= self._next_look and not silent(seen.electrodes).all():
                self._look(seen)
        return self._known is not None

    def _joined(self, rows: Recording) -> Recording:
        """Return the frames so far, up to a number, with the channels that preparation needs."""
        electrodes, pdc = rows.electrodes, rows.pdc
        if self._seen is not None:
            electrodes = np.concatenate([self._seen.electrodes, electrodes])[: self._most]
            both = pdc is not None and self._seen.pdc is not None
            pdc = np.concatenate([self._seen.pdc, pdc])[: self._most] if both else None
        count = len(electrodes)
        return Recording(
            rows.name, rows.path, rows.layout, np.arange(count) / self.rate, 0.0, electrodes, np.arange(count),
            np.zeros(count, np.uint16), pdc=pdc, about=rows.about, sensor=self._sensor,
        )  # fmt: skip

    def _look(self, seen: Recording) -> None:
        """Prepare the frames so far; store their rest, once it shows, and their polarity."""
        self._next_look = len(seen) + AGAIN
        if self._known is None:
            unit = full_scale(seen.electrodes)
            self._factor, self._noisy = unit[0] if unit else 1.0, repeats(seen.electrodes)[1]
        signals = prepare(seen, dataclasses.replace(self._options, counts_per_unit=self._factor))
        of_unit = Reason.REST_OF_UNIT in map(reason_of, signals.warnings) or self._options.tare is not None
        if self._known is None and (len(seen) == self._most or signals.quiet.any() or of_unit):
            self._known, self.found = signals, _source(signals)
            if seen.pdc is not None:
                self._pdc_factor, _ = counts_a_unit(seen.pdc, self._factor, self._sensor)
                rest = (self._pdc_factor * seen.pdc - signals.pdc)[np.isfinite(signals.pdc)]
                self._rest_pdc = np.median(rest) if len(rest) else np.nan
        self.polarity, self.evidence = (signals.report[name] for name in ("polarity", "polarity_evidence"))
        self.sure = self._options.polarity in POLARITIES or not signals.flags[0] & DOUBTS

    @property
    def held(self) -> bool:
        """Return true if the last 3 rows are equal though noise should differ: the driver stands still."""
        return self._noisy and self.known.kind == "raw" and repeats(self._last)[0].sum() == STALE - 1

    @property
    def known(self) -> Signals:
        """Return the first frames' signals, whose rest is taken for all. Raises ValueError before it is known."""
        if self._known is None:
            raise ValueError("no rest is known yet")
        return self._known

    def signals(self, electrodes: np.ndarray, pdc: np.ndarray) -> Signals:
        """Return the signals of electrodes (T, 19), pdc (T,), as in the file or NaN. Raises ValueError as `known`."""
        count, rest, kind = len(electrodes), self.known.rest, self.known.kind
        unheard = alike(electrodes) & (kind == "raw")
        flags = np.full(count, np.bitwise_and.reduce(self.known.flags) & ~DOUBTS, np.uint16)
        flags[unheard] |= np.uint16(Flag.DEAD_CHANNEL)
        flags[-1] |= np.uint16(Flag.DEAD_CHANNEL if self.held else 0)
        electrodes = electrodes * self._factor
        change = (electrodes - rest) * (1.0 if self.polarity == FALLS else -1.0)
        pdc = self._pdc_factor * pdc - self._rest_pdc
        elsewhere = any(reason_of(text) is Reason.REST_OF_UNIT for text in self.known.warnings)
        fluid = film.Film.given(self.known.film)
        pressed = of_kind(self._sensor, Fluid).readout.pressure * pdc > film.PRESSED
        whole = Changes(count, change.__getitem__)
        change = fluid.changes(whole, Baseline.constant(rest), ~pressed if elsewhere else None)[EVERY]
        signals = Signals(
            change=np.where(unheard[:, None], 0.0, change), rest=rest, drift=np.zeros_like(rest),
            electrodes=electrodes, kind=kind,
            quiet=np.zeros(count, bool), flags=flags, pdc=pdc,
            warnings=(), report={}, sensor=self._sensor, film=self.known.film,
        )  # fmt: skip
        if self._unit is None:
            return signals
        from ...recordings import electrode_gains

        return electrode_gains.apply(signals, self._unit)


def _stamped_rate(rows: Recording) -> float:
    """Return the rate, Hz, that the stamps of the first rows tell; 100 Hz if they come in bursts."""
    steps = len(rows.time) - 1
    even = not steps or 0.5 < steps / max(rows.duration * rows.rate, 1e-9) < 2
    return min(max(rows.rate, LEAST_RATE), MOST_RATE) if even else SAMPLE_RATE


def _source(signals: Signals) -> str:
    """Return in words where the signals' rest is from."""
    doubts = [text for text in signals.warnings if reason_of(text) in REST]
    parts = ", ".join(f"{first}:{last}" for first, last in signals.report["quiet_parts"])
    if doubts or not parts:
        return doubts[0] if doubts else signals.report["quiet_evidence"]
    return f"frames {parts}" + (", as given" if signals.report["tare"] == "given" else "")


@dataclass(frozen=True, eq=False)
class Shown:
    """A picture on display.
    frame : its index; confidence : 0..1; flags : bits of ``recordings.flags.Flag``; words : what these two say
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
        self, tools: Tools, rate: float | None, options: PrepareOptions | None = None,
        unit: ElectrodeGains | None = None,
    ) -> None:  # fmt: skip
        """Make a view of a recording. rate : Hz, or None; options, unit : see `LiveSignals`"""
        self.signals = LiveSignals(rate, options, unit, tools.translator.source)
        self._tools = tools
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
        state = self._track(evidence, self.frames / self.signals.rate) if translator.answer.follows else None
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
