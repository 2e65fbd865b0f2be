"""``tactile calibrate``: a gel unit's camera, lights and colours, from photographs of a ball pressed into it."""

from __future__ import annotations

import argparse
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

from ...errors import TactileError
from ..terminal import bar, next_step, say, tell
from .common import NOTHING, progress_argument

if TYPE_CHECKING:
    from collections.abc import Callable

    from ...pictures.calibrate.ball_pictures import BallPictures
    from ...pictures.calibrate.evaluate import Evaluation
    from ...pictures.calibrate.photographs import Photographs
    from ...sensors.calibration import Calibration

BRIEF = "fit camera, lights and colours of a gel to photographs of a ball"
TEXT = """\
Fit a unit's calibration to photographs of a ball pressed into its gel, anywhere and to any depth: positions of camera
and lights, their extent, colours, scale. Without a photograph of the untouched gel, its median over the photographs
takes its place. Ten presses spread over the gel are best; five or even one suffice, since parameters that presses do
not determine stay near those of --start, and are named. Writes the calibration, and a sheet to look at (.png).

A video (AVI, MP4; extra [camera]) stands for a folder: its deepest frame of each press is taken, and some of the
untouched gel. Balls of several sizes: a folder or video for each, and their diameters in that order.

The fit ends on Mitsuba's own pictures, with the light of one bounce, where LLVM works; --quick leaves that out.

With --test, a calibration is tested on photographs instead: only place and depth of each press are fitted, and the
picture is compared with the photograph. The baseline is the background alone. Rows named `through` also fit the light
that comes through the coating where the ball touches it; the others leave it out."""
EPILOG = """\
examples:
  tactile calibrate presses/ --ball-diameter 6 --out unit.toml
  tactile calibrate presses/ --ball-diameter 6 --background untouched.png --out unit.toml
  tactile calibrate presses/ --ball-diameter 6 --gel gelsight_mini --out unit.toml
  tactile calibrate presses.mp4 --ball-diameter 6 --out unit.toml
  tactile calibrate small/ large/ --ball-diameter 4,6 --out unit.toml
  tactile calibrate --test unit.toml more_presses/ --json trial.json"""
LEAVES = NOTHING
TRIED = ("fast", "standard", "quality")  # presets


def arguments(verb: argparse.ArgumentParser) -> None:
    """Add the arguments of this verb."""
    about = "folder of photographs, or video, of one unit, fingertip up; for each ball one"
    verb.add_argument("presses", metavar="PRESSES", nargs="+", help=about)
    verb.add_argument("--out", metavar="FILE", help="new TOML file to write")
    about = "diameter of the ball, or for each PRESSES one, separated by commas (with --test: as fitted, the first)"
    verb.add_argument("--ball-diameter", type=_millimetres, metavar="MM", help=about)
    verb.add_argument("--background", metavar="FILE", help="photograph of the untouched gel (default: estimated)")
    verb.add_argument("--gel", metavar="SENSOR", help="sensor of the unit (default: that of --start, else digit)")
    verb.add_argument("--start", metavar="FILE", help="calibration to start from (default: the one that ships)")
    verb.add_argument("--unit", metavar="TEXT", help="the unit's name in the file (default: the file's)")
    verb.add_argument("--only", metavar="NAMES", help="photographs to use, file names separated by commas")
    verb.add_argument("--quick", action="store_true", help="fit the fast picture alone, in half the time")
    verb.add_argument("--test", metavar="FILE", help="test this calibration instead of fitting one")
    verb.add_argument("--preset", choices=TRIED, help="with --test: preset that draws the pictures (default: fast)")
    verb.add_argument("--json", metavar="FILE", help="with --test: write the errors to this file")
    verb.add_argument("--sheet", metavar="FILE", help="with --test: write photographs, renders, differences as PNG")
    progress_argument(verb)


def run(options: argparse.Namespace) -> int:
    """Fit a calibration and write it, or evaluate one on photographs; returns the exit status."""
    from ...pictures.calibrate.photographs import chosen, read_photographs

    _check_options(options)
    radii = None
    if options.ball_diameter is not None and len(options.ball_diameter) > 1:
        radii = [0.5e-3 * diameter for diameter in options.ball_diameter]
    photographs = read_photographs(options.presses, options.background, radii)
    if options.only is not None:
        photographs = chosen(photographs, [name.strip() for name in options.only.split(",")])
    return _test(options, photographs) if options.test else _fit(options, photographs)


def _check_options(options: argparse.Namespace) -> None:
    from ...files import atomic
    from ...pictures.calibrate.fit import check_diameter

    for diameter in options.ball_diameter or ():
        check_diameter(1e-3 * diameter)
    if len(options.ball_diameter or (0,)) not in (1, len(options.presses)):
        found = f"{len(options.ball_diameter)} diameters, and {len(options.presses)} folders or videos"
        raise TactileError("--ball-diameter", found, "one, or one for each")
    if options.test:
        for name in ("out", "gel", "start", "unit"):
            if getattr(options, name) is not None:
                raise TactileError(f"--{name}", "given with --test", "one or the other")
        for path in (options.json, options.sheet):
            if path is not None:
                atomic.claim(path)
        if options.json is not None and options.json == options.sheet:
            raise TactileError("--json and --sheet", options.json, "two files")
        return
    for name in ("json", "sheet", "preset"):
        if getattr(options, name) is not None:
            raise TactileError(f"--{name}", "given without --test", "a trial", "Name a calibration: --test FILE")
    if options.out is None or options.ball_diameter is None:
        missing = "--out" if options.out is None else "--ball-diameter"
        raise TactileError(missing, "missing", "a file to write and the ball's diameter in mm", "Or try one: --test")
    if _sheet_beside(options.out) == Path(options.out):
        raise TactileError("--out", options.out, "a file to write that ends in .toml: the sheet is the .png beside it")
    atomic.claim(options.out)
    atomic.claim(_sheet_beside(options.out))


