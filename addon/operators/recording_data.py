"""A recording file as ``tactile_core`` reads and translates it, kept for the next operator that asks."""

from __future__ import annotations

import dataclasses
import functools
import os
from collections.abc import Callable

import numpy as np

from ...tactile_core import recordings
from ...tactile_core.jobs import frame_range
from ...tactile_core.recordings import PrepareOptions, Recording, Signals
from ...tactile_core.recordings.polarity import AUTO
from ...tactile_core.translation import translate
from ...tactile_core.translation.contact_track import Evidence, Tracked
from ...tactile_core.translation.translate import Translation
from ..process import recording_reader

CHUNK = 64  # frames between two steps of the progress: the networks' own block


@dataclasses.dataclass(frozen=True, eq=False)
class Translated:
    """A recording, which frames of it (T,), their signals and what they become."""

    recording: Recording
    chosen: np.ndarray
    signals: Signals
    translation: Translation


@functools.cache
def translator() -> translate.Translator:
    """Return the shipped networks, loaded once."""
    return translate.load_translator()


def load(path: str, tare: str, frames: str, progress: Callable[[float], None], polarity: str = AUTO) -> Translated:
    """Read, tare and translate. Raises TactileError for what cannot be read, or frames that are not there."""
    try:
        changed = os.stat(path).st_mtime_ns
    except OSError:
        changed = 0  # the reader says what is wrong
    key = (path, changed, tare, frames, polarity)
    if key not in _KEPT:
        found = _translated(path, tare, frames, progress, polarity)
        _KEPT.clear()
        _KEPT[key] = found
    return _KEPT[key]


_KEPT: dict[tuple, Translated] = {}  # the last one: importing and translating ask for the same


def _translated(path: str, tare: str, frames: str, progress: Callable[[float], None], polarity: str) -> Translated:
    recording = recording_reader.read(path)
    chosen = frame_range.select(frame_range.parse_frames(frames), len(recording))
    options = PrepareOptions(tare=None if tare in ("", "auto") else tare, polarity=polarity)
    signals = recordings.prepare(recording, options)

    def read_posteriors(start: int, stop: int) -> tuple[np.ndarray, Evidence]:
        return recording.time[start:stop], translator().posterior(signals.at(slice(start, stop)))

    tracked, parts = Tracked(read_posteriors, len(recording)), []
    for start in range(0, len(chosen), CHUNK):
        frames = chosen[start : start + CHUNK]
        parts.append(translator()(signals.at(frames), tracked(frames)))
        progress(min(1.0, (start + CHUNK) / len(chosen)))
    return Translated(recording, chosen, signals.at(chosen), Translation.joined(parts))
