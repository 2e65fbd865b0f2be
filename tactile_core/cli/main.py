"""The command ``tactile``: its parser, and how each verb ends. The verbs are in ``verbs/``."""

from __future__ import annotations

import argparse
import os
import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from types import FrameType

from ..errors import TactileError
from ..files.installed import advice
from ..files.version import __version__
from .terminal import complain, discard_output, flush, say
from .verbs import VERBS
from .verbs.common import NOTHING
from .verbs.doctor import LIBRARIES

NAMES = ("SIGTERM", "SIGHUP")  # Windows has no SIGHUP


class Stopped(KeyboardInterrupt):
    """Exception that a stop signal raises. number : the signal's"""

    def __init__(self, number: int) -> None:
        super().__init__(signal.Signals(number).name)
        self.number = number


@contextmanager
def stopping() -> Iterator[None]:
    """Make stop signals raise Stopped inside the block; restore the former handlers after it.

    A signal that is ignored (nohup) or handled by the program around us stays so. After the first signal the others are
    ignored up to the block's end: `timeout` and terminals send two, and the second would interrupt the clean-up.
    Outside the main thread, where Python allows no handlers, nothing changes."""
    numbers = [getattr(signal, name) for name in NAMES if hasattr(signal, name)]
    ours = [number for number in numbers if signal.getsignal(number) is signal.SIG_DFL]
    if threading.current_thread() is not threading.main_thread():
        ours = []

    def stop(number: int, frame: FrameType | None) -> None:
        """Raise Stopped, and ignore all further stop signals, so that the clean-up is not interrupted."""
        for other in ours:
            signal.signal(other, signal.SIG_IGN)
        raise Stopped(number)

    try:
        for number in ours:
            signal.signal(number, stop)
        yield
    finally:
        for number in ours:
            signal.signal(number, signal.SIG_DFL)


DESCRIPTION = """\
Translate touch between robot fingertips: the recorded electrodes of a BioTac become the deformation of its skin,
that of a DIGIT's gel under the same contact, and the pictures that the DIGIT's camera would have taken."""

EPILOG = """\
examples:
  tactile info touch.csv                   what the recording holds, and what is wrong with it
  tactile convert touch.csv --out results  pictures in results/touch/images, numbers in results/touch/frames.h5
  tactile scenes copy press_roll_slide     a recording to try with: scenes/press_roll_slide/press_roll_slide.h5

`tactile VERB --help` explains a verb. Exit status: 0 done, 2 bad input, 130 interrupted, 143 or 129 stopped by
SIGTERM or SIGHUP."""

# module -> extra that brings it
EXTRAS = {each.module: each.extra for each in LIBRARIES if each.extra}
EXTRAS |= {"rtree": "fem", "drjit": "render", "lz4": "ros", "dask_jobqueue": "batch", "sklearn": "dataset"}
# Options that name something; that of --keep may be empty.
PATHS = (
    "frames", "press", "weights", "cluster", "calibration", "sensor", "start", "background", "json", "sheet", "test",
)  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one verb; returns the exit status, 0 if done. arguments : words after `tactile`; None: the process's own"""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed, as in `tactile convert … >&-`
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115 - for as long as the process lives
        stream = getattr(sys, name)
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")  # a path may hold what the terminal cannot show
    if os.environ.get("MPLBACKEND", "").startswith("module://"):
        del os.environ["MPLBACKEND"]  # a notebook's, whose module another environment lacks
    parser = _parser()
    options, unknown = parser.parse_known_args(arguments)
    if unknown:
        getattr(options, "parser", parser).error(f"unrecognized arguments: {' '.join(unknown)}")
    if not hasattr(options, "run"):
        parser.error(f"no verb given; `tactile --help` says what each does: {', '.join(VERBS)}")
    try:
        with stopping():
            _check_out(options)
            status = options.run(options)
            flush()
    except TactileError as error:
        complain(str(error))
        return 2
    except ModuleNotFoundError as error:
        if error.name not in EXTRAS:
            raise
        complain(f"this verb needs {error.name}. Install it: {advice(EXTRAS[error.name])}")
        return 2
    except KeyboardInterrupt as stop:
        return _stopped(stop, options.leaves)
    except BrokenPipeError:
        # The reader of our output has gone, as in `tactile info … | head`.
        discard_output()
        return 0
    except OSError as error:
        if error.errno is None:
            raise  # of a library, not of the system
        where, found = str(error.filename or "a file or connection"), error.strerror or str(error)
        complain(str(TactileError(where, found, advice="Check paths, permissions and the disk's room")))
        return 2
    return status


def _stopped(stop: KeyboardInterrupt, left: str) -> int:
    """Say what an interrupted verb leaves; returns the exit status that shells give: 128 + the signal's number."""
    with suppress(OSError):  # after SIGHUP the terminal is gone
        say(f"stopped by {stop}; {left}" if isinstance(stop, Stopped) else f"interrupted; {left}")
    return 128 + (stop.number if isinstance(stop, Stopped) else signal.SIGINT)


def _check_out(options: argparse.Namespace) -> None:
    """Raise TactileError for an empty --out, as from a script's unset variable (it would mean the current folder), and
    for other empty paths."""
    if getattr(options, "out", None) == "":
        raise TactileError("--out", "an empty name", "a file or folder to write", "Name one")
    for name in PATHS:
        if getattr(options, name, None) == "":
            raise TactileError(f"--{name}", "an empty value", "a value", "Leave the option out, or name one")


def _parser() -> argparse.ArgumentParser:
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog="tactile", description=DESCRIPTION, epilog=EPILOG, formatter_class=raw)
    parser.add_argument("--version", action="version", version=f"tactile {__version__}")
    verbs = parser.add_subparsers(metavar="VERB", title="verbs")
    for name, verb in VERBS.items():
        sub = verbs.add_parser(
            name, help=verb.BRIEF, description=verb.TEXT, epilog=verb.EPILOG, formatter_class=raw,
            allow_abbrev=False,  # of batch, --frames would mean --frames-apart
        )  # fmt: skip
        verb.arguments(sub)
        sub.set_defaults(run=verb.run, leaves=getattr(verb, "LEAVES", NOTHING), parser=sub)
    return parser
