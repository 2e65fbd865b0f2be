"""Prepare the signals of frames in which the finger responds; frames without response get no change and a flag."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..errors import TactileError
from ..sensors import SOURCE, electrode_count, typical_rest
from .assemble import check_electrodes
from .electrode_faults import silent as silent_frames
from .flags import Flag
from .preparation import prepare_all
from .quiet import tare_frames
from .recording import Recording
from .signals import EVERY, FRAMEWISE, PrepareOptions, Signals


def prepare(recording: Recording, options: PrepareOptions | None = None, frames: slice | np.ndarray = EVERY) -> Signals:
    """Repair, detect the kind, tare, remove drift. Raises TactileError for options this recording cannot meet.
    frames : (n,) or slice, whose signals are returned; all frames of the recording decide the result"""
    options = options or PrepareOptions()
    options.check()
    check_electrodes(recording.path, recording.electrodes.shape[1], "electrodes", recording.sensor)
    silent = silent_frames(recording.electrodes)
    if silent.any():
        return _prepare_answers(recording, options, silent).at(frames)
    return prepare_all(recording, options, frames)


def _prepare_answers(recording: Recording, options: PrepareOptions, silent: np.ndarray) -> Signals:
    """Prepare frames with a response; those marked silent (T,) bool get no change and a flag. No tare may lie there."""
    heard = np.flatnonzero(~silent)
    first = np.flatnonzero(silent)[0]
    where = f"{recording.row_word} {recording.rows[first]}"
    warning = (
        f"the finger does not answer in {silent.sum()} of {len(silent)} frames, first in {where}: no contact there"
    )
    if len(heard):
        found = prepare_all(recording.at(heard), _renumbered(recording, options, silent))
    else:  # a finger at rest stands for it, so that all that is reported of a recording is
        rest = typical_rest(recording.sensor)
        rest = np.full(electrode_count(SOURCE), 1.0) if rest is None else rest
        still = replace(recording, electrodes=np.tile(rest, (len(silent), 1)))
        found = prepare_all(still, replace(options, kind="raw", tare=None))
        found = replace(found, change=np.zeros_like(found.change), warnings=recording.warnings)
        heard = np.arange(len(silent))
    spread: dict[str, Any] = {}
    for name in FRAMEWISE:
        values = getattr(found, name)
        spread[name] = np.zeros((len(silent), *values.shape[1:]), values.dtype)
        spread[name][heard] = values
    spread["electrodes"][silent] = recording.electrodes[silent]
    common = np.bitwise_and.reduce(found.flags)
    spread["flags"][silent] = recording.flags[silent] | common | np.uint16(Flag.DEAD_CHANNEL)
    parts = [[int(heard[a]), int(heard[b - 1]) + 1] for a, b in found.report["quiet_parts"]]
    report = {**found.report, "frames": len(silent), "quiet_parts": parts, "frames_without_answer": int(silent.sum())}
    return replace(found, **spread, report=report, warnings=(warning, *found.warnings))


def unanswered(signals: Signals) -> np.ndarray:
    """Mark (T,) bool the frames of prepared signals in which the finger did not respond."""
    return (signals.flags & Flag.DEAD_CHANNEL > 0) & ~signals.change.any(axis=1)


def _renumbered(recording: Recording, options: PrepareOptions, silent: np.ndarray) -> PrepareOptions:
    """Return the options with the tare's frames renumbered among those with a response, not silent (T,) bool."""
    if options.tare in (None, "none"):
        return options
    frames = tare_frames(options.tare, len(silent))
    first, last = (int((~silent[:end]).sum()) for end in (frames.start, frames.stop))
    if first == last:
        found = f"frames {frames.start}:{frames.stop}, in which the finger does not answer"
        raise TactileError(f"{recording.path}, option tare", found, "frames without contact", "Name others")
    return replace(options, tare=slice(first, last))
