"""``tactile render``: draw pictures by a preset, from fast to physically based."""

from __future__ import annotations

import argparse
import re
from typing import TYPE_CHECKING

from ...errors import TactileError
from ...files.threads import one_thread
from ..terminal import bar, next_step, say, tell
from . import engine
from .common import PRESETS, add

if TYPE_CHECKING:
    from pathlib import Path

    from ...jobs.render import Options

BRIEF = "draw the camera's pictures of deformed gels"
TEXT = """\
Draw what the camera of a DIGIT, or of another --gel, sees of its deformed gel. INPUT is one of
  frames.h5          of `tactile convert`, with displacement kept
  recording.h5       simulated, with its true gel
  heights.npz, .exr  heights in metres under the camera's pixels: array height_map, (H, W) or (T, H, W); channel height
  a scene's folder   (or its scene.toml) with a [recording], which is simulated first

DIR is a new folder, which appears whole or not at all:
  images/%05d.png  8-bit pictures: response x radiance + ambient light
  exr/%05d.exr     with --exr, float32: linear radiance of the coating, R, G, B = light of the red, green, blue LED
  rest.exr         the same of the undeformed gel;  camera.exr  response and ambient light
  FILE.xml         with --scene-out: the first frame's LEDs, coating and gel for `mitsuba FILE.xml`, FILE.ply beside it;
                   the coating spreads no light there: the first comment names the Gaussian filter to apply
  note.json        input, calibration, preset, versions;  timings.json  ms a frame

Presets, from fast to exact: fast needs numpy alone; the others need Mitsuba (`tactile doctor` says how).
  fast       direct light, soft shadows            standard   direct light, traced, and a coarse bounce
  quality    more points of light, a finer bounce  reference  Mitsuba's path integrator, half a minute a frame
With LLVM, Mitsuba renders a scene of LEDs as lamps, the coating as a material, and the window. Without LLVM the coating
is matte, and standard and quality have no window; pictures differ by a tenth of a level. `tactile doctor` says whether
LLVM is found.

--error 0.6levels picks the cheapest preset whose measured error (rms from the full model of the same gel) is at most
0.6 levels, and says why. How exact a scene's contacts are is chosen by `tactile simulate --error 50um`.

With --workers, --cluster or --plan other processes render the frames, to the same bytes. Frames wait in OUT.parts until
all are there, and the same command continues after any interruption. No timings.json is written."""
EPILOG = """\
examples:
  tactile render results/touch/frames.h5 --out pictures --frames 100:200
  tactile render scenes/press_roll_slide --out pictures --preset quality --exr
  tactile render heights.npz --out pictures --error 0.5levels --calibration unit.toml
  tactile render scenes/press --out pictures --error 0.6levels
  tactile render scenes/press --out pictures --gel gelsight_mini"""
SIMULATE_FIRST = "Simulate the scene first, with --error, and render that"


def arguments(verb: argparse.ArgumentParser) -> None:
    """Add the arguments of this verb."""
    verb.add_argument("input", metavar="INPUT", help="frames, heights or a scene, see above")
    verb.add_argument("--out", required=True, metavar="DIR", help="new folder of the pictures")
    verb.add_argument("--preset", choices=PRESETS, help="method, see above (default: standard)")
    add(verb, "--error", bound="levels of the picture, such as 0.6levels; picks the preset")
    add(verb, "--calibration", "--object-reflectance", whose="what touches the gel (default: the calibration's)")
    verb.add_argument("--gel", metavar="SENSOR", help="sensor of the gel (default: the calibration's, else digit)")
    verb.add_argument("--frames", default=":", metavar="A:B:STEP", help="frames to draw, as a Python slice")
    verb.add_argument("--size", metavar="WxH", help="size in pixels, such as 480x640 (default: the calibration's)")
    verb.add_argument("--exr", action="store_true", help="write OpenEXR beside PNG")
    verb.add_argument("--scene-out", metavar="FILE.xml", help="write the first frame as a scene of Mitsuba's, too")
    verb.add_argument("--noise", action="store_true", help="add the unit's camera noise to PNG pictures")
    about = "Mitsuba's variant (default: the faster that works)"
    verb.add_argument("--variant", choices=("llvm", "scalar"), help=about)
    verb.add_argument("--overwrite", action="store_true", help="replace an older result")
    engine.parts_arguments(verb, "write the job into OUT.parts and stop; no cost is printed")
    add(verb, "--progress")


def run(options: argparse.Namespace) -> int:
    """Render the pictures; returns the exit status."""
    one_thread()  # before numpy is imported
    engine.check_place(options, "workers")
    size = _size(options.size)
    if options.variant is not None and options.preset == "fast":
        raise TactileError("--variant", "given with --preset fast", "a preset of Mitsuba's", "Leave it out")
    from ...jobs import render, results
    from ...jobs.error_budget import parse_budget
    from ...pictures.mitsuba import variant

    wanted = {None: None, "llvm": variant.LLVM, "scalar": variant.SCALAR}[options.variant]
    asked = render.Options(
        preset=options.preset,
        levels=None if options.error is None else parse_budget(options.error).only("levels", SIMULATE_FIRST),
        calibration=_calibration(options.calibration, options.gel),
        object_reflectance=options.object_reflectance,
        size=size,
        frames=results.parse_frames(options.frames),
        exr=options.exr,
        variant=wanted,
        noise=options.noise,
        overwrite=options.overwrite,
        scene_out=options.scene_out,
    )
    if options.plan or options.workers or options.cluster:
        if options.scene_out is not None:
            raise TactileError("--scene-out", "given with other processes", "one of the two", "Leave --workers out")
        return _run_in_parts(options, asked)
    done = render.render(options.input, options.out, asked, lambda word: bar(word, "frame", options.progress), say)
    return _done(done)


def _run_in_parts(options: argparse.Namespace, asked: Options) -> int:
    """Render in other processes, or only write the plan for that; returns the exit status."""
    from ...jobs.render_shards import plan, render_in_parts

    if options.plan:
        return engine.plan_parts(options.out, plan(options.input, options.out, asked))
    with bar("render", "task", options.progress) as shown:
        done = render_in_parts(options.input, options.out, asked, lambda folder: engine.place(folder, options), shown)
    return _done(done)


def _done(folder: Path) -> int:
    """Print the folder and its first picture; returns the exit status."""
    from ...jobs.results import IMAGES

    tell(str(folder))
    next_step(f"open {min((folder / IMAGES).iterdir())}")
    return 0


def _calibration(file: str | None, gel: str | None) -> str | None:
    """Return the given calibration's path, checked for a named gel; without one that gel's shipped one, or None."""
    if gel is None:
        return file
    from ...sensors.calibration_file import calibration_path, load_calibration

    load_calibration(file, gel)
    return file or str(calibration_path(gel))


def _size(text: str | None) -> tuple[int, int] | None:
    if text is None:
        return None
    found = re.fullmatch(r"(\d{1,5})x(\d{1,5})", text)
    if not found:
        raise TactileError("--size", repr(text), "WIDTHxHEIGHT in pixels, such as 480x640")
    return int(found[1]), int(found[2])
