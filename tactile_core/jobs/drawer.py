"""Draw translated gels: solve their contacts if asked, then map heights under the camera, pictures and printed dots."""

from __future__ import annotations

import dataclasses
import functools
import os
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ..errors import TactileError
from ..sensors import TARGET, sensor_surface, title
from ..sensors.camera import Camera
from .results import TRANSLATED, ball_radius

if TYPE_CHECKING:
    from ..pictures.marker_field import MarkerField

Solver = Callable[[dict[str, np.ndarray]], dict[str, np.ndarray]]


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