def _millimetres(text: str) -> list[float]:
    return [float(word) for word in text.split(",")]


def _sheet_beside(out: str) -> Path:
    return Path(out).with_suffix(".png")


def _fit(options: argparse.Namespace, photographs: Photographs) -> int:
    from ...pictures.calibrate.evaluate import rows_of, write_sheet
    from ...pictures.calibrate.fit import calibrate
    from ...pictures.calibrate.held_out import check_worth, cross_validated
    from ...pictures.calibrate.orientation import check_orientation
    from ...sensors.calibration_file import load_calibration, write_calibration

    start, diameter = load_calibration(options.start, options.gel), 1e-3 * options.ball_diameter[0]
    with bar("the way the photographs lie", "way", options.progress) as progress:
        check_orientation(photographs, diameter, start, progress)
    with bar("trial on held-out presses", "step", options.progress) as progress:
        apart = cross_validated(photographs, diameter, start, quick=options.quick, progress=progress)
    with bar("calibrate", "step", options.progress) as progress:
        name = options.unit or Path(options.out).stem
        done = calibrate(photographs, diameter, start, unit=name, quick=options.quick, progress=progress)
    for warning in done.warnings:
        say(f"warning: {warning}")
    for each in done.tried:
        right, down, depth = (1e3 * value for value in each.ball.numbers[:3])
        place = f"{_way(right, 'left', 'right')} and {_way(down, 'above', 'below')} of the picture's middle"
        say(f"{each.press.name}: used; {depth:.2f} mm deep, {place}; {_error([each])}")
    check_worth(apart or done.tried)
    unknown = ", ".join(done.calibration.fit.not_identified)
    say(f"these photographs tell too little of: {unknown}; they stay near the values of --start")
    write_calibration(options.out, done.calibration)
    write_sheet(_sheet_beside(options.out), done.tried)
    _tell_rows(rows_of(done.tried, "presses it was fitted on") + rows_of(apart, "held-out presses, by thirds"))
    say(f"{'held-out presses' if apart else 'the press'}: {_error(apart or done.tried)}")
    tell(options.out)
    following = f"tactile convert touch.csv --out results --calibration {quote(options.out)}"
    next_step(f"look at {_sheet_beside(options.out)}: photograph, picture, difference; then {following}")
    return 0


def _test(options: argparse.Namespace, photographs: Photographs) -> int:
    from ...files import atomic
    from ...pictures.calibrate.evaluate import evaluate_unit, rows_by_press, rows_of, write_sheet
    from ...sensors.calibration_file import load_calibration

    calibration = load_calibration(options.test)
    diameter = calibration.fit.ball_diameter if options.ball_diameter is None else 1e-3 * options.ball_diameter[0]
    with bar("test", "press", options.progress) as progress:
        pictures = _pictures(options.preset or TRIED[0])
        tried = evaluate_unit(calibration, photographs, diameter / 2, pictures=pictures, progress=progress)
    for each in tried:
        for flag in each.flags:
            say(f"warning: {each.press.name}: {flag}")
    rows = rows_of(tried, photographs.folder.name)
    if options.json:
        atomic.write_json(options.json, rows + rows_by_press(tried))
    if options.sheet:
        write_sheet(options.sheet, tried)
    _tell_rows(rows)
    say(f"{photographs.folder}: {_error(tried)}")
    for file, held in ((options.json, "the errors of each press"), (options.sheet, "photograph, picture, difference")):
        if file is not None:
            next_step(f"{file} holds {held}")
    return 0


def _error(tried: list[Evaluation]) -> str:
    """Say how far the pictures are from the photographs in the region of the press, and the background alone."""
    from ...pictures.calibrate.evaluate import mean_metrics

    ours, baseline = (each["roi_l1"] for each in mean_metrics(tried))
    return f"{ours:.1f} grey levels of 255 off, the background alone {baseline:.1f}"


def _way(mm: float, less: str, more: str) -> str:
    """Say where a press lies along a direction: 1.2 mm left."""
    return f"{abs(mm):.1f} mm {less if mm < 0 else more}"


def _pictures(preset: str) -> Callable[[Calibration], BallPictures]:
    """Return the function that draws balls' pictures by a preset; raises TactileError where LLVM is missing."""
    from ...pictures.calibrate.ball_pictures import FastPictures
    from ...pictures.calibrate.fit import finishing_trouble
    from ...pictures.calibrate.mitsuba_pictures import MitsubaPictures
    from ...pictures.presets import PRESETS

    if preset == TRIED[0]:
        return FastPictures
    if trouble := finishing_trouble():
        raise TactileError("--preset", f"{preset!r}, but {trouble}", "LLVM 18 or newer", "See `tactile doctor`")
    return MitsubaPictures(PRESETS[preset])


def _tell_rows(rows: list[dict]) -> None:
    from ...accuracy import HEADER, line

    tell("\n".join([HEADER, *map(line, rows)]))
