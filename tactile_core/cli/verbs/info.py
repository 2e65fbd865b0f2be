"""``tactile info``: what a recording holds."""

from __future__ import annotations

import argparse

from ...errors import TactileError
from ..terminal import complain, tell
from .common import NOTHING, polarity_argument

BRIEF = "what a recording holds"
TEXT = "Say what recordings hold: sensor, channels, rate, duration, polarity, tare, gaps, bad samples."
EPILOG = """\
example:
  tactile info results/*.csv"""
LEAVES = NOTHING


def arguments(verb: argparse.ArgumentParser) -> None:
    """Add the arguments of this verb."""
    verb.add_argument("recordings", nargs="+", metavar="FILE")
    polarity_argument(verb)


def run(options: argparse.Namespace) -> int:
    """Describe; one bad recording does not stop the others."""
    from ...recordings import PrepareOptions, info
    from ...recordings.readers import each_finger

    failed = 0
    for path in options.recordings:
        try:
            for finger in each_finger(path):
                tell(info.describe(finger, PrepareOptions(polarity=options.polarity)))
        except TactileError as error:
            complain(str(error))
            failed += 1
    return 2 if failed else 0
