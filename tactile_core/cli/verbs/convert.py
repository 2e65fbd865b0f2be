"""``tactile convert``: translate recordings to deformations, forces and DIGIT pictures."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from ...errors import TactileError
from ...files.threads import one_thread
from ..terminal import bar, complain, next_step, say, tell
from .common import ANSWER, OPTIONS, PREPARE, UNIT, add, parse_answer, prepare_words

if TYPE_CHECKING:
    from ...jobs.convert import Options, ToolOptions

KEEP = "latent,displacement,image"  # unless told otherwise
REVERSIBLE = "--frames", "--weights", "--to", "--overwrite"  # what --reverse takes
BRIEF = "translate recordings to deformations, forces and DIGIT pictures"
TEXT = """\
Translate recordings and draw them. Each gets the folder DIR/<file name without extension> with
  frames.h5          numbers of every frame: time, electrodes, force, contact_center, confidence, flags; and those
                     that --keep names
  images/%05d.png    DIGIT pictures, 240 x 320, numbered by the frame's index in the recording (from 0)
  contact_sheet.png  a few frames to look at
  note.json          versions, weights, options, warnings
  timings.json       ms a frame of each stage
Each data row gives one frame, in file order; bad rows are repaired and flagged. A folder appears whole or not at all.
A file of several fingers gives a result for each, <name>_finger0, <name>_finger1, ...; hand.bag#1 picks one. A bag of
several topics gives one for each topic and finger, <name>_<topic>_finger0; hands.bag#left/biotac/finger0 picks one.

--error 0.6levels picks the cheapest preset of `tactile render` (default: fast) whose measured error, for pictures of
the same gel, is at most 0.6 grey levels rms. The networks' own error is in frames.h5 and on the sheet."""
# 4 B per number of 3,650 + 2,867 nodes; pictures measured at 28 kB (mean of the simulated recording) to 50 kB (of a
# noisy real one), packed height maps at 200 kB.
SIZES = "displacement 50 MB, latent 0.3 MB, image 20 to 35 MB, height about 140 MB (the default: 70 to 85 MB)"
EPILOG = f"""\
examples:
  tactile convert touch.csv --out results
  tactile convert day1/*.csv --out results --keep latent --overwrite
  tactile convert touch.csv --out results --frames 200:300:5 --tare 0:50
  tactile convert results/touch/frames.h5 --reverse --out skin.h5
  tactile convert touch.csv --out results --plan       what it would build and cost; nothing is run

Words of --keep, beside what frames.h5 always holds:
  latent         the networks' codes of the signals and of both surfaces
  displacement   of the BioTac's skin and of the gel, m at each node of their surfaces
  height         the gel's height under each pixel of the camera, m
  image          the camera's pictures, as PNG files
  traction       force field on the gel, Pa at each node of its surface, by the gel's own compliance (unpacked once,
                 some seconds, 151 MB); it adds up to the networks' force
  marker_motion  motion, px, of dots printed on the gel, for a --calibration with [markers]

Size of a 700-frame result, measured: {SIZES}."""


def arguments(verb: argparse.ArgumentParser) -> None:
    """Add the arguments of this verb."""
    about = "CSV, HDF5, NPZ, MAT, JSON or bag files, in any known layout"
    verb.add_argument("recordings", nargs="+", metavar="RECORDING", help=about)
    verb.add_argument("--out", required=True, metavar="DIR", help="folder for the results; may hold other results")
    verb.add_argument(
        "--frames",
        default=":",
        metavar="A:B:STEP",
        help="frames to convert, as a Python slice (the last 50: --frames=-50:); pictures keep their number in the"
        " recording, and the resting reading is still taken from all of it",
    )
    add(verb, "--keep")
    verb.set_defaults(keep=KEEP)
    verb.add_argument(
        "--reverse",
        dest="run",
        action="store_const",
        const=reverse,
        help="translate the other way: from the DIGIT's gel in frames.h5, or in a simulated recording, to the BioTac's"
        " skin, force and electrodes, in the HDF5 file --out; takes only --frames, --weights, --to and --overwrite",
    )
    verb.add_argument("--overwrite", action="store_true", help="replace older results of the same name")
    add(verb, *PREPARE)
    add(verb, *UNIT)
    add(verb, "--object-reflectance", whose="what touches the gel (default: the calibration's)")
    add(verb, *ANSWER)
    add(verb, "--error", bound="levels of a picture, such as 0.6levels")
    about = "print what would be built, and its time, memory and disk, and stop"
    verb.add_argument("--plan", action="store_true", help=about)
    add(verb, "--progress")


