"""The command ``tactile``: verbs, their arguments, and what they say. The work is done in the rooms they import."""

from __future__ import annotations

import argparse
import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress

from . import __version__
from .errors import TactileError
from .stop_signals import Stopped, stopping

DESCRIPTION = """\
Translate touch between robot fingertips: BioTac electrode recordings become the deformation of a BioTac,
of a DIGIT, and the pictures that the DIGIT's camera would have seen."""

EPILOG = """\
example:
  tactile info touch.csv                   what the recording holds, and what is wrong with it
  tactile convert touch.csv --out results  pictures in results/touch/images, numbers in results/touch/frames.h5

`tactile VERB --help` explains a verb. Exit status: 0 done, 2 bad input, 130 interrupted, 143 or 129 stopped by
SIGTERM or SIGHUP."""

CONVERT = """\
Read, tare, translate and shade recordings. Each gets the folder DIR/<file name without extension> with
  frames.h5          numbers of every frame: time, electrodes, force, contact_center, confidence, flags; and what
                     --keep names
  images/%05d.png    DIGIT pictures, 240 x 320, numbered by the frame's index in the recording (from 0)
  contact_sheet.png  a few frames to look at
  note.json          versions, weights, options, warnings
  timings.json       ms a frame of each stage
One frame for each data row, in file order; bad rows are repaired and flagged. A folder appears whole or not at all."""

CONVERT_EPILOG = """\
examples:
  tactile convert touch.csv --out results
  tactile convert day1/*.csv --out results --keep latent --overwrite
  tactile convert touch.csv --out results --frames 200:300:5 --tare 0:50

Size of a 700-frame result, measured: {sizes}."""
# 4 B a number of 3,650 + 2,255 nodes; pictures measured at 28 kB (mean of the simulated recording) to 50 kB (of a
# noisy real one), packed height maps at 200 kB.
SIZES = "displacement 50 MB, latent 0.3 MB, image 20 to 35 MB, height about 140 MB (the default: 70 to 85 MB)"

INFO_EPILOG = """\
example:
  tactile info results/*.csv"""

PAIRS_EPILOG = """\
example:
  tactile pairs scenes/press_sphere/scene.toml --count 2000 --seed 1 --out pairs.h5 --workers 4

An interrupted run goes on where it stopped when the same command is given again."""

SIMULATE_EPILOG = """\
example:
  tactile simulate scenes/press_roll_slide/scene.toml --seed 1 --out press_roll_slide.h5"""

TRAIN_EPILOG = """\
example:
  tactile train pairs.h5 --out trained --seed 1
  tactile convert touch.csv --out results --weights trained/weights

Needs torch: pip install "tactile-core[train]". An interrupted run goes on where it stopped."""


# What a stopped verb leaves.
LEAVES = "no half file is left"
RESUMES = "the same command goes on where it stopped"

MAX_SEED = 2**32 - 1  # what numpy's and torch's generators both take
MAX_EFFORT = 1000.0
EXTRAS = {"torch": "train", "scipy": "fem"}  # module -> extra that brings it


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one verb; returns the exit status."""
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")  # a path may hold what the terminal cannot show
    options = _parser().parse_args(arguments)
    try:
        with stopping():
            _check_out(options)
            status = options.run(options)
            sys.stdout.flush()
    except TactileError as error:
        _complain(str(error))
        return 2
    except ModuleNotFoundError as error:
        if error.name not in EXTRAS:
            raise
        _complain(f'this verb needs {error.name}. Install it: pip install "tactile-core[{EXTRAS[error.name]}]"')
        return 2
    except KeyboardInterrupt as stop:
        return _stopped(stop, options.stopped)
    except BrokenPipeError:
        # The reader of our output has gone, as in `tactile info … | head`; the exit must not flush into it again.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    return status


def _complain(text: str) -> None:
    _say("error: " + text)


def _say(text: str) -> None:
    """One line on stderr, whatever the text holds."""
    print("tactile: " + " ".join(text.split()), file=sys.stderr)


def _stopped(stop: KeyboardInterrupt, left: str) -> int:
    """Say what an interrupted verb leaves; returns the exit status that shells give: 128 + the signal's number."""
    with suppress(OSError):  # after SIGHUP the terminal is gone
        _say(f"stopped by {stop}; {left}" if isinstance(stop, Stopped) else f"interrupted; {left}")
    return 128 + (stop.number if isinstance(stop, Stopped) else signal.SIGINT)


