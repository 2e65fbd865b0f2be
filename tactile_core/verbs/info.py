"""``tactile info``: what a recording holds."""

from __future__ import annotations

import argparse

from ..errors import TactileError
from ..terminal import complain, tell
from .common import NOTHING

BRIEF = "what a recording holds"
TEXT = "Say what recordings hold: sensor, channels, rate, duration, tare, gaps, bad samples."
EPILOG = """\
example:
  tactile info results/*.csv"""
LEAVES = NOTHING


def arguments(verb: argparse.ArgumentParser) -> None:
    """Of this verb."""
    verb.add_argument("recordings", nargs="+", metavar="FILE")


def run(options: argparse.Namespace) -> int:
    """Describe; one bad recording does not stop the others."""
    from ..recordings import info

    failed = 0
    for path in options.recordings:
        try:
            tell(info.describe(path))
        except TactileError as error:
            complain(str(error))
            failed += 1
    return 2 if failed else 0
