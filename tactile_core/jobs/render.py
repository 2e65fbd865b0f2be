"""The job of ``tactile render``: an input becomes a folder of pictures, as PNG and OpenEXR, with a note.

DIR/images/%05d.png  pictures, numbered as the input's frames are
DIR/exr/%05d.exr     if asked for: linear radiance of the coating in float32, R, G, B the light of each LED
DIR/rest.exr         the same of the undeformed gel
DIR/camera.exr       from radiance to camera levels: response.R.red ... and ambient.R ..., see UNITS
DIR/note.json        input, calibration, preset, versions; same input, same bytes
DIR/timings.json     ms per frame of each stage on this machine; differs from run to run"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import TactileError
from ..files import atomic, provenance
from ..files.exr_file import write_exr
from ..files.png_writer import write_png
from ..files.provenance import Stopwatch
from ..pictures.height_map import gel_mapper, of_unit
from ..pictures.mitsuba.scene_file import camera_planes, claim_scene, write_scene
from ..pictures.mitsuba.variant import fitting
from ..pictures.presets import DEFAULT, FAST, PRESETS, describe_choice, measured
from ..pictures.renderer import Renderer
from ..sensors.calibration_file import calibration_path, load_calibration
from . import results
from .gel_frames import read_frames
from .results import frames_text, select

EXR, EXR_NAME, REST, CAMERA = "exr", "{:05d}.exr", "rest.exr", "camera.exr"
UNITS = (
    "Linear radiance of the coating: R, G, B the light of the red, green and blue LED, in grey levels of that channel "
    "in the picture's middle. Channel R of the picture, 8-bit levels: response.R.red R + response.R.green G + "
    "response.R.blue B + ambient.R of camera.exr, bent by the camera's toe and shoulder; so G and B."
)

MAKER = "tactile render"  # in the note


@dataclasses.dataclass(frozen=True)
class Options:
    """Options of rendering.

    preset : "fast", "standard", "quality" or "reference"; None: the cheapest whose error, rms grey levels, is within
        `levels`, or "standard" without `levels`
    object_reflectance : 0 black to 1 white, of what touches the gel; None for the calibration's
    calibration : file, None for the one that ships; size : (width, height) pixels, None for the calibration's
    frames : slice of the input's; exr : true writes OpenEXR too; variant : Mitsuba's, None for the faster
    noise : true adds the camera's noise to PNG pictures, the same in every run; overwrite : true replaces a result
    scene_out : file to write the first frame to as a Mitsuba scene, or None"""

    preset: str | None = None
    levels: float | None = None
    calibration: str | os.PathLike | None = None
    size: tuple[int, int] | None = None
    frames: slice = dataclasses.field(default_factory=lambda: slice(None))
    exr: bool = False
    variant: str | None = None
    noise: bool = False
    overwrite: bool = False
    scene_out: str | os.PathLike | None = None
    object_reflectance: float | None = None


def render(
    path: str | os.PathLike,
    out: str | os.PathLike,
    options: Options,
    progress: Callable[[str], Any],
    say: Callable[[str], None] = lambda words: None,
) -> Path:
    """Render an input into the folder `out`, which appears whole or not at all; return it.
    progress : function from a word to a context of a callback (done, in all); say : called with sentences
    Raises TactileError for a bad input, calibration or option, and a disk that cannot be written."""
    clock, out = Stopwatch(), Path(out)
    gel = load_calibration(options.calibration).camera.sensor
    preset = claimed(out, options)
    if options.levels is not None:
        say(describe_choice(preset, options.levels))
    with clock.stage("read"):
        frames = read_frames(path, lambda: progress("simulate"), gel)
    shape = None if frames.heights is None else frames.heights.shape[1:]
    rows = select(options.frames, len(frames.numbers))
    with clock.stage("prepare"):
        made = pictures(options, preset, shape, clock)
    note = note_of(path, frames.kind, len(rows), made.renderer, preset, options)  # the input may be gone at the end
    about = background_of(made.renderer)
    if isinstance(about, dict):
        by = about["corrects_lights_by"]
        say(f"at rest: {about['photograph']}, {by['mean_levels']:g} levels from the lights' own picture in the mean")
    new = atomic.new_folder(out, overwrite=options.overwrite)
    with atomic.writing(out), new as folder, progress(preset) as shown:
        made.begin(folder)
        made.write_rest(folder)
        if options.scene_out is not None:
            made.write_scene(options.scene_out, next(iter(frames.iterate_rows(rows))))
        for done, (row, values) in enumerate(zip(rows, frames.iterate_rows(rows), strict=True), 1):
            made.write_frame(folder, int(frames.numbers[row]), values)
            shown(done, len(rows))
        atomic.write_json(folder / results.NOTE, note)
        atomic.write_json(folder / results.TIMINGS, clock.timings(len(rows)))
    return out


def claimed(out: Path, options: Options) -> str:
    """Return the preset to render with, after checking that `out` and ``scene_out`` can be written, and remove what
    killed runs left beside `out`. Raises TactileError for one that exists and may not be replaced, and for a preset
    beside levels."""
    results.check_free(out, options.overwrite, MAKER)
    if options.scene_out is not None:
        claim_scene(options.scene_out, overwrite=options.overwrite)
    results.check_writable(out.parent)
    atomic.sweep(out.parent)
    if options.levels is None:
        return options.preset or DEFAULT
    if options.preset is not None:
        raise TactileError("--error", "given with --preset", "one of the two")
    return fitting(options.levels, options.variant)


@dataclasses.dataclass(frozen=True)
class Pictures:
    """Writer of rendered frames to files. clock : measures stages; about : attributes of EXR files
    heights : true if frames are height maps, false for displacements
    noise : true adds the camera's noise to PNG pictures; exr : true writes OpenEXR too"""

    renderer: Renderer
    clock: Stopwatch
    about: dict[str, str]
    heights: bool
    noise: bool
    exr: bool

    def begin(self, folder: Path) -> None:
        """Make the folders of the pictures and, if asked for, of the EXR files, in ``folder``."""
        (folder / results.IMAGES).mkdir()
        if self.exr:
            (folder / EXR).mkdir()

    def write_rest(self, folder: Path) -> None:
        """Write the undeformed gel, and the camera's response, if OpenEXR is asked for."""
        if self.exr:
            self._write_exr(folder / REST, self.renderer.rest_radiance, self.about)
            # The response to each LED's light, and the part of the resting picture that is not from LEDs.
            ambient = self.renderer.background - self.renderer.in_levels(self.renderer.rest_radiance)
            write_exr(folder / CAMERA, camera_planes(self.renderer.calibration, ambient), self.about)

    def write_frame(self, folder: Path, number: int, values: np.ndarray) -> None:
        """Write frame `number`. values : displacement (M, 3) m of the gel's nodes, or its heights (H, W) m."""
        with self.clock.stage("height_map"):
            height = values if self.heights else gel_mapper(self.renderer.camera)(values)
        with self.clock.stage("radiance"):
            radiance = self.renderer.radiance(height)
        with self.clock.stage("picture"):
            noise = np.random.default_rng(number) if self.noise else None
            picture = self.renderer.picture(radiance, noise, None if self.heights else self.renderer.marks(values))
        with self.clock.stage("png"):
            write_png(folder / results.IMAGES / results.IMAGE_NAME.format(number), picture)
        if self.exr:
            with self.clock.stage("exr"):
                about = {**self.about, "frame": str(number)}
                self._write_exr(folder / EXR / EXR_NAME.format(number), radiance, about)

    def write_scene(self, path: str | os.PathLike, values: np.ndarray) -> None:
        """Write a frame as a Mitsuba scene; values : displacement (M, 3) m, or heights (H, W) m"""
        unit = self.renderer.calibration
        height = values if self.heights else gel_mapper(unit.camera)(values)
        write_scene(path, unit, of_unit(height, unit))

    def _write_exr(self, path: Path, radiance: np.ndarray, about: dict[str, str]) -> None:
        write_exr(path, {name: radiance[..., k] for k, name in enumerate("RGB")}, about)


