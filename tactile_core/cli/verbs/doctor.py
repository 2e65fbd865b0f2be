"""``tactile doctor``: what this machine can do, and how it could do more."""

from __future__ import annotations

import argparse

from ..terminal import tell
from .common import NOTHING

BRIEF = "check which libraries work here, and how to get more"
TEXT = """\
Say which libraries are here, what each is for, and how Mitsuba draws: compiled by LLVM, or one ray at a time without
it. Each library is tried in a process of its own, so that a broken one breaks nothing; this takes some seconds."""
EPILOG = """\
example:
  tactile doctor"""
LEAVES = NOTHING


def arguments(verb: argparse.ArgumentParser) -> None:
    """Add no arguments: this verb has none."""


def run(options: argparse.Namespace) -> int:
    """Print what works on this machine; returns the exit status."""
    from .. import doctor

    for line in doctor.report():
        tell(line)
    return 0
