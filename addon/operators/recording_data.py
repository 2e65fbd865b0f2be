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
from ...tactile_core.recordings.opened_file import opened
from ...tactile_core.recordings.recording import split
from ...tactile_core.recordings.tables import column_map
from ...tactile_core.recordings.tables.mapped_files import guess_map
from ...tactile_core.translation.answer import Answer
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
            "explained": translation.explained,
            "expected_error_um": 1e6 * translation.expected_error_biotac,
            "dent_um": 1e6 * accuracy.lengths(translation.displacement_biotac).max(axis=1),
            "flags": translation.flags,
        }
        if self.recording.pdc is not None:
            values["pdc"] = self.recording.pdc[self.chosen]
        return values


@functools.lru_cache(maxsize=2)
def _translator(weights: str, source: str | None, apart: bool, _changed: int) -> Translator:
    """Load networks once, for an empty text those that ship for a sensor, whichever gel they lead to."""
    return load_translator(weights or None, Answer(frames_apart=apart), None, source)


def translator_of(asked: RecordingOptions, path: str) -> Translator:
    """Return the networks in a folder, else those that ship for a recording. Raises TactileError without networks."""
    folder = _absolute(asked.weights)
    source = None if folder else readers.sensor_of_first([path])
    return _translator(folder, source, asked.apart, _changed(os.path.join(folder, CARD_NAME)) if folder else 0)


@functools.lru_cache(maxsize=8)
def _fingers(path: str, _changed: int) -> list[str]:
    try:
        return readers.list_fingers([path])
    except ModuleNotFoundError:  # its reader says which, when the file is imported
        return [path]


def fingers(path: str) -> list[str]:
    """List the recordings that a file holds, as ``hand.mat#1``; the file itself where it is one, or none."""
    return _fingers(path, _changed(path)) if os.path.isfile(path) else [path]


def write_columns(path: str, asked: RecordingOptions) -> str:
    """Write the map of columns that was named, guessed, where there is none yet; what was done in words, or nothing."""
    file = _absolute(asked.columns)
    if not file or os.path.lexists(file):
        return ""
    with opened(path) as (container, where, _, stream):
        column_map.write(file, *guess_map(where, container, stream))
    return f"{file}: written, guessed from names and values; check it"


def _absolute(path: str) -> str:
    return bpy.path.abspath(path) if path else ""


def _changed(path: str) -> int:
    """Return when a file was changed, ns; 0 where that is not known: its reader says what is wrong."""
    try:
        return os.stat(path).st_mtime_ns
    except OSError:
        return 0


def load(path: str, asked: RecordingOptions, progress: Callable[[float], None]) -> Translated:
    """Read, tare and translate. Raises TactileError for what cannot be read, or frames that are not there."""
    known = translator_of(asked, path)
    files = [(file, _changed(file)) for file in (split(path).file, _absolute(asked.columns), _absolute(asked.unit))]
    key = (path, *files, asked.tare, asked.frames, asked.polarity, asked.apart, known.sha256)
    if key not in _KEPT:
        found = _translated(known, path, asked, progress)
        _KEPT.clear()
        _KEPT[key] = found
    return _KEPT[key]


_KEPT: dict[tuple, Translated] = {}  # the last one: importing and translating ask for the same


def _translated(
    translator: Translator, path: str, asked: RecordingOptions, progress: Callable[[float], None]
) -> Translated:
    columns = _absolute(asked.columns)
    recording = recording_reader.read(path, translator.source, columns)
    if np.isnan(recording.time).all() and translator.answer.follows:
        found, advice = "snapshots, which do not follow each other", "Choose Each Frame Alone"
        raise TactileError(path, found, "frames in order", advice)
    unit = None
    if asked.unit:
        from ...tactile_core.recordings import electrode_gains  # reads by msgspec, which the wheels bring

        file = _absolute(asked.unit)
        unit = electrode_gains.read(file).gains_for(path, recording.section, file, recording.sensor)
    chosen = results.select(results.parse_frames(asked.frames), len(recording))
    tare = None if asked.tare in ("", "auto") else asked.tare
    options = PrepareOptions(tare=tare, polarity=asked.polarity)
    rows = PreparedRows(recording, chosen, translator.answer, options, unit)
    translation = translated(translator, rows, chosen, progress)
    return Translated(translator, recording, chosen, rows.read(chosen)[1], translation)
