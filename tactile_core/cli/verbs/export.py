"""``tactile export``: write a finished job in a layout that other programs read."""

from __future__ import annotations

import argparse

from ..terminal import bar, next_step, say, tell
from .common import add

BRIEF = "write a finished batch job as NPZ, PNG, OpenEXR or LeRobot data"
TEXT = """\
Write the shards of a finished job (see `tactile batch`) as
  npz      one NPZ file per recording, with all arrays
  png      a folder of pictures per recording (the job must have kept image)
  imagefolder
           PNG pictures in folders train and test, with their labels and numbers in metadata.csv, as Hugging Face's
           library `datasets` loads them (the job must have kept image)
  exr      a folder of OpenEXR files per recording: heights in metres and pictures, as far as they were kept
           (needs OpenEXR: see `tactile doctor`)
  lerobot  a LeRobot v3.0 data set: one recording is one episode (needs pyarrow: see `tactile doctor`)
  lerobot21
           the same in LeRobot v2.1, which GR00T reads, too: a file and a video per episode (needs pyarrow and OpenCV)
In LeRobot's data sets observation.state is force (N), place (m) and contact (0 or 1), and action is the
state of the next frame. Unknown values are 0, and labels are the strings labels.NAME."""
EPILOG = """\
example:
  tactile export job --to lerobot --out dataset"""
LAYOUTS = ("npz", "png", "imagefolder", "exr", "lerobot", "lerobot21")


def arguments(verb: argparse.ArgumentParser) -> None:
    """Add the arguments of this verb."""
    verb.add_argument("job", metavar="JOB", help="folder of the job")
    verb.add_argument("--to", required=True, choices=LAYOUTS, help="layout")
    verb.add_argument("--out", required=True, metavar="DIR", help="new folder")
    add(verb, "--progress")


def run(options: argparse.Namespace) -> int:
    """Write the job's results in the layout; returns the exit status."""
    from ...jobs import export

    with bar("export", "frame", options.progress) as shown:
        source = export.export(options.job, options.to, options.out, shown)
    for name, why in source.aside.items():
        say(f"warning: {name} was set aside and is left out: {why}")
    tell(options.out)
    next_step(f"it holds {export.layouts()[options.to].BRIEF}; note.json in it names the job and what was left out")
    return 0
