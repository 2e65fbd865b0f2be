"""What each verb of ``tactile`` costs, in a process of its own: time, memory, and the heavy libraries it loads.

    python scripts/profile_verbs.py --json FILE          all, and the conversion of 700 frames with its hottest functions
    python scripts/profile_verbs.py --quick --json FILE  each verb on as little as it takes, about a minute

CPU time is user and system together; it changes less with a machine's load than wall time, which is given beside it.
The cases, and which libraries each may load, are in ``CASES``; tests/test_lean.py holds them against each other.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

from tactile_core import atomic
from tactile_core.rows import HEADER, Row, line, row

ROOT = Path(__file__).resolve().parent.parent
SCENES = ROOT / "scenes"
RECORDING = SCENES / "press_roll_slide" / "press_roll_slide.h5"
ONE_CORE = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
HEAVY = (
    "numpy", "scipy", "h5py", "PIL", "matplotlib", "tqdm", "msgspec", "torch", "mitsuba", "drjit", "OpenEXR", "trimesh",
    "rtree", "cholespy", "pypardiso", "skfem", "rosbags", "distributed", "pyarrow", "safetensors",
)  # fmt: skip
CHILD = """
import json, resource, sys
from tactile_core import cli
try:
    status = cli.main(sys.argv[2:])
except SystemExit as end:
    status = end.code
used = resource.getrusage(resource.RUSAGE_SELF)
peak = used.ru_maxrss / (1024 * 1024 if sys.platform == "darwin" else 1024)
told = {"status": status, "cpu": used.ru_utime + used.ru_stime, "peak": peak, "modules": sorted(sys.modules)}
open(sys.argv[1], "w").write(json.dumps(told))
"""


class Case(NamedTuple):
    """A command, what it may load, and the exit status it ends with. ``{}`` in words stands for a scratch folder."""

    name: str
    words: str
    loads: str
    status: int = 0


# In this order: later ones read what earlier ones have written.
CASES = (
    Case("help", "--help", ""),
    Case("info", f"info {RECORDING}", "numpy h5py"),
    Case("convert", f"convert {RECORDING} --out {{}}/converted --frames 100:110", "numpy h5py PIL matplotlib"),
    Case("convert_latent", f"convert {RECORDING} --out {{}}/codes --keep latent", "numpy h5py PIL matplotlib"),
    Case("watch", "watch {}/touch.csv --out {}/now.png --idle 0.1", "numpy PIL"),
    Case("batch", "batch {}/touch.csv --out {}/job --keep latent,image", "numpy h5py msgspec"),
    Case("export", "export {}/job --to npz --out {}/exported", "numpy h5py msgspec"),
    Case("adapt", f"adapt {RECORDING} --out {{}}/sensor.toml", "numpy h5py"),
    Case("render_fast", "render {}/converted/press_roll_slide/frames.h5 --out {}/fast --preset fast", "numpy h5py PIL"),
    Case(
        "render_standard", "render {}/converted/press_roll_slide/frames.h5 --out {}/standard --frames :2",
        "numpy h5py PIL mitsuba drjit",
    ),
    Case("simulate", "simulate {}/scene.toml --out {}/simulated.h5", "numpy h5py msgspec"),
    Case("pairs", f"pairs {SCENES / 'press_sphere'} --count 2 --out {{}}/pairs.h5", "numpy h5py msgspec"),
    Case("mesh", "mesh digit --out {}/rest.ply", "numpy"),
    Case("mesh_press_fast", "mesh digit --press sphere --diameter 7 --depth-mm 0.3 --out {}/fast.ply", "numpy"),
    Case(
        "mesh_press_full", "mesh digit --press sphere --diameter 7 --depth-mm 0.3 --tier full --out {}/full.ply",
        "numpy scipy pypardiso",
    ),
    Case("train_refused", "train {}/absent.h5 --out {}/trained", "numpy torch", status=2),
    Case("doctor", "doctor", ""),
)  # fmt: skip


class Cost(NamedTuple):
    """Of one run. cpu, wall, imports : s; peak : MB; heavy : libraries of HEAVY that it had loaded."""

    cpu: float
    wall: float
    imports: float
    peak: float
    heavy: list[str]


def main(arguments: list[str] | None = None) -> int:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="without the 700 frames")
    parser.add_argument("--json", metavar="FILE", help="write the rows here")
    options = parser.parse_args(arguments)
