"""Translate a recording in one pass: prepare its signals, track the contact, decode every frame."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .. import sensors
from ..errors import TactileError, path_text
from ..files.threads import in_one_thread
from ..recordings import PrepareOptions, Recording, Signals
from ..recordings.preparer import Preparer
from ..sensors import SOURCE, TARGET
from ..sensors.descriptor import NODES
from . import networks, reference_signals
from .answer import Answer
from .card import REST, check_pair, check_tables
from .contact_track import Evidence, Tracker, needed
from .simulated_likeness import patterns_of, shipped_patterns
from .translator import Translation, Translator
from .weights import read_card

if TYPE_CHECKING:
    from ..recordings.electrode_gains import ElectrodeGains

CHUNK = 64  # frames decoded at a time: about 5 MB of displacements, and the networks' own block
Read = Callable[[np.ndarray], tuple[np.ndarray, Signals]]  # times (n,) s and signals of rising frames (n,)


class Decoded(NamedTuple):
    """T frames of a recording after the networks.
    time : (T,) s; signals : what the networks were given; translation : the result
    evidence : posterior of each frame by its own signals"""

    time: np.ndarray
    signals: Signals
    evidence: Evidence
    translation: Translation


class RecordingPass:
    """Translates frames of a recording to `Decoded`; a frame's result does not depend on which others are asked for."""

    def __init__(self, translator: Translator, read: Read, count: int) -> None:
        """Take read(frames), a function that returns their times and signals; count : frames of the whole recording."""
        self._translator, self._read = translator, read
        self._tracker = Tracker(self._evidence, count) if translator.answer.follows else None

    def _evidence(self, start: int, stop: int) -> tuple[np.ndarray, Evidence]:
        time, signals = self._read(np.arange(start, stop))
        return time, self._translator.encode(signals)

    def __call__(self, frames: np.ndarray) -> Decoded:
        """Translate frames (T,) int, rising indices into the recording."""
        time, signals = self._read(frames)
        if self._tracker is None:
            evidence, state = self._translator.encode(signals), None
        else:
            evidence, state = self._tracker(frames)
        return Decoded(time, signals, evidence, self._translator.decode(signals, evidence, state))


def pass_over(translator: Translator, signals: Signals, time: np.ndarray) -> RecordingPass:
    """Return the `RecordingPass` over signals in memory; time : (T,) s, of their frames"""
    return RecordingPass(translator, lambda frames: (time[frames], signals.at(frames)), len(time))


class PreparedRows:
    """Prepared frames of a recording in memory; of a long one only those that the requested frames depend on.
    recording, signals : these frames, prepared by the whole recording's rest; count : frames of the whole recording"""

    def __init__(
        self, recording: Recording, frames: np.ndarray, answer: Answer, options: PrepareOptions | None = None,
        unit: ElectrodeGains | None = None,
    ) -> None:  # fmt: skip
        """Prepare rising ``frames`` (T,) of a recording and, if `answer` tracks the contact, their neighbours.
        options, unit : for `Preparer`, which raises TactileError for a recording that it cannot prepare"""
        rows, self.count = needed(frames, len(recording)) if answer.follows else frames, len(recording)
        if 2 * len(rows) > self.count:  # a copy would take more than it lets go
            self._rows, self.recording = np.arange(self.count), recording
            self.signals = Preparer(options, unit)(recording)
        else:
            self._rows, self.recording = rows, recording.at(rows)
            self.signals = Preparer(options, unit)(recording, rows)

    def at(self, frames: np.ndarray) -> np.ndarray:
        """Return the indices (n,), among the frames in memory, of the recording's frames (n,)."""
        return np.searchsorted(self._rows, frames)

    def read(self, frames: np.ndarray) -> tuple[np.ndarray, Signals]:
        """Return times (n,) s and signals of frames (n,) of the recording."""
        rows = self.at(frames)
        return self.recording.time[rows], self.signals.at(rows)


