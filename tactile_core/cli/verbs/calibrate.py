"""``tactile calibrate``: fit a gel unit's camera, lights and colours to photographs of a ball pressed into it."""

from __future__ import annotations

import argparse
import statistics
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

from ...errors import TactileError
from ..terminal import bar, next_step, say, tell
from .common import add

if TYPE_CHECKING:
    from ...pictures.calibrate.evaluate import Evaluation
    from ...pictures.calibrate.fit import Calibrated
    from ...pictures.calibrate.photographs import Photographs
    from ...sensors.calibration import Calibration

BRIEF = "fit camera, lights and colours of a gel to photographs of a ball"
TEXT = """\
Fit a unit's calibration to photographs of a ball pressed into its gel, anywhere and to any depth: positions of camera
and lights, their extent, colours, scale. Without a photograph of the untouched gel, the median of the photographs
takes its place. Ten presses spread over the gel are best; five or even one suffice, since parameters that presses do
not determine stay near those of --start, and are named. The command writes the calibration and a sheet to look at
(.png).

A video (AVI, MP4; extra [camera]) may stand for a folder. The deepest frame of each press is used, and some of the
untouched gel. For balls of several sizes give a folder or video each, and the diameters in that order.

Where LLVM works, the fit ends on Mitsuba's own pictures, with the light of one bounce; --quick leaves that out.

With --test, a calibration is tested on photographs instead. Only place and depth of each press are fitted, and the
picture is compared with the photograph. The baseline is the background alone. What touches the gel shows through its
coating by its reflectance. That is taken from --object-reflectance or the file, but in rows named `through` from the
other photographs."""
EPILOG = """\
examples:
  tactile calibrate presses/ --ball-diameter 6 --out unit.toml
  tactile calibrate presses/ --ball-diameter 6 --background untouched.png --out unit.toml
  tactile calibrate presses/ --ball-diameter 6 --gel gelsight_mini --out unit.toml
  tactile calibrate presses.mp4 --ball-diameter 6 --out unit.toml
  tactile calibrate small/ large/ --ball-diameter 4,6 --out unit.toml
  tactile calibrate --test unit.toml more_presses/ --json trial.json"""
TRIED = ("fast", "standard", "quality")  # presets


def arguments(verb: argparse.ArgumentParser) -> None:
    """Add the arguments of this verb."""
    about = "folder of photographs, or video, of one unit, fingertip up; one for each ball"
    verb.add_argument("presses", metavar="PRESSES", nargs="+", help=about)
    verb.add_argument("--out", metavar="FILE", help="new TOML file to write")
    about = "diameter of the ball, or one for each PRESSES, with commas (with --test: the first; default: as fitted)"
    verb.add_argument("--ball-diameter", type=_millimetres, metavar="MM", help=about)
    verb.add_argument("--background", metavar="FILE", help="photograph of the untouched gel (default: estimated)")
    verb.add_argument("--gel", metavar="SENSOR", help="sensor of the unit (default: that of --start, else digit)")
    verb.add_argument("--start", metavar="FILE", help="calibration to start from (default: the one that ships)")
    verb.add_argument("--unit", metavar="TEXT", help="the unit's name in the file (default: the file's)")
    add(verb, "--object-reflectance", whose="the ball (default: fitted, or with --test the file's)")
    verb.add_argument("--only", metavar="NAMES", help="photographs to use, file names separated by commas")
    verb.add_argument("--quick", action="store_true", help="fit the fast picture alone, in half the time")
    verb.add_argument("--test", metavar="FILE", help="test this calibration instead of fitting one")
    verb.add_argument("--preset", choices=TRIED, help="with --test: preset that draws the pictures (default: fast)")
    verb.add_argument("--json", metavar="FILE", help="with --test: write the errors to this file")
    verb.add_argument("--sheet", metavar="FILE", help="with --test: write photographs, renders, differences as PNG")
    add(verb, "--progress")


def run(options: argparse.Namespace) -> int:
    """Fit a calibration and write it, or evaluate one on photographs; returns the exit status."""
    from ...files import atomic
    from ...pictures.calibrate.ball_pictures import pictures_of
    from ...pictures.calibrate.checked_fit import fit_unit
    from ...pictures.calibrate.evaluate import evaluate_unit
    from ...pictures.calibrate.fit import check_diameter
    from ...pictures.calibrate.photographs import read_photographs
    from ...sensors.calibration_file import load_calibration

    _check_options(options)
    written = [options.json, options.sheet] if options.test else [options.out, _sheet_beside(options.out)]
    diameters = [1e-3 * mm for mm in options.ball_diameter or ()]
    radii = [each / 2 for each in diameters] if len(diameters) > 1 else None
    only = None if options.only is None else [name.strip() for name in options.only.split(",")]
    work, unit_of_work = ("test", "press") if options.test else ("calibrate", "%")
    with bar(work, unit_of_work, options.progress) as progress:
        for diameter in diameters:
            check_diameter(diameter)
        reflectance = options.object_reflectance
        unit = load_calibration(options.test or options.start, options.gel, reflectance)
        for path in filter(None, written):
            atomic.claim(path)
        photographs = read_photographs(options.presses, options.background, radii, only)
        if options.test:
            radius = (diameters[0] if diameters else unit.fit.ball_diameter) / 2
            pictures = pictures_of(options.preset or TRIED[0])
            tried = evaluate_unit(unit, photographs, radius, pictures=pictures, progress=progress)
        else:
            name = options.unit or Path(options.out).stem
            quick = options.quick
            done, apart = fit_unit(
                photographs, diameters[0], unit, unit=name, quick=quick, reflectance=reflectance, progress=progress
            )
    return _tell_test(options, tried, photographs, unit) if options.test else _write_fit(options.out, done, apart)