def run(options: argparse.Namespace) -> int:
    """Convert each recording, going on after a bad one; returns the exit status."""
    one_thread()  # before numpy is imported
    from ...jobs import convert, plan, results
    from ...pictures.presets import describe_choice
    from ...recordings import readers
    from ...sensors import SOURCE

    job, asked, paths, levels = _read(options)
    if options.plan:
        counts = [len(readers.read(path, job.prepare.columns, asked.source or SOURCE, lean=True)) for path in paths]
        chosen = sum(len(results.select(job.frames, count)) for count in counts)
        solved = asked.gel != results.TRANSLATED
        tell("\n".join(plan.of_frames(chosen, job.keep, asked.preset, solved=solved, target=asked.target).lines()))
        return 0
    folders = results.result_folders(paths, options.out, options.overwrite)
    tools = convert.load_tools(asked)
    if levels is not None:
        say(describe_choice(asked.preset, levels))
    converted = []
    for path, folder in zip(paths, folders, strict=True):
        try:
            with bar(folder.name, "frame", options.progress) as shown:
                done = convert.convert(path, folder, job, tools, shown)
        except TactileError as error:
            complain(str(error))
            continue
        for warning in done.warnings:
            say(f"warning: {folder.name}: {warning}")
        if done.remark:
            say(f"{folder.name}: {done.remark}")
        tell(str(done.folder))
        converted.append(done.folder)
    failed = len(folders) - len(converted)
    if converted:
        sheet = converted[0] / results.SHEET
        next_step(f"open {sheet}; the numbers of every frame are in {results.FRAMES} beside it")
    if failed and len(folders) > 1:
        complain(f"{failed} of {len(folders)} recordings were not converted")
    return 2 if failed else 0


def _read(options: argparse.Namespace) -> tuple[Options, ToolOptions, list[str], float | None]:
    """Return the conversions' options, their tools' options, the recordings' paths, and --error in grey levels."""
    from ...jobs import convert, results
    from ...jobs.error_budget import Budget, parse_budget
    from ...pictures import presets
    from ...pictures.mitsuba import variant
    from ...recordings import PrepareOptions, electrode_gains, readers

    prepare = PrepareOptions(**prepare_words(options))
    keep = results.parse_words(options.keep, results.KEEPABLE, least=0)
    answer = parse_answer(options)
    sensor = None if options.sensor is None else electrode_gains.read(options.sensor)
    paths = readers.list_fingers(options.recordings, prepare.columns)
    source = None if options.weights else readers.sensor_of_first(paths, prepare.columns)
    budget = Budget() if options.error is None else parse_budget(options.error)
    levels = budget.only("levels", "Nothing else can be chosen in a translation")
    preset = presets.FAST if levels is None else variant.fitting(levels)
    job = convert.Options(results.parse_frames(options.frames), keep, prepare, options.overwrite, sensor)
    pictures = options.calibration, preset, None
    asked = convert.ToolOptions(
        options.weights, *pictures, answer, options.gel, options.target, source, options.object_reflectance
    )
    return job, asked, paths, levels


def reverse(options: argparse.Namespace) -> int:
    """Translate a gel's frames back to the BioTac, for --reverse; returns the exit status."""
    one_thread()  # before numpy is imported
    from ...jobs import results
    from ...jobs.convert import reverse as translate_back
    from ...translation.translate import load_translator

    for name in (*PREPARE, *UNIT, *ANSWER, "--object-reflectance", "--error", "--plan", "--keep"):
        option = {"default": KEEP} if name == "--keep" else OPTIONS.get(name, {})
        given = getattr(options, option.get("dest", name[2:].replace("-", "_")))
        if name not in REVERSIBLE and given not in (None, False, option.get("default")):
            raise TactileError(name, "given with --reverse", f"{', '.join(REVERSIBLE)} alone", "Leave it out")
    if len(options.recordings) > 1:
        raise TactileError("--reverse", f"{len(options.recordings)} inputs", "one", "Give each a file of its own")
    frames = results.parse_frames(options.frames)
    translator = load_translator(options.weights, None, options.target if options.weights is None else None, None)
    with bar("reverse", "frame", options.progress) as shown:
        translate_back(options.recordings[0], options.out, translator, frames, shown, overwrite=options.overwrite)
    tell(options.out)
    return 0