def _check_out(options: argparse.Namespace) -> None:
    """An empty name, as a script's unset variable gives it, would be the current folder."""
    if getattr(options, "out", None) == "":
        raise TactileError("--out", "an empty name", "a file or folder to write", "Name one")


def _parser() -> argparse.ArgumentParser:
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog="tactile", description=DESCRIPTION, epilog=EPILOG, formatter_class=raw)
    parser.add_argument("--version", action="version", version=f"tactile {__version__}")
    verbs = parser.add_subparsers(metavar="VERB", required=True, title="verbs")

    def verb(
        name: str, run: Callable[[argparse.Namespace], int], brief: str, text: str, epilog: str
    ) -> argparse.ArgumentParser:
        sub = verbs.add_parser(name, help=brief, description=text, epilog=epilog, formatter_class=raw)
        sub.set_defaults(run=run, stopped=RESUMES if name in ("pairs", "train") else LEAVES)
        return sub

    _convert_arguments(verb("convert", _convert, "recordings to DIGIT pictures", CONVERT,
                            CONVERT_EPILOG.format(sizes=SIZES)))
    info = verb("info", _info, "what a recording holds",
                "Say what recordings hold: sensor, channels, rate, duration, tare, gaps, bad samples.", INFO_EPILOG)
    info.add_argument("recordings", nargs="+", metavar="FILE")
    _simulate_arguments(verb("simulate", _simulate, "simulate a recording",
                             "Simulate the recording that a scene describes, marked so and with its true meshes.",
                             SIMULATE_EPILOG))
    _pairs_arguments(verb("pairs", _pairs, "simulate paired contacts",
                          "Simulate contacts of a scene's indenters with both sensors: same force, angle and place.",
                          PAIRS_EPILOG))
    _train_arguments(verb("train", _train, "train the networks on pairs",
                          "Train the networks and the force estimate; DIR/weights then holds weights and card.",
                          TRAIN_EPILOG))
    return parser


def _convert_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("recordings", nargs="+", metavar="RECORDING", help="CSV, HDF5 or NPZ files, in any known layout")
    verb.add_argument("--out", required=True, metavar="DIR", help="folder of the results; may exist and hold others")
    verb.add_argument("--frames", default=":", metavar="A:B:STEP",
                      help="only these frames, counted from 0 as in Python; for a negative A write --frames=-50: ."
                           " Pictures keep their number in the recording, and the tare still sees the whole of it")
    verb.add_argument("--keep", default="latent,displacement,image", metavar="WORDS",
                      help="what to write beside the numbers that are always there, out of"
                           " latent,displacement,height,image (default: %(default)s)")
    verb.add_argument("--overwrite", action="store_true", help="replace older results of the same name")
    verb.add_argument("--tare", default="auto", metavar="auto|none|A:B",
                      help="frames without contact that give the resting reading (default: found automatically)")
    verb.add_argument("--kind", choices=("raw", "tared", "scaled", "rectified"),
                      help="what the file holds, where the automatic answer is wrong")
    verb.add_argument("--counts-per-unit", type=float, metavar="X", help="factor to counts, for a scaled recording")
    verb.add_argument("--no-drift", action="store_true", help="do not remove drift")
    verb.add_argument("--weights", metavar="DIR", help="networks of your own training instead of the shipped ones")
    _progress_argument(verb)


def _simulate_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("scene", metavar="SCENE", help="scene.toml with a [recording]")
    verb.add_argument("--seed", type=int, default=0, metavar="S", help="same seed, same file (default: 0)")
    verb.add_argument("--out", required=True, metavar="FILE", help="HDF5 file to write")
    _progress_argument(verb)


def _pairs_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("scene", metavar="SCENE", help="scene.toml: indenters and their range of places, angles, depths")
    verb.add_argument("--count", type=int, required=True, metavar="N", help="number of paired contacts")
    verb.add_argument("--seed", type=int, default=0, metavar="S", help="same seed, same file (default: 0)")
    verb.add_argument("--out", required=True, metavar="FILE", help="HDF5 file to write")
    verb.add_argument("--workers", type=int, default=1, metavar="N", help="processes; changes no bit (default: 1)")
    _progress_argument(verb)


