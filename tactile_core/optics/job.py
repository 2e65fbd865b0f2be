"""The job of ``tactile render``: an input becomes a folder of pictures, as PNG and OpenEXR, with a note.

DIR/images/%05d.png  pictures, numbered as the input's frames are
DIR/exr/%05d.exr     radiance in float32, where asked for: R, G, B as the camera's channels count it (grey levels,
                     C times L), basis.red, basis.green, basis.blue as each LED gives it (L, the calibration's unit)
DIR/rest.exr         the same of the undeformed gel: a picture is background + RGB - RGB at rest
DIR/note.json        input, calibration, preset, versions; same input, same bytes
DIR/timings.json     ms a frame of each stage on this machine; differs from run to run
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from .. import atomic, results
from ..calibration import Calibration
from ..calibration_file import SHIPPED, load_calibration
from ..camera import COLOURS
from ..convert import frames_text, select
from ..errors import TactileError
from ..height_map import digit_mapper
from ..png_file import write_png
from ..stopwatch import Stopwatch
from .inputs import Frames, read_frames
from .presets import DEFAULT, FAST, PRESETS, cheapest, measured
from .renderer import Renderer
from .variant import SCALAR, choose_variant

EXR, EXR_NAME, REST = "exr", "{:05d}.exr", "rest.exr"
UNITS = (
    "R G B: grey levels of 8 bits, C times L, without background. basis.*: L, in units of what the LED gives to a "
    "coating that faces it, as far from it as the picture's centre at height zero."
)

Progress = Callable[[int, int], None]


@dataclasses.dataclass(frozen=True)
class Options:
    """How to render.

    preset : its name, None to choose by error; error : grey levels rms that will do, None for the default preset
    calibration : file, None for the one that ships; size : (width, height) pixels, None for the calibration's
    frames : part of the input; exr : whether to write OpenEXR too; variant : None for the faster one
    noise : whether PNG pictures have the camera's noise, the same in every run
    """

    preset: str | None = None
    error: float | None = None
    calibration: str | os.PathLike | None = None
    size: tuple[int, int] | None = None
    frames: slice = dataclasses.field(default_factory=lambda: slice(None))
    exr: bool = False
    variant: str | None = None
    noise: bool = False
    overwrite: bool = False


def render(path: str | os.PathLike, out: str | os.PathLike, options: Options, progress: Callable[[str], Any]) -> Path:
    """Render an input into the folder `out`, which appears whole or not at all; returns it.

    progress : given a word, a context that yields a callback (done, in all)
    Raises TactileError for a bad input, calibration or option, and a disk that cannot be written.
    """
    clock = Stopwatch()
    out = Path(out)
    results.check_free(out, options.overwrite)
    results.check_writable(out.parent)
    atomic.sweep(out.parent)
    calibration = load_calibration(options.calibration)
    preset = choose_preset(options)
    with clock.stage("read"):
        frames = read_frames(path, lambda: progress("simulate"))
    calibration = _at_size(calibration, frames, options.size)
    rows = select(options.frames, len(frames.numbers))
    with clock.stage("prepare"):
        renderer = Renderer(calibration, preset, options.variant)
    try:
        with atomic.new_folder(out, overwrite=options.overwrite) as folder, progress(preset) as shown:
            about = {"calibration": calibration.unit, "preset": preset, "units": UNITS}
            _Work(frames, rows, renderer, clock, about, options.noise).write(folder, options.exr, shown)
            atomic.write_json(folder / results.NOTE, _note(path, frames, rows, renderer, preset, options))
            timings = {"ms_a_frame": clock.per_frame(len(rows)), "frames": len(rows), "machine": results.machine()}
            atomic.write_json(folder / results.TIMINGS, timings)
    except OSError as error:
        found, advice = f"cannot be written ({error.strerror or error})", "Make room, or name another --out folder"
        raise TactileError(out, found, "a writable folder", advice) from error
    return out


def choose_preset(options: Options) -> str:
    """The preset asked for, the cheapest that is exact enough, or the default.

    Raises TactileError for both, or an error that no preset has.
    """
    if options.preset is not None and options.error is not None:
        raise TactileError("--error", "given with --preset", "one of the two")
    if options.error is None:
        return options.preset or DEFAULT
    try:
        variant = choose_variant(options.variant).name
    except ModuleNotFoundError:
        variant = SCALAR
    return cheapest(options.error, variant)


def _at_size(calibration: Calibration, frames: Frames, size: tuple[int, int] | None) -> Calibration:
    """The calibration in pixels of the height maps, or of the size asked for."""
    if frames.heights is not None:
        height, width = frames.heights.shape[1:]
        if size not in (None, (width, height)):
            found = f"{size[0]} x {size[1]}, the height map {width} x {height}"
            raise TactileError("--size", found, "the height map's size", "Leave it out")
        size = (width, height)
    return calibration if size is None else calibration.at_size(*size)


@dataclasses.dataclass(frozen=True)
class _Work:
    """One input being rendered.

    rows : (n,) of the frames that are wanted; about : attributes of EXR files; noise : whether pictures have some
    """

    frames: Frames
    rows: np.ndarray
    renderer: Renderer
    clock: Stopwatch
    about: dict[str, str]
    noise: bool

    def write(self, folder: Path, exr: bool, progress: Progress) -> None:
        """Pictures, one frame at a time."""
        (folder / results.IMAGES).mkdir()
        if exr:
            (folder / EXR).mkdir()
            self._write_exr(folder / REST, self.renderer.rest_radiance, self.about)
        numbers = self.frames.numbers[self.rows]
        for done, values in enumerate(self.frames.some(self.rows), 1):
            self._write_frame(folder, int(numbers[done - 1]), values, exr)
            progress(done, len(self.rows))

    def _write_frame(self, folder: Path, number: int, values: np.ndarray, exr: bool) -> None:
        """values : displacement (M, 3) m or heights (H, W) m."""
        with self.clock.stage("height_map"):
            height = values if self.frames.heights is not None else digit_mapper(self.renderer.camera)(values)
        with self.clock.stage("radiance"):
            radiance = self.renderer.radiance(height)
        with self.clock.stage("picture"):
            noise = np.random.default_rng(number) if self.noise else None
            picture = self.renderer.picture(radiance, noise)
        with self.clock.stage("png"):
            write_png(folder / results.IMAGES / results.IMAGE_NAME.format(number), picture)
        if exr:
            with self.clock.stage("exr"):
                about = {**self.about, "frame": str(number)}
                self._write_exr(folder / EXR / EXR_NAME.format(number), radiance, about)

    def _write_exr(self, path: Path, radiance: np.ndarray, about: dict[str, str]) -> None:
        from .exr import write_exr

        levels = self.renderer.in_levels(radiance)
        channels = {name: levels[..., k] for k, name in enumerate("RGB")}
        channels |= {f"basis.{colour}": radiance[..., k] for k, colour in enumerate(COLOURS)}
        write_exr(path, channels, about)


def _note(
    path: str | os.PathLike, frames: Frames, rows: np.ndarray, renderer: Renderer, preset: str, options: Options
) -> dict[str, Any]:
    """Where a result came from, fit for JSON: only what the same input makes again."""
    path = Path(path)
    file = path / "scene.toml" if path.is_dir() else path
    unit, calibration = renderer.calibration.unit, Path(options.calibration or SHIPPED)
    about = PRESETS[preset] if preset != FAST else None
    return {
        "format": results.FORMAT,
        "made_by": "tactile render",
        "input": {"file": file.name, "sha256": results.sha256(file), "kind": frames.kind},
        "frames": {"selected": frames_text(options.frames), "rendered": len(rows)},
        "calibration": {"file": calibration.name, "sha256": results.sha256(calibration), "unit": unit},
        "noise": options.noise,
        "size": {"width": renderer.camera.width, "height": renderer.camera.height},
        "preset": {
            "name": preset, "settings": None if about is None else dataclasses.asdict(about),
            "measured": measured()["presets"][preset],
        },
        "versions": results.versions("PIL") | _mitsuba_versions(renderer.variant),
    }  # fmt: skip


def _mitsuba_versions(variant: str | None) -> dict[str, str]:
    if variant is None:
        return {}
    import drjit
    import mitsuba

    return {"mitsuba": mitsuba.__version__, "drjit": drjit.__version__, "mitsuba_variant": variant}