def _check_options(options: argparse.Namespace) -> None:
    if len(options.ball_diameter or (0,)) not in (1, len(options.presses)):
        found = f"{len(options.ball_diameter)} diameters, and {len(options.presses)} folders or videos"
        raise TactileError("--ball-diameter", found, "one, or one for each")
    for name in ("out", "gel", "start", "unit") if options.test else ("json", "sheet", "preset"):
        if getattr(options, name) is not None:
            if options.test:
                raise TactileError(f"--{name}", "given with --test", "one or the other")
            raise TactileError(f"--{name}", "given without --test", "a trial", "Name a calibration: --test FILE")
    if options.test:
        if options.json is not None and options.json == options.sheet:
            raise TactileError("--json and --sheet", options.json, "two files")
        return
    if options.out is None or options.ball_diameter is None:
        missing = "--out" if options.out is None else "--ball-diameter"
        raise TactileError(missing, "missing", "a file to write and the ball's diameter in mm", "Or try one: --test")
    if options.object_reflectance == 0:
        raise TactileError("--object-reflectance", "0: black", "more: light that comes back tells of the coating")
    if _sheet_beside(options.out) == Path(options.out):
        raise TactileError("--out", options.out, "a file to write that ends in .toml: the sheet is the .png beside it")


def _millimetres(text: str) -> list[float]:
    return [float(word) for word in text.split(",")]


def _sheet_beside(out: str) -> Path:
    return Path(out).with_suffix(".png")


def _write_fit(out: str, done: Calibrated, apart: list[Evaluation]) -> int:
    """Print what a fit found, and write it unless it explains nothing (TactileError). apart : held-out presses'
    evaluations"""
    from ...accuracy import HEADER, line
    from ...files import atomic
    from ...pictures.calibrate.checked_fit import check_worth
    from ...pictures.calibrate.evaluate import rows_of, sheet
    from ...sensors.calibration_file import write_calibration

    for warning in done.warnings:
        say(f"warning: {warning}")
    for each in done.tried:
        right, down, depth = (1e3 * value for value in each.ball[:3])
        place = f"{_way(right, 'left', 'right')} and {_way(down, 'above', 'below')} of the picture's middle"
        say(f"{each.press.name}: used; {depth:.2f} mm deep, {place}; {_error([each])}")
    check_worth(apart or done.tried)
    unknown = ", ".join(done.calibration.fit.not_identified)
    say(f"these photographs tell too little of: {unknown}; they stay near the values of --start")
    say(_object(done.calibration, done.calibration.through))
    drawn = sheet(done.tried)
    rows = rows_of(done.tried, "presses it was fitted on")[0] + rows_of(apart, "held-out presses, by thirds")[0]
    write_calibration(out, done.calibration)
    atomic.write_bytes(_sheet_beside(out), drawn)
    tell("\n".join([HEADER, *map(line, rows)]))
    say(f"{'held-out presses' if apart else 'the press'}: {_error(apart or done.tried)}")
    tell(out)
    following = f"tactile convert touch.csv --out results --calibration {quote(out)}"
    next_step(f"look at {_sheet_beside(out)}: photograph, picture, difference; then {following}")
    return 0


def _object(unit: Calibration, through: float) -> str:
    """Describe the object's reflectance; through : its light through the coating, as a share of the coating's own"""
    seen = unit.with_through(through)
    return (
        f"the object's reflectance: {seen.object_reflectance:.2f} (0 black, 1 white; light through the coating,"
        f" {100 * through:.0f} % of its own, by a transmission of {seen.coating.transmission:.2f})"
    )


def _tell_test(
    options: argparse.Namespace, tried: list[Evaluation], photographs: Photographs, unit: Calibration
) -> int:
    """Print a tested calibration's errors, and write the files that the options ask for; returns the exit status."""
    from ...accuracy import HEADER, line
    from ...files import atomic
    from ...pictures.calibrate.evaluate import rows_of, sheet

    for each in tried:
        for flag in each.flags:
            say(f"warning: {each.press.name}: {flag}")
    drawn = sheet(tried) if options.sheet else b""
    rows, by_press = rows_of(tried, photographs.folder.name)
    if options.json:
        atomic.write_json(options.json, rows + by_press)
    if options.sheet:
        atomic.write_bytes(options.sheet, drawn)
    tell("\n".join([HEADER, *map(line, rows)]))
    say(f"{photographs.folder}: {_error(tried)}")
    say(_object(unit, statistics.median(each.through for each in tried)))
    for file, held in ((options.json, "the errors of each press"), (options.sheet, "photograph, picture, difference")):
        if file is not None:
            next_step(f"{file} holds {held}")
    return 0


def _error(tried: list[Evaluation]) -> str:
    """Describe in words the mean error of the pictures tried in the region of the press, and the background's."""
    from ...pictures.calibrate.evaluate import mean_metrics

    ours, baseline = (each["roi_l1"] for each in mean_metrics(tried))
    return f"{ours:.1f} grey levels of 255 off, the background alone {baseline:.1f}"


def _way(mm: float, less: str, more: str) -> str:
    """Return a coordinate, mm, in words: "1.2 mm left"; less, more : words for below and above 0"""
    return f"{abs(mm):.1f} mm {less if mm < 0 else more}"
