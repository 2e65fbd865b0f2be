"""The rows of a recording that a selection of its frames needs: of a long one only these stay in memory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..recordings import PrepareOptions, Recording, Signals, electrode_gains
from ..recordings.electrode_gains import ElectrodeGains
from ..translation.contact_track import needed


@dataclass(frozen=True, eq=False)
class Needed:
    """Selected frames, and what their translation needs.

    frames : (T,) selected, rising; rows : (n,) needed, rising; count : frames of the whole recording
    recording, signals : of the rows alone, prepared by all of the recording
    """

    frames: np.ndarray
    rows: np.ndarray
    count: int
    recording: Recording
    signals: Signals

    @classmethod
    def prepared(
        cls,
        recording: Recording,
        frames: np.ndarray,
        tracked: bool,
        options: PrepareOptions | None = None,
        unit: ElectrodeGains | None = None,
    ) -> Needed:
        """Prepare a recording for frames (T,); tracked : their neighbours in time are needed, too.

        Raises TactileError like `electrode_gains.prepare_unit`.
        """
        rows, count = needed(frames, len(recording)) if tracked else frames, len(recording)
        if 2 * len(rows) > count:  # a copy would take more than it lets go
            every = electrode_gains.prepare_unit(recording, options, unit)
            return cls(frames, np.arange(count), count, recording, every)
        signals = electrode_gains.prepare_unit(recording, options, unit, rows)
        return cls(frames, rows, count, recording.at(rows), signals)

    def at(self, frames: np.ndarray) -> np.ndarray:
        """Return the rows' indices (n,) of needed frames (n,)."""
        return np.searchsorted(self.rows, frames)

    def between(self, start: int, stop: int) -> slice:
        """Return the rows of frames from `start` up to `stop`, all needed."""
        first = int(np.searchsorted(self.rows, start))
        return slice(first, first + stop - start)
