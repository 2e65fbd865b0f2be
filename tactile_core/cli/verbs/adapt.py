"""``tactile adapt``: fit rest, film, gains and stiffness of an unknown sensor to its own recordings."""

from __future__ import annotations

import argparse
from shlex import quote

from ...errors import TactileError
from ..terminal import next_step, say, tell
from .common import add, columns_of

BRIEF = "fit rest, film, gains and offsets of a BioTac unit to its recordings"
TEXT = """\
Fit a gain and an offset to each electrode of a BioTac, so that its readings in contact look like the simulated ones
that the networks were trained on. Recordings of one sensor are taken together; what touched it need not be known. The
more places were touched, softly and hard, the better. An electrode whose gain the recordings do not determine
keeps gain 1, and a warning says so. Rectified recordings give no offsets. The gains' uncertainty is printed; fewer than
five different contacts give no gains.

Three raw recordings or more also give the unit's fluid film, its rest, and how far each electrode's rest may be off.
Rest comes from the recordings of the lowest fluid pressure (without PDC, of the least squeezed electrodes), or with
--rest from one of the untouched finger. `tactile convert --sensor` uses it for recordings that begin and end in
contact. Files of several fingers give a section for each finger, since each is a unit. Recordings of a BioTac SP all
begin in contact and have no PDC. They give only film and rest: those with which simulated contacts explain them best.

--force gives the unit a stiffness, the factor by which its force and pressure exceed those of the typical unit under
the same signals. It names a file with newtons in one column or three (x, y, z), in rows as the first recording's or
behind a column of time; or it names columns of the recordings' own files. The lag is found. The scale is fitted on the
first half of the frames and judged on the second. It is not written if force is no better there with it than without.
Both errors are printed."""
EPILOG = """\
example:
  tactile adapt day1/*.csv --out sensor.toml
  tactile convert day2/touch.csv --out results --sensor sensor.toml
  tactile adapt pressed.csv --rest untouched.csv --force force.csv --out sensor.toml
  tactile adapt day1/*.csv --force fx,fy,fz --out sensor.toml"""


def arguments(verb: argparse.ArgumentParser) -> None:
    """Add the arguments of this verb."""
    verb.add_argument("recordings", nargs="+", metavar="RECORDING", help="recordings of one unit, in any known layout")
    verb.add_argument("--out", required=True, metavar="FILE", help="new TOML file to write")
    verb.add_argument("--rest", metavar="FILE", help="recording of the untouched finger, which gives the rest")
    verb.add_argument(
        "--force",
        metavar="FILE|COLUMNS",
        help="file of the force measured beside the first RECORDING, N; or columns of the recordings, as fx,fy,fz",
    )
    add(verb, "--polarity", "--columns", "--weights")


def run(options: argparse.Namespace) -> int:
    """Fit the unit's rest, film, gains and stiffness, and write them to one file; returns the exit status."""
    from ...files import atomic
    from ...recordings import PrepareOptions, electrode_gains
    from ...translation import adapt, force_scale, networks, reference_signals
    from ...translation.translate import load_translator

    atomic.claim(options.out)
    typical = reference_signals.read(options.weights or networks.WEIGHTS_FOLDER)
    prepare = PrepareOptions(polarity=options.polarity, columns=columns_of(options))
    sensor, warnings = adapt.adapt_hand(options.recordings, typical, prepare, options.rest)
    for warning in warnings:
        say(f"warning: {warning}")
    if options.force is not None:
        (name, unit), *others = sensor.sections().items()
        if others:
            raise TactileError("--force", f"given for {len(others) + 1} units", "one", "Name one: FILE#0")
        translator = load_translator(options.weights, None, None, sensor.sensor)
        unit, said = force_scale.with_stiffness(unit, options.force, options.recordings, translator, prepare)
        sensor = electrode_gains.units_file({name: unit}, sensor.sensor)
        say(said)
    for name, section in sensor.sections().items():
        say(f"{name}: {section.note}")
    electrode_gains.check(sensor, options.out)
    electrode_gains.write(options.out, sensor)
    tell(options.out)
    next_step(f"tactile convert touch.csv --out results --sensor {quote(options.out)}")
    return 0