@in_one_thread
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
    prepare, answer = PrepareOptions() if prepare is None else prepare, Answer() if answer is None else answer
    for name, given, kind in (
        ("recording", recording, Recording), ("prepare", prepare, PrepareOptions), ("answer", answer, Answer)
    ):  # fmt: skip
        if not isinstance(given, kind):
            advice = "tactile.read reads a file; numpy.savez writes arrays to one" * (kind is Recording)
            raise TactileError(f"translate, {name}", f"a {type(given).__name__}", f"a {kind.__name__}", advice)
    if answer.samples:
        advice = "`tactile convert --samples` draws them"
        raise TactileError("translate, answer", f"{answer.samples} samples", "none", advice)
    recording.check()  # before its length is asked for
    try:
        chosen = np.arange(len(recording))[frames]
    except (IndexError, TypeError):  # no indices
        chosen = np.empty(0, int)
    if np.ndim(chosen) != 1 or not len(chosen) or (np.diff(chosen) <= 0).any():
        expected = f"a slice forward through {len(recording)} frames that holds at least one"
        raise TactileError("translate, frames", str(frames), expected)
    folder = None if weights is None else path_text(weights, "translate, weights", "a folder's name")
    card = None if folder is None else read_card(folder)[1]  # the folder may hold other weights than at the last call
    translator, unit = _shared_translator(folder, card, recording.sensor if folder is None else None, answer), None
    if sensor is not None:
        from ..recordings import electrode_gains  # reads by msgspec, which Blender has by the extension's wheels alone

        sensor = path_text(sensor, "translate, sensor", "the name of a unit's file")
        file, section = electrode_gains.read(sensor), recording.section
        unit = file.gains_for(recording.path, section, sensor, recording.sensor)
    rows = PreparedRows(recording, chosen, translator.answer, prepare, unit)
    return translated(translator, rows, chosen)


def translated(translator: Translator, rows: PreparedRows, frames: np.ndarray) -> Translation:
    """Return the translation of rising frames (T,) of a recording; rows : the recording prepared for them"""
    return Translation.joined(list(translated_parts(translator, rows, frames)))


def translated_parts(translator: Translator, rows: PreparedRows, frames: np.ndarray) -> Iterator[Translation]:
    """Yield translations of rising frames (T,) of a recording, `CHUNK` at a time; rows : its signals"""
    whole = RecordingPass(translator, rows.read, rows.count)
    for start in range(0, len(frames), CHUNK):
        yield whole(frames[start : start + CHUNK]).translation


@lru_cache(maxsize=2)
def _shared_translator(weights: str | None, card: str | None, source: str | None, answer: Answer) -> Translator:
    """Load networks for `translate`, which keeps them as long as their card has the hash ``card``: 13 MB, .25 s."""
    return load_translator(weights, answer, None, source)


def load_translator(
    folder: str | os.PathLike | None = None, answer: Answer | None = None, target: str | None = TARGET,
    source: str | None = SOURCE,
) -> Translator:  # fmt: skip
    """Load the networks of a weights folder, the shipped ones by default, with options of the estimate.

    target : the gel that they must translate to; None accepts any
    source : the sensor whose recordings they must translate, None accepts any; it also selects the shipped weights
    Raises TactileError for weights that are missing, changed, of another shape, or trained for other surfaces, and for
    a target that is no sensor or not theirs.
    """
    nets, place = networks.load(folder, source), folder or networks.shipped_folder(source)
    card_file = f"{place}, card.json"
    check_tables(nets.card, card_file)
    check_pair(nets.card, source, target, card_file)
    pair = nets.source, nets.target
    for key, here in ((f"{sensor}{NODES}", sensors.sensor_surface(sensor).sha256) for sensor in pair):
        if nets.card.get(key) != here:
            raise TactileError(
                f"{card_file}, {key}", f"{str(nets.card.get(key))[:12]}...",
                f"{here[:12]}..., the surface of this version", "Use weights trained with this version of the sensors",
            )  # fmt: skip
    if sensors.contacts_of(nets.source) is None:
        rest = np.array(nets.card.get(REST, sensors.typical_rest(nets.source)))
        known = patterns_of(reference_signals.read(place).typical, rest)
    else:
        known = shipped_patterns(nets.source)
    return Translator(nets, answer, known)