def _train_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("pairs", metavar="PAIRS", help="HDF5 file of `tactile pairs`")
    verb.add_argument("--out", required=True, metavar="DIR", help="folder to write")
    verb.add_argument("--seed", type=int, default=0, metavar="S", help="same seed, same weights (default: 0)")
    verb.add_argument("--effort", type=float, default=1.0, metavar="X", help="times the usual epochs (default: 1)")
    verb.add_argument("--overwrite", action="store_true", help="train anew over older weights in DIR")
    _progress_argument(verb)


def _progress_argument(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("--progress", action="store_true", help="show progress even where stderr is no terminal")


def _convert(options: argparse.Namespace) -> int:
    from . import convert, results
    from .recordings import PrepareOptions

    prepare = PrepareOptions(
        kind=options.kind,
        tare=None if options.tare == "auto" else options.tare,
        drift=not options.no_drift,
        counts_per_unit=options.counts_per_unit,
    )
    keep, frames = results.parse_keep(options.keep), convert.parse_frames(options.frames)
    job = convert.Options(frames=frames, keep=keep, prepare=prepare, overwrite=options.overwrite)
    folders = results.result_folders(options.recordings, options.out, options.overwrite)
    tools = convert.load_tools(options.weights)
    failed = 0
    for path, folder in zip(options.recordings, folders, strict=True):
        try:
            with _bar(folder.name, "frame", options.progress) as bar:
                done = convert.convert(path, folder, job, tools, bar)
        except TactileError as error:
            _complain(str(error))
            failed += 1
            continue
        for warning in done.warnings:
            _say(f"warning: {folder.name}: {warning}")
        print(done.folder)
    if failed and len(folders) > 1:
        _complain(f"{failed} of {len(folders)} recordings were not converted")
    return 2 if failed else 0


def _info(options: argparse.Namespace) -> int:
    from .recordings import info

    failed = 0
    for path in options.recordings:
        try:
            print(info.describe(path))
        except TactileError as error:
            _complain(str(error))
            failed += 1
    return 2 if failed else 0


def _simulate(options: argparse.Namespace) -> int:
    _check_seed(options.seed)
    from .mechanics.recording import simulate_recording

    with _bar("simulate", "frame", options.progress) as bar:
        simulate_recording(options.scene, options.out, options.seed, bar)
    print(options.out)
    return 0


def _pairs(options: argparse.Namespace) -> int:
    if options.workers < 1:
        raise TactileError("--workers", str(options.workers), "1 or more", "Give the number of processes")
    _check_seed(options.seed)
    from .mechanics.pairs import make_pairs

    with _bar("pairs", "contact", options.progress) as bar:
        make_pairs(options.scene, options.count, options.seed, options.out, options.workers, bar)
    print(options.out)
    return 0


def _train(options: argparse.Namespace) -> int:
    _check_seed(options.seed)
    if not 0 < options.effort <= MAX_EFFORT:
        raise TactileError("--effort", str(options.effort), f"above 0, at most {MAX_EFFORT}", "1 is the usual training")
    from .training.options import Options
    from .training.train import train

    with _bar("training", "%", options.progress) as bar:
        train(options.pairs, options.out, options.seed, Options(effort=options.effort),
              lambda share, text: bar(round(100 * share), 100), overwrite=options.overwrite)
    print(options.out)
    return 0


def _check_seed(seed: int) -> None:
    if not 0 <= seed <= MAX_SEED:
        raise TactileError("--seed", str(seed), f"0 to {MAX_SEED}", "Give another one")


@contextmanager
def _bar(name: str, unit: str, forced: bool) -> Iterator[Callable[[int, int], None]]:
    """A callback (done, in all) that draws a bar: on a terminal, for what takes over two seconds; or when forced."""
    if not forced and not sys.stderr.isatty():
        yield lambda done, total: None
        return
    from tqdm import tqdm

    with tqdm(desc=name, unit=unit, delay=0 if forced else 2, file=sys.stderr) as bar:

        def show(done: int, total: int) -> None:
            bar.total = total
            bar.update(done - bar.n)

        yield show
