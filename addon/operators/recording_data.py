"""A recording file as ``tactile_core`` reads and translates it, kept for the next operator that asks."""

from __future__ import annotations

import dataclasses
import functools
import os
from collections.abc import Callable

import bpy
import numpy as np

from ...tactile_core import accuracy
from ...tactile_core.errors import TactileError
from ...tactile_core.jobs import results
from ...tactile_core.recordings import PrepareOptions, Recording, Signals, readers
from ...tactile_core.translation.translate import PreparedRows, load_translator, translated
from ...tactile_core.translation.translator import Translation, Translator
from ...tactile_core.translation.weights import CARD_NAME
from ..process import recording_reader
from ..settings.properties import RecordingOptions


@dataclasses.dataclass(frozen=True, eq=False)
class Translated:
    """A recording, the numbers (T,) of its translated frames, their signals and translation, and the networks used."""

    translator: Translator
    recording: Recording
    chosen: np.ndarray
    signals: Signals
    translation: Translation

    def columns(self) -> dict[str, np.ndarray]:
        """Return the values (T,) or (T, k) of the skin's custom properties by name; the force in Blender's axes."""
        translation = self.translation
        values = {
            "electrodes": self.signals.change,
            "force": translation.force[:, [0, 2, 1]] * np.array([1, 1, -1]),
            "confidence": translation.confidence,
            "expected_error_um": 1e6 * translation.expected_error_biotac,
            "dent_um": 1e6 * accuracy.lengths(translation.displacement_biotac).max(axis=1),
            "flags": translation.flags,
        }
        if self.recording.pdc is not None:
            values["pdc"] = self.recording.pdc[self.chosen]
        return values


@functools.lru_cache(maxsize=2)
def _translator(weights: str, source: str | None, _changed: int) -> Translator:
    """Load networks once, for an empty text those that ship for a sensor, whichever gel they lead to."""
    return load_translator(weights or None, target=None, source=source)


def translator_of(weights: str, path: str) -> Translator:
    """Return the networks in a folder, else those that ship for a recording. Raises TactileError without networks."""
    source = None if weights else readers.sensor_of_first([path])
    folder = bpy.path.abspath(weights) if weights else ""
    try:
        changed = os.stat(os.path.join(folder, CARD_NAME)).st_mtime_ns if folder else 0
    except OSError:
        changed = 0  # the loader says what is wrong
    return _translator(folder, source, changed)


def load(path: str, asked: RecordingOptions, progress: Callable[[float], None]) -> Translated:
    """Read, tare and translate. Raises TactileError for what cannot be read, or frames that are not there."""
    known = translator_of(asked.weights, path)
    try:
        changed = os.stat(path).st_mtime_ns
    except OSError:
        changed = 0  # the reader says what is wrong
    key = (path, changed, asked.tare, asked.frames, asked.polarity, known.sha256)
    if key not in _KEPT:
        found = _translated(known, path, asked, progress)
        _KEPT.clear()
        _KEPT[key] = found
    return _KEPT[key]


_KEPT: dict[tuple, Translated] = {}  # the last one: importing and translating ask for the same


def _translated(
    translator: Translator, path: str, asked: RecordingOptions, progress: Callable[[float], None]
) -> Translated:
    recording = recording_reader.read(path, translator.source)
    if np.isnan(recording.time).all():
        found, advice = "snapshots, which do not follow each other", "Use `tactile convert --frames-apart`"
        raise TactileError(path, found, "frames in order", advice)
    chosen = results.select(results.parse_frames(asked.frames), len(recording))
    tare = None if asked.tare in ("", "auto") else asked.tare
    options = PrepareOptions(tare=tare, polarity=asked.polarity)
    rows = PreparedRows(recording, chosen, translator.answer, options)
    translation = translated(translator, rows, chosen, progress)
    return Translated(translator, recording, chosen, rows.read(chosen)[1], translation)
