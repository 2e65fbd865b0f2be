"""Pass over the frames of a recording through all stages, in chunks: prepare, track, decode, draw and write."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..files.stopwatch import Stopwatch
from ..pictures.height_map import folds_counted
from ..translation.gel_place import beyond_picture
from ..translation.translate import CHUNK, Read, RecordingPass
from .drawer import Drawer
from .frames_file import FramesFile, kept
from .results import TRANSLATED

if TYPE_CHECKING:
    from ..recordings import Signals
    from ..translation.translator import Translator

Take = Callable[[np.ndarray, dict[str, np.ndarray]], None]


@dataclasses.dataclass(frozen=True)
class Tools:
    """Networks and drawer of a conversion, the same for every recording. calibration : file, None for the shipped one
    gel : "translated", "solved" or "ball:28", see ``convert.ToolOptions``"""

    translator: Translator
    drawer: Drawer
    calibration: str | None = None
    gel: str = TRANSLATED

    @property
    def pair(self) -> tuple[str, str]:
        """Return the names of the sensor whose recordings are translated, and of the gel that is drawn."""
        return self.translator.source, self.drawer.target


class FramePass:
    """Translate and draw a recording's frames, part by part, and write the file of their arrays.
    folded : number of height maps so far in which the gel folds over itself"""

    def __init__(
        self, tools: Tools, read: Read, count: int, keep: Iterable[str], clock: Stopwatch | None = None
    ) -> None:
        """Store the tools. read : function from frames to their times, s, and signals; count : the recording's frames
        keep : words of --keep. Raises TactileError for motion of dots on a gel without dots."""
        self._translator, self._drawer, self._pair = tools.translator, tools.drawer, tools.pair
        self._keep, self._clock = tuple(keep), clock or Stopwatch()
        self._decoded = RecordingPass(tools.translator, read, count)
        self._dots = tools.drawer.needed_dots() if "marker_motion" in self._keep else None
        self.folded = 0

    def write(
        self, path: Path, frames: np.ndarray, signals: Signals, start_time: float, about: dict[str, Any],
        take: Take | None = None, labels: dict[str, np.ndarray] | None = None, room: int = 0,
    ) -> None:  # fmt: skip
        """Translate and draw frames (T,), rising indices, chunk by chunk, and write their arrays to a new file.
        signals : of any frame, for the recording's rest and kind; start_time : unix s; about : the file's attributes
        take : called with each chunk's frames and arrays; labels : name -> (T,) texts
        room : bytes before the HDF5 part, 0 or 512, for a shard's checksum"""
        words = kept(self._keep, self._translator.answer)
        with FramesFile(path, len(frames), words, about, room=room, pair=self._pair) as file:
            for start in range(0, len(frames), CHUNK):
                some = frames[start : start + CHUNK]
                arrays = self(some)
                with self._clock.stage("hdf5"):
                    file.write(start, arrays)
                if take is not None:
                    take(some, arrays)
            file.write_labels(labels or {})
            file.annotate("time", start_time=start_time)
            file.annotate("electrodes", rest=signals.rest, kind=signals.kind)
            if self._dots is not None:
                file.annotate("marker_motion", rest=self._dots.rest)

    def __call__(self, frames: np.ndarray) -> dict[str, np.ndarray]:
        """Return the kept arrays of rising frames (T,), by the names of frames.h5, and those they are made from."""
        with self._clock.stage("translate"):
            arrays = self._translate(frames)
        if "traction" in self._keep:
            from .solved_gel import gel_traction  # with all of contact mechanics

            with self._clock.stage("traction"):
                arrays |= gel_traction(arrays, self._drawer.target)
        if self._dots is not None:
            arrays["marker_motion"] = self._dots.motion(arrays["displacement_digit"])
        if "height" in self._keep or "image" in self._keep:
            arrays["height_map"] = self._heights(arrays["displacement_digit"])
        if "image" in self._keep:
            arrays["image"] = np.stack(self.pictures(arrays, np.arange(len(frames))))
        return arrays

    def _translate(self, frames: np.ndarray) -> dict[str, np.ndarray]:
        found = self._decoded(frames)
        arrays, signals = dict(vars(found.translation)), found.signals
        if self._translator.answer.samples:
            arrays |= self._translator.plausible(found.evidence, frames, signals.stiffness)
        arrays |= {"electrodes": signals.electrodes, "pressure_measured": signals.pressure_measured}
        beyond = beyond_picture(arrays["contact_center"], self._drawer.camera)
        arrays["flags"] = arrays["flags"] | signals.flags | beyond
        return self._drawer.gel(arrays) | {"frame": frames.astype(np.int32), "time": found.time}

    def _heights(self, displacement: np.ndarray) -> np.ndarray:
        with self._clock.stage("height_map"), folds_counted() as folds:
            heights = self._drawer.height_map(displacement)
        self.folded += len(folds)
        return heights

    def pictures(self, arrays: dict[str, np.ndarray], rows: np.ndarray) -> list[np.ndarray]:
        """Return the pictures (H, W, 3) uint8 of rows (n,) of the arrays, drawn if the arrays do not hold them."""
        if "image" in arrays:
            return [arrays["image"][row] for row in rows]
        moved = arrays["displacement_digit"][rows]
        heights = arrays["height_map"][rows] if "height_map" in arrays else self._heights(moved)
        with self._clock.stage("shade"):
            return [self._drawer.draw(*each) for each in zip(heights, moved, strict=True)]
