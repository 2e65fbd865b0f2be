"""Pass over the frames of a recording through all stages, in chunks: prepare, track, decode, draw and write. Drawing is
to solve the gel's contact, if asked, then to map heights under the camera, pictures and printed dots."""

from __future__ import annotations

import dataclasses
import functools
import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import TactileError
from ..files.provenance import Stopwatch
from ..pictures.height_map import folds_counted
from ..sensors import TARGET, sensor_surface, title
from ..sensors.camera import Camera
from ..translation.gel_place import beyond_picture
from ..translation.translate import CHUNK, Read, RecordingPass
from .frames_file import FramesFile, kept
from .results import TRANSLATED, ball_radius

if TYPE_CHECKING:
    from ..pictures.marker_field import MarkerField
    from ..recordings import Signals
    from ..translation.translator import Translator

Solver = Callable[[dict[str, np.ndarray]], dict[str, np.ndarray]]
Take = Callable[[np.ndarray, dict[str, np.ndarray]], None]


@dataclasses.dataclass(frozen=True)
class Drawer:
    """Camera and lights of a gel, ready to draw it; the same for every recording.

    height_map : function from displacement (T, M, 3) m of the gel's M nodes to heights (T, H, W) m under the camera
    shade : function from heights (H, W) m, and the share (H, W) of light that dots leave, to a picture (H, W, 3) uint8
    preset : name of the preset of ``shade``; camera : of the gel that is drawn; contacts beside its picture are flagged
    solve : function from arrays by the names of frames.h5 to these with solved gels; None keeps the networks' gels
    dots : those printed on the gel that is drawn; None for none
    target : name of that gel; found_on : the networks' gel, on which contacts are found before they are solved
    object_reflectance : 0 black to 1 white, of what touches the gel"""

    height_map: Callable[[np.ndarray], np.ndarray]
    shade: Callable[..., np.ndarray]
    camera: Camera
    preset: str = "fast"
    solve: Solver | None = None
    dots: MarkerField | None = None
    target: str = TARGET
    found_on: str = TARGET
    object_reflectance: float = 0.0

    def gel(self, arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Return arrays, name -> (T, ...) as in frames.h5, with the displacement of the gel that is drawn."""
        return arrays if self.solve is None else self.solve(arrays)

    def draw(self, height: np.ndarray, displacement: np.ndarray) -> np.ndarray:
        """Return the picture (H, W, 3) uint8 of height (H, W) m, with the dots as displacement (M, 3) m moves them."""
        return self.shade(height) if self.dots is None else self.shade(height, self.dots.marks(displacement))

    def warm_up(self) -> None:
        """Draw the resting gel, which makes what later pictures reuse."""
        still = np.zeros((1, len(sensor_surface(self.target).rest), 3), np.float32)
        self.draw(self.height_map(still)[0], still[0])

    def needed_dots(self) -> MarkerField:
        """Return the gel's dots. Raises TactileError if it has none."""
        if self.dots is None:
            found = "asked of a unit without dots"
            advice = "Give a --calibration with a [markers] table (docs/optics.md)"
            raise TactileError("--keep marker_motion", found, "a gel with dots printed on it", advice)
        return self.dots


def describe_gel(target: str, found_on: str) -> tuple[str, ...]:
    """Return a tuple of a sentence if contacts found_on one gel are solved on another, the target, else ()."""
    if target == found_on:
        return ()
    return (
        f"no networks lead to the {title(target)}: its gel is solved under the contacts found on a {title(found_on)}'s",
    )


def load_drawer(
    calibration: str | os.PathLike | None = None,
    preset: str = "fast",
    variant: str | None = None,
    target: str = TARGET,
    found_on: str = TARGET,
    object_reflectance: float | None = None,
    gel: str = TRANSLATED,
) -> Drawer:
    """Return a gel's camera and lights: those of the unit that ships, or of a calibration file.

    preset : name of the pictures' preset; variant : Mitsuba's, None for the faster; target, found_on : see `Drawer`
    object_reflectance : 0 to 1, of what touches the gel; None for the calibration's; gel : see ``convert.ToolOptions``
    The fast renderer is made when the first picture is drawn: it takes 140 MB, which reading a long recording may need.
    Raises TactileError for a bad calibration, preset or variant, ModuleNotFoundError without Mitsuba if it is
    needed."""
    from ..pictures import background, height_map, renderer
    from ..sensors.calibration_file import load_calibration

    unit = load_calibration(calibration, target, object_reflectance)
    mapper, dots = height_map.gel_mapper(unit.camera), None
    if preset == "fast" and unit.markers is None:
        if unit.photograph:
            background.read_photograph(unit.photograph, unit.camera)  # a bad one is refused before any work
        made = functools.cache(functools.partial(renderer.Renderer, unit, preset))
        shade = lambda height, *marks: made()(height, *marks)  # noqa: E731
    else:
        shade = renderer.Renderer(unit, preset, variant)
        dots = shade.dots
    solve: Solver | None = None
    if gel != TRANSLATED:
        from . import solved_gel

        solved_gel.prepare(target)
        solve = functools.partial(solved_gel.solved, gel=target, found_on=found_on, ball=ball_radius(gel))
    return Drawer(mapper, shade, unit.camera, preset, solve, dots, target, found_on, unit.object_reflectance)


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
