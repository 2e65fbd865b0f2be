"""Read and translate a recording file by ``tactile_core``, and keep the last result for the next operator that asks."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import hashlib
import os
from collections.abc import Callable, Iterator

import bpy
import numpy as np

from ...tactile_core.errors import TactileError
from ...tactile_core.jobs import results
from ...tactile_core.recordings import PrepareOptions, Recording, Signals, readers
from ...tactile_core.recordings.opened_file import opened
from ...tactile_core.recordings.recording import split
from ...tactile_core.recordings.tables import column_map
from ...tactile_core.recordings.tables.mapped import guess_map
from ...tactile_core.translation.answer import Answer
from ...tactile_core.translation.translate import PreparedRows, load_translator, translated_parts
from ...tactile_core.translation.translator import Translation, Translator
from ...tactile_core.translation.weights import CARD_NAME
from ..objects import mesh_cache
from ..objects.mesh_cache import Motion
from ..process import recording_reader
from ..settings import kept_files
from ..settings.properties import RecordingOptions

MESH_CACHE = "MESH_CACHE"  # of ``properties.MOTIONS``
LONG = 2000  # frames; beyond it a mesh cache loads and saves faster than shape keys
_MOVED = "displacement_biotac", "displacement_digit"  # of skin and gel


@dataclasses.dataclass(frozen=True, eq=False)
class Translated:
    """A recording and its translation, with the networks that made it.

    chosen : (T,) indices of the recording's frames that were translated; signals : theirs, ready for the networks
    skin, gel : their movements; if these are in files, the translation's displacements are empty, (T, 0, 3)"""

    translator: Translator
    recording: Recording
    chosen: np.ndarray
    signals: Signals
    translation: Translation
    skin: Motion
    gel: Motion

    def fits(self, motion: str) -> bool:
        """Return true if the movements are where ``in_files`` wants them: in memory, or in files that still exist."""
        files = [moved.file for moved in (self.skin, self.gel) if moved.file is not None]
        return bool(files) == in_files(motion, len(self.chosen)) and all(file.is_file() for file in files)

    def columns(self) -> dict[str, np.ndarray]:
        """Return the skin's custom properties (T,) or (T, k) by name; ``curves.PROPERTIES`` has units and axes."""
        translation = self.translation
        values = {
            "electrodes": self.signals.change,
            "force": _in_blender_axes(translation.force),
            "confidence": translation.confidence,
            "explained": translation.explained,
            "expected_error_um": 1e6 * translation.expected_error_biotac,
            "flags": translation.flags,
        }
        if self.translator.answer.contacts > 1:
            values["second_force"] = _in_blender_axes(translation.second_force)
            values["second_center_mm"] = 1e3 * translation.second_center
        if self.recording.pdc is not None:
            values["pdc"] = self.recording.pdc[self.chosen]
        return values


def _in_blender_axes(force: np.ndarray) -> np.ndarray:
    return force[:, [0, 2, 1]] * np.array([1, 1, -1])


def in_files(motion: str, frames: int) -> bool:
    """Return true if a movement of this number of frames belongs in files.
    motion : "MESH_CACHE" for files, "SHAPE_KEYS" for none, "" for files above ``LONG`` frames"""
    return motion == MESH_CACHE or (not motion and frames > LONG)


@functools.lru_cache(maxsize=2)
def _translator(weights: str, source: str | None, answer: Answer, _changed: int) -> Translator:
    """Load networks and keep them: those in the folder ``weights`` or, for "", those that ship for ``source``.
    _changed : when the folder's card was changed, so that new weights are loaded again"""
    return load_translator(weights or None, answer, None, source)


def translator_of(asked: RecordingOptions, path: str) -> Translator:
    """Return the networks in the folder that the options ``asked`` name, else those that ship for the sensor of the
    recording ``path``. Raises TactileError if there are none."""
    folder = bpy.path.abspath(asked.weights)
    source = None if folder else readers.sensor_of_first([path])
    answer = Answer(frames_apart=asked.apart, contacts=2 if asked.two else 1)
    return _translator(folder, source, answer, _changed(os.path.join(folder, CARD_NAME)) if folder else 0)


@functools.lru_cache(maxsize=8)
def _fingers(path: str, _changed: int) -> list[str]:
    try:
        return readers.list_fingers([path])
    except ModuleNotFoundError:  # its reader says which, when the file is imported
        return [path]


def fingers(path: str) -> list[str]:
    """List the recordings in a file, such as ``hand.mat#1``; the path itself if it holds one, or is no file."""
    return _fingers(path, _changed(path)) if os.path.isfile(path) else [path]


def write_columns(path: str, asked: RecordingOptions) -> str:
    """Guess which columns of the recording ``path`` are what, and write that map to the file asked.columns if it is
    missing; return a sentence that says so, "" if nothing was written."""
    file = bpy.path.abspath(asked.columns)
    if not file or os.path.lexists(file):
        return ""
    with opened(path) as (container, where, _, stream):
        column_map.write(file, *guess_map(where, container, stream))
    return f"{file}: written, guessed from names and values; check it"