def pictures(
    options: Options, preset: str, heights: tuple[int, int] | None, clock: Stopwatch | None = None
) -> Pictures:
    """Return the writer of frames. heights : (H, W) of height maps, None for displacements
    Raises TactileError for a bad calibration or size, and ModuleNotFoundError without Mitsuba if it is needed."""
    unit, size = load_calibration(options.calibration, None, options.object_reflectance), options.size
    if heights is not None:
        height, width = heights
        if size not in (None, (width, height)):
            found = f"{size[0]} x {size[1]}, the height map {width} x {height}"
            raise TactileError("--size", found, "the height map's size", "Leave it out")
        size = (width, height)
    unit = unit if size is None else unit.at_size(*size)
    about = {"calibration": unit.unit, "preset": preset, "units": UNITS}
    renderer = Renderer(unit, preset, options.variant)
    return Pictures(renderer, clock or Stopwatch(), about, heights is not None, options.noise, options.exr)


def note_of(
    path: str | os.PathLike, kind: str, count: int, renderer: Renderer, preset: str, options: Options
) -> dict[str, Any]:
    """Return the content of a result's note.json: the input, settings and versions that made it; no time or folder.
    path, kind : the input, and what it is in words; count : number of rendered frames; preset : its name"""
    file = Path(path) / "scene.toml" if os.path.isdir(path) else Path(path)
    unit, calibration = renderer.calibration.unit, Path(options.calibration or calibration_path(renderer.camera.sensor))
    about = PRESETS[preset] if preset != FAST else None
    variant = renderer.variant
    traced = {} if variant is None else provenance.versions("mitsuba", "drjit") | {"mitsuba_variant": variant}
    return {
        "format": results.FORMAT,
        "made_by": MAKER,
        "input": provenance.entry(file) | {"kind": kind},
        "frames": {"selected": frames_text(options.frames), "rendered": count},
        "calibration": provenance.entry(calibration) | {"unit": unit},
        "background": background_of(renderer),
        "object_reflectance": renderer.calibration.object_reflectance,
        "noise": options.noise,
        "size": {"width": renderer.camera.width, "height": renderer.camera.height},
        "preset": {
            "name": preset, "settings": None if about is None else dataclasses.asdict(about),
            "measured": measured()["presets"][preset],
        },
        "versions": provenance.versions("PIL") | traced,
    }  # fmt: skip


def background_of(renderer: Renderer) -> dict[str, Any] | str:
    """Return, for the note, "lights" for a modelled resting picture, else its photograph and how that corrects them."""
    photograph = renderer.calibration.photograph
    if not photograph:
        return "lights"
    return {"photograph": Path(photograph).name, "corrects_lights_by": renderer.correction()}
