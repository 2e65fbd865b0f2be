"""Translate a whole recording with one call: prepare its signals, track the contact, translate every frame."""

from __future__ import annotations

import os
from functools import lru_cache

import numpy as np

from ..errors import TactileError
from ..recordings import PrepareOptions, Recording, electrode_gains
from ..recordings.fingers import split
from ..recordings.signals import Signals
from .answer import Answer
from .contact_track import Evidence, Tracked
from .translate import Translation, Translator, load_translator

CHUNK = 64  # frames translated at a time: bounds the networks' intermediate memory to about 20 MB


def translate(
    recording: Recording,
    *,
    frames: slice = slice(None),
    prepare: PrepareOptions | None = None,
    sensor: str | os.PathLike[str] | None = None,
    weights: str | os.PathLike[str] | None = None,
    answer: Answer | None = None,
) -> Translation:
    """Translate a recording to skin deformation, DIGIT gel deformation and force, as `tactile convert` does.

    Recordings are of a BioTac, or of the sensor that the weights are for.

    recording : of ``tactile.read``
    frames : part of the recording to translate, such as ``slice(100, 200)``; the contact is tracked through all
        frames, so a frame's values do not depend on which others are requested
    prepare : options for repair, rest level and kind of the signals; None detects them
    sensor : file of `tactile adapt` with the rest and gains of this BioTac; None assumes a typical unit
    weights : folder of networks, which name their sensors; None for those that ship. Of another gel than a DIGIT's,
        ``..._digit`` are that gel's
    answer : options of the estimate (shift on the gel, mean in place of the most plausible contact); None for default

    Returns a :class:`Translation`, arrays with the T requested frames first: ``displacement_biotac`` (T, 3650, 3) m,
    ``displacement_digit`` (T, 2867, 3) m, ``force`` (T, 3) N, ``contact_center`` (T, 2) m, ``confidence`` (T,),
    ``error_bound_digit`` (T,) m, ``flags`` (T,). A frame takes 80 kB.
    Raises TactileError for signals without a rest level, bad options, and weights that are missing or changed.

    >>> recording = tactile.read("touch.csv")
    >>> touch = tactile.translate(recording)
    >>> touch.force[:, 1].max()  # N, largest force into the skin
    """
    chosen = np.arange(len(recording))[frames]
    if not len(chosen) or chosen[0] > chosen[-1]:
        expected = f"a slice forward through {len(recording)} frames that holds at least one"
        raise TactileError("translate, frames", str(frames), expected)
    chosen_by = (None, recording.sensor) if weights is None else (os.fspath(weights), None)
    translator = _shared_translator(*chosen_by, answer or Answer())
    signals = _prepared(recording, prepare, sensor)
    tracked = _tracked(translator, recording, signals)
    parts = [
        translator(signals.at(some), None if tracked is None else tracked(some))
        for some in (chosen[start : start + CHUNK] for start in range(0, len(chosen), CHUNK))
    ]
    return Translation.joined(parts)


@lru_cache(maxsize=2)
def _shared_translator(weights: str | None, source: str | None, answer: Answer) -> Translator:
    """Load networks once a process: 13 MB, a quarter of a second."""
    return load_translator(weights, answer, None, source)


def _prepared(recording: Recording, options: PrepareOptions | None, sensor: str | os.PathLike[str] | None) -> Signals:
    """Prepare the signals, with the unit's rest and gains where a sensor file is given."""
    if sensor is None:
        return electrode_gains.prepare_unit(recording, options, None)
    unit = electrode_gains.read(sensor).gains_for(recording.path, split(recording.path)[1], sensor, recording.sensor)
    return electrode_gains.prepare_unit(recording, options, unit)


def _tracked(translator: Translator, recording: Recording, signals: Signals) -> Tracked | None:
    """Contact states of all frames, tracked through time, or None where frames are estimated alone."""
    if not translator.answer.follows:
        return None

    def read(start: int, stop: int) -> tuple[np.ndarray, Evidence]:
        return recording.time[start:stop], translator.posterior(signals.at(slice(start, stop)))

    return Tracked(read, len(recording))