def _changed(path: str) -> int:
    """Return when a file was last changed, ns; 0 if it cannot be read, which its reader will report."""
    try:
        return os.stat(path).st_mtime_ns
    except OSError:
        return 0


def load(
    path: str, asked: RecordingOptions, progress: Callable[[float], None], motion: str, per_metre: float
) -> Translated:
    """Read, tare and translate a recording, or return the last result again if the same is asked for.

    progress : called with the share done, 0 to 1
    motion : "MESH_CACHE" (displacements in files), "SHAPE_KEYS" (in memory), or "" for files above ``LONG`` frames
    per_metre : Blender units in a metre, of such files. Raises TactileError for unreadable files and missing frames."""
    path = os.path.normpath(path)  # a .blend's relative path has another form
    per_metre = float(f"{per_metre:.6g}")  # Blender holds float32
    known = translator_of(asked, path)
    named = split(path).file, *map(bpy.path.abspath, (asked.columns, asked.unit))
    files = [(file, _changed(file)) for file in named]
    options = asked.tare, asked.frames, asked.polarity, known.answer, known.sha256
    key = (path, *files, *options, per_metre, kept_files.folder(kept_files.CACHE))
    if key not in _KEPT or not _KEPT[key].fits(motion):
        found = _translated(known, path, asked, progress, motion, key)
        _KEPT.clear()
        _KEPT[key] = found
    return _KEPT[key]


_KEPT: dict[tuple, Translated] = {}  # the last one: importing and translating ask for the same


def _translated(
    translator: Translator,
    path: str,
    asked: RecordingOptions,
    progress: Callable[[float], None],
    motion: str,
    key: tuple,
) -> Translated:
    columns = bpy.path.abspath(asked.columns)
    recording = recording_reader.read(path, translator.source, columns)
    if np.isnan(recording.time).all() and translator.answer.follows:
        found, advice = "snapshots, which do not follow each other", "Choose Each Frame Alone"
        raise TactileError(path, found, "frames in order", advice)
    unit = None
    if asked.unit:
        from ...tactile_core.recordings import electrode_gains  # reads by msgspec, which the wheels bring

        file = bpy.path.abspath(asked.unit)
        unit = electrode_gains.read(file).gains_for(path, recording.section, file, recording.sensor)
    chosen = results.select(results.parse_frames(asked.frames), len(recording))
    tare = None if asked.tare in ("", "auto") else asked.tare
    options = PrepareOptions(tare=tare, polarity=asked.polarity)
    rows = PreparedRows(recording, chosen, translator.answer, options, unit)
    about = translator, recording, chosen, rows.read(chosen)[1]
    parts = _with_progress(translated_parts(translator, rows, chosen), len(chosen), progress)
    pair = translator.source, translator.target
    if in_files(motion, len(chosen)):
        return Translated(*about, *_in_files(pair, parts, len(chosen), recording.name, key))
    whole = Translation.joined(list(parts))
    skin, gel = (mesh_cache.in_memory(getattr(whole, name), sensor) for name, sensor in zip(_MOVED, pair, strict=True))
    return Translated(*about, whole, skin, gel)


def _with_progress(
    parts: Iterator[Translation], frames: int, progress: Callable[[float], None]
) -> Iterator[Translation]:
    """Yield the parts, and after each call ``progress`` with the share of all ``frames`` that is done, 0 to 1."""
    done = 0
    for part in parts:
        yield part
        done += len(part.force)
        progress(done / frames)


def _in_files(
    pair: tuple[str, str], parts: Iterator[Translation], frames: int, name: str, key: tuple
) -> tuple[Translation, Motion, Motion]:
    """Write the displacements of a translation's parts into files; return the joined rest, and the movements of skin
    and gel.

    pair : names of the two sensors; frames : number in all parts; name : of the recording
    key : all that the files depend on, at its end Blender units in a metre and the folder; it and the name make the
    files' names, so that no other file is replaced
    """
    token, folder = hashlib.sha256(repr(key[:-1]).encode()).hexdigest()[:8], kept_files.folder(kept_files.CACHE)
    # A file's name holds 255 bytes, of which a letter takes up to four.
    files = [folder / f"{bpy.path.clean_name(f'{name[:50]} {sensor} {token}')}.pc2" for sensor in pair]
    light = []
    with contextlib.ExitStack() as both:
        writers = [both.enter_context(mesh_cache.writing(file, sensor, key[-2], frames))
                   for file, sensor in zip(files, pair, strict=True)]  # fmt: skip
        for part in parts:
            for writer, field in zip(writers, _MOVED, strict=True):
                writer.add(getattr(part, field))
            light.append(dataclasses.replace(part, **dict.fromkeys(_MOVED, np.empty((len(part.force), 0, 3)))))
    skin, gel = (writer.motion(file) for writer, file in zip(writers, files, strict=True))
    return Translation.joined(light), skin, gel
