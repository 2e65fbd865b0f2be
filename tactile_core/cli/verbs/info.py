"""``tactile info``: describe recordings, or a sensor."""

from __future__ import annotations

import argparse
import os

from ...errors import TactileError
from ..terminal import complain, say, tell
from .common import PREPARE, add, prepare_words

BRIEF = "describe recordings, or a sensor"
TEXT = """\
Describe recordings: sensor, channels, rate, duration, polarity, resting frames (tare), gaps, bad samples. For a
CSV file of a BioTac SP: finger, lines, labels and the counts of its 24 electrodes. With --sensor also the changes
against the unit's rest, which recordings that begin in contact do not show.

A file whose columns, fields or arrays have names of no known layout needs a map. It may be CSV, also without a header,
JSON, HDF5, NPZ, NPY, MATLAB, or a long table with a row for each value. --columns map.toml writes a map if there is
none yet, guessed from names and values of the first file. Check it, then give it to info, convert, batch, adapt and
watch.

Without a recording, --sensor NAME describes a sensor: one that ships, or one in the folder $TACTILE_SENSORS."""
EPILOG = """\
examples:
  tactile info day1/*.csv
  tactile info own.csv --columns map.toml
  tactile info slip.csv --sensor rest.toml
  tactile info --sensor gelsight_mini"""


def arguments(verb: argparse.ArgumentParser) -> None:
    """Add the arguments of this verb."""
    verb.add_argument("recordings", nargs="*", metavar="FILE", help="recordings, in any known layout")
    add(verb, *PREPARE)
    about = "rest and gains of a unit, from `tactile adapt`; or a sensor's name"
    verb.add_argument("--sensor", metavar="FILE|NAME", help=about)


def run(options: argparse.Namespace) -> int:
    """Describe each recording, going on after a bad one; returns the exit status."""
    from ...recordings import PrepareOptions, info
    from ...recordings.readers import each_finger

    if not options.recordings:
        from ...sensors.about import about

        if options.sensor is None:
            advice = "`tactile info --help` has examples"
            raise TactileError("FILE", "missing", "recordings, or --sensor NAME alone", advice)
        tell(about(options.sensor))
        return 0
    if options.columns is not None and not os.path.lexists(options.columns):
        _write_columns(options)
    unit = None
    if options.sensor is not None:
        from ...recordings import electrode_gains  # reads by msgspec, which recordings alone do not need

        unit = electrode_gains.read(options.sensor)
    prepare, failed = PrepareOptions(**prepare_words(options)), 0
    for path in options.recordings:
        try:
            for finger in each_finger(path, prepare.columns):
                tell(info.describe(finger, prepare, unit))
        except TactileError as error:
            complain(str(error))
            failed += 1
    return 2 if failed else 0


def _write_columns(options: argparse.Namespace) -> None:
    """Write the map that the first recording suggests."""
    from ...recordings.opened_file import opened
    from ...recordings.tables import column_map
    from ...recordings.tables.mapped import guess_map

    with opened(options.recordings[0]) as (container, where, _, file):
        guessed, held = guess_map(where, container, file)
    column_map.write(options.columns, guessed, held)
    if guessed[0].electrodes:
        say(f"{options.columns}: written, guessed from names and values; check it")
    else:
        say(f"{options.columns}: written, no 19 electrodes found: name them there")
