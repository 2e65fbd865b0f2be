"""Draw translated gels: solve them if asked, then heights under the camera, pictures, and printed dots."""

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

    height_map : displacement (T, M, 3) m of the gel's M nodes -> heights (T, H, W) m under the camera
    shade : heights (H, W) m, and the share (H, W) of light that dots leave, if any -> picture (H, W, 3) uint8
    preset : name of that of ``shade``; camera : of the gel that is drawn; contacts outside its picture are flagged
    solve : arrays by the names of frames.h5 -> the same with solved gels; None keeps the networks' gels
    dots : on the gel that is drawn; None for no dots
    target : the gel; found_on : the networks' gel, on which contacts are found before they are solved on another
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
        """Return arrays, name -> (T, ...) as in frames.h5, with the gel that is drawn: the networks' or the solved."""
        return arrays if self.solve is None else self.solve(arrays)

    def draw(self, height: np.ndarray, displacement: np.ndarray) -> np.ndarray:
        """Draw the picture (H, W, 3) uint8 of height (H, W) m and of the dots on a gel with displacement (M, 3) m."""
        return self.shade(height) if self.dots is None else self.shade(height, self.dots.marks(displacement))

    def warm_up(self) -> None:
        """Draw the resting gel, which makes what later pictures reuse."""
        still = np.zeros((1, len(sensor_surface(self.target).rest), 3), np.float32)
        self.draw(self.height_map(still)[0], still[0])

    def needed_dots(self) -> MarkerField:
        """Return the unit's dots; raises TactileError where it has none."""
        if self.dots is None:
            found = "asked of a unit without dots"
            advice = "Give a --calibration with a [markers] table (docs/optics.md)"
            raise TactileError("--keep marker_motion", found, "a gel with dots printed on it", advice)
        return self.dots

    def describe_gel(self) -> tuple[str, ...]:
        """Return a sentence where contacts are solved on another gel than the networks', else nothing."""
        return describe_gel(self.target, self.found_on)


def describe_gel(target: str, found_on: str) -> tuple[str, ...]:
    """Return a sentence where contacts found_on one gel are solved on another, the target, else nothing."""
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
    """Load camera and lights of a gel: the unit's that ships, or a file's.

    preset, variant : as ``render.Options``; target, found_on : of `Drawer`; gel : as of ``convert.ToolOptions``
    object_reflectance : of what touches the gel; None for the calibration's
    The fast renderer is made when the first picture is drawn: it takes 140 MB, which reading a long recording may need.
    Raises TactileError for a bad calibration, and as ``renderer.Renderer`` does."""
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
