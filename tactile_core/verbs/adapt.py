"""``tactile adapt``: the gains of an unknown sensor, from its own recordings."""

from __future__ import annotations

import argparse

from ..terminal import say, tell
from .common import NOTHING

BRIEF = "gains and offsets of a sensor, from its recordings"
TEXT = """\
Fit a gain and an offset to each electrode of a BioTac, so that its readings in contact look like the simulated ones
that the networks were trained on. Recordings of one sensor are taken together; what touched it need not be known. The
more places were touched, softly and hard, the better. An electrode that the recordings do not tell enough of keeps
gain 1, and a warning says so. Rectified recordings give no offsets."""
EPILOG = """\
example:
  tactile adapt day1/*.csv --out sensor.toml
  tactile convert day2/touch.csv --out results --sensor sensor.toml"""
LEAVES = NOTHING


def arguments(verb: argparse.ArgumentParser) -> None:
    """Of this verb."""
    verb.add_argument("recordings", nargs="+", metavar="RECORDING", help="of one sensor, in any known layout")
    verb.add_argument("--out", required=True, metavar="FILE", help="new TOML file to write")
    verb.add_argument("--weights", metavar="DIR", help="networks of your own training instead of the shipped ones")


def run(options: argparse.Namespace) -> int:
    """Fit and write."""
    from .. import adapt, atomic, networks, typical_signals
    from ..recordings import sensor_file

    atomic.claim(options.out)
    typical = typical_signals.read(options.weights or networks.WEIGHTS_FOLDER)
    done = adapt.adapt(options.recordings, typical)
    for warning in done.warnings:
        say(f"warning: {warning}")
    sensor_file.write(options.out, done.sensor)
    tell(options.out)
    return 0
