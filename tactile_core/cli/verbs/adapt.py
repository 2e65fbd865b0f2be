"""``tactile adapt``: the gains of an unknown sensor, from its own recordings."""

from __future__ import annotations

import argparse
from shlex import quote

from ..terminal import next_step, say, tell
from .common import NOTHING, columns_argument, columns_of, polarity_argument, weights_argument

BRIEF = "fit rest, gains and offsets of a BioTac unit to its recordings"
TEXT = """\
Fit a gain and an offset to each electrode of a BioTac, so that its readings in contact look like the simulated ones
that the networks were trained on. Recordings of one sensor are taken together; what touched it need not be known. The
more places were touched, softly and hard, the better. An electrode whose gain the recordings do not determine
keeps gain 1, and a warning says so. Rectified recordings give no offsets. The gains' uncertainty is printed; fewer than
five different contacts give none.

Three raw recordings or more also give the unit's rest, from those of the lowest fluid pressure (of the least squeezed
electrodes where there is no PDC), with how far each electrode may be off: `tactile convert --sensor` takes it for
recordings that begin and end in contact. Files of several fingers give a section a finger: these are units of their
own. Recordings of a BioTac SP, which all begin in contact and have no PDC, give their rest alone: each electrode's
median over the tenth of all frames in which it is least loaded."""
EPILOG = """\
example:
  tactile adapt day1/*.csv --out sensor.toml
  tactile convert day2/touch.csv --out results --sensor sensor.toml"""
LEAVES = NOTHING


def arguments(verb: argparse.ArgumentParser) -> None:
    """Add the arguments of this verb."""
    verb.add_argument("recordings", nargs="+", metavar="RECORDING", help="recordings of one unit, in any known layout")
    verb.add_argument("--out", required=True, metavar="FILE", help="new TOML file to write")
    polarity_argument(verb)
    columns_argument(verb)
    weights_argument(verb)


def run(options: argparse.Namespace) -> int:
    """Fit and write the gains; returns the exit status."""
    from ...files import atomic
    from ...recordings import PrepareOptions, electrode_gains
    from ...translation import adapt, networks, reference_signals

    atomic.claim(options.out)
    typical = reference_signals.read(options.weights or networks.WEIGHTS_FOLDER)
    prepare = PrepareOptions(polarity=options.polarity, columns=columns_of(options))
    sensor, warnings = adapt.adapt_hand(options.recordings, typical, prepare)
    for warning in warnings:
        say(f"warning: {warning}")
    for name, section in sensor.sections().items():
        say(f"{name}: {section.note}")
    electrode_gains.check(sensor, options.out)
    electrode_gains.write(options.out, sensor)
    tell(options.out)
    next_step(f"tactile convert touch.csv --out results --sensor {quote(options.out)}")
    return 0
