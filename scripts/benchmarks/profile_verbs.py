"""Measure the cost of each verb of ``tactile``, in its own process: time, memory, and the heavy libraries it loads.

    python scripts/benchmarks/profile_verbs.py --json FILE   also convert 700 frames
    python scripts/benchmarks/profile_verbs.py --quick --json FILE  each verb on as little as it takes, about a minute

CPU time is user and system together, on one thread; a machine's load changes it less than wall time. The cases and
what each may load are in ``CASES``; tests/scripts/test_profile_verbs.py runs them too.
"""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # `benchmarks` is no package that is installed

from benchmarks.measured_rows import finished, parser_of, printed
from tactile_core import recordings
from tactile_core.accuracy import Row, row
from tactile_core.files import threads
from tactile_core.recordings import write_simulated

ROOT = Path(__file__).resolve().parents[2]
RECORDING = ROOT / "scenes" / "press_roll_slide" / "press_roll_slide.h5"
LONG = 700  # frames of the long recording
HEAVY = (
    "numpy", "scipy", "h5py", "PIL", "matplotlib", "tqdm", "msgspec", "torch", "mitsuba", "drjit", "OpenEXR", "trimesh",
    "rtree", "cholespy", "pypardiso", "skfem", "rosbags", "distributed", "pyarrow", "safetensors",
)  # fmt: skip
CHILD = """
import json, pathlib, re, resource, sys
from tactile_core.cli import main as cli
try:
    status = cli.main(sys.argv[2:])
except SystemExit as end:
    status = end.code
used = resource.getrusage(resource.RUSAGE_SELF)
if sys.platform == "linux":  # where ru_maxrss begins with what the parent had
    peak = int(re.search(r"VmHWM:\\s+(\\d+)", pathlib.Path("/proc/self/status").read_text())[1]) / 1024
else:
    peak = used.ru_maxrss / (1024 * 1024 if sys.platform == "darwin" else 1024)
record = {"status": status, "cpu": used.ru_utime + used.ru_stime, "peak": peak, "modules": sorted(sys.modules)}
open(sys.argv[1], "w").write(json.dumps(record))
"""


class Case(NamedTuple):
    """A command line of ``tactile``, and the exit status it ends with.
    name : begins the names of its rows; loads : libraries of HEAVY that it may load, separated by spaces
    words : in which {} stands for a scratch folder with touch.csv, scene.toml and what earlier cases wrote"""

    name: str
    words: str
    loads: str = ""
    status: int = 0


SOLVING = "numpy h5py msgspec scipy"
# Libdeflate packs PNG without Pillow.
WATCHING = "numpy PIL" if importlib.util.find_spec("deflate") is None else "numpy"
BALL = "--press sphere --diameter 7 --depth-mm 0.3"
CASES = (
    Case("help", "--help"),
    Case("info", "info {}/touch.csv", "numpy"),
    Case("convert", "convert {}/touch.csv --out {}/converted --frames :10", "numpy h5py msgspec PIL matplotlib"),
    Case("watch", "watch {}/touch.csv --out {}/now.png --idle 0.1", WATCHING),
    Case("batch", "batch {}/touch.csv --out {}/job", "numpy h5py msgspec"),
    Case("export", "export {}/job --to npz --out {}/exported", "numpy h5py msgspec"),
    Case("dataset", "dataset", "numpy msgspec"),
    Case("adapt", f"adapt {RECORDING} --out {{}}/sensor.toml", "numpy h5py msgspec"),
    Case("render_fast", "render {}/converted/touch/frames.h5 --out {}/fast --preset fast", "numpy h5py PIL"),
    Case(
        "render_standard", "render {}/converted/touch/frames.h5 --out {}/standard --frames :2",
        "numpy h5py PIL mitsuba drjit",
    ),
    Case("simulate --plan", "simulate {}/scene.toml --out {}/planned.h5 --plan", "numpy msgspec scipy"),
    Case("simulate", "simulate {}/scene.toml --out {}/simulated.h5", SOLVING),
    Case("simulate_gel", "simulate {}/scene.toml --keep displacement_digit --out {}/gel.h5", SOLVING),
    Case("pairs", f"pairs {ROOT / 'scenes' / 'press_sphere'} --count 2 --out {{}}/pairs.h5", SOLVING),
    Case("mesh", "mesh digit --out {}/rest.ply", "numpy"),
    Case("mesh_fast", f"mesh digit {BALL} --out {{}}/fast.ply", "numpy scipy"),
    Case("mesh_full", f"mesh digit {BALL} --tier full --out {{}}/full.ply", "numpy scipy pypardiso"),
    Case("train", "train {}/absent.h5 --out {}/trained", "numpy h5py tqdm torch", status=2),  # what its import costs
    Case("scenes", "scenes copy press --out {}/scenes"),
    Case("doctor", "doctor"),
)  # fmt: skip


class Cost(NamedTuple):
    """Cost of one run. status : exit status; cpu, wall : s; peak : MB of memory; loaded : of HEAVY"""

    status: int
    cpu: float
    wall: float
    peak: float
    loaded: set[str]


def main(arguments: list[str] | None = None) -> int:
    """Measure, print and write the results; returns the exit status."""
    parser = parser_of(__doc__)
    parser.add_argument("--quick", action="store_true", help=f"without the {LONG} frames")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_inputs(folder)
        parts = verbs(folder), [] if options.quick else long_conversion(folder)
        return finished(printed(one for part in parts for one in part), options.json)


def write_inputs(folder: Path) -> None:
    """Write into ``folder`` touch.csv, 100 frames of the shipped recording, and scene.toml, a press of 11 frames."""
    write_scene(folder, (0.0, -8.0, 0.0, 0.0), (0.1, -8.0, 0.0, 0.3))
    electrodes = recordings.read(RECORDING).electrodes[:100]
    names = ["timestamp", "tdc", "tac", "pdc", *(f"pac{i}" for i in range(1, 23)), *(f"ele{i}" for i in range(1, 20))]
    rows = np.full((len(electrodes), len(names)), 2000.0)
    rows[:, 0], rows[:, -19:] = 1.6e9 + np.arange(len(electrodes)) / 100, electrodes
    np.savetxt(folder / "touch.csv", rows, fmt="%.10g", delimiter=",", header=",".join(names), comments="")


def write_scene(folder: Path, *points: tuple[float, float, float, float]) -> None:
    """Write scene.toml of a 7 mm ball into ``folder``; points : of the ball's path, (time s, x mm, z mm, force N)"""
    way = ", ".join("{{time_s = {}, x_mm = {}, z_mm = {}, force_n = {}}}".format(*point) for point in points)
    text = f"""format = "tactile-scene-1"
name = "ball"
description = "A ball."
indenters = [{{kind = "sphere", name = "ball", radius_mm = 3.5}}]
recording = {{indenter = "ball", points = [{way}]}}
"""
    (folder / "scene.toml").write_text(text, encoding="utf-8")


def run(case: Case, folder: Path) -> Cost:
    """Run one case in a process of its own; folder : for scratch files. Raises AssertionError if the process dies."""
    file = folder / "record.json"
    file.unlink(missing_ok=True)
    words = [word.replace("{}", str(folder)) for word in case.words.split()]
    began = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-c", CHILD, str(file), *words], capture_output=True, text=True,
        env={**os.environ, **threads.ONE, "PYTHONPATH": str(ROOT)}, cwd=ROOT, timeout=300,
    )  # fmt: skip
    wall = time.perf_counter() - began
    if not file.exists():
        raise AssertionError(f"{case.name}: {done.stderr[-1000:]}")
    result = json.loads(file.read_text())
    loaded = {name.partition(".")[0] for name in result["modules"]} & set(HEAVY)
    return Cost(result["status"], result["cpu"], wall, result["peak"], loaded)


def verbs(folder: Path) -> list[Row]:
    """Yield rows of CPU time and peak memory of each verb, or of its exit status if that is wrong.
    folder : for scratch files"""
    for case in CASES:
        cost = run(case, folder)
        if cost.status != case.status:
            yield row(f"{case.name}_failed", cost.status, "status", of=case.words)
            continue
        loads = " ".join(sorted(cost.loaded)) or "-"
        of = f"{cost.wall:.2f} s on the wall; loads {loads}"
        # 0.15 s: a target (one does not notice it); Python alone takes 0.02 s of it.
        yield row(f"{case.name}_cpu", cost.cpu, "s", 0.15 if case.name == "help" else None, of=of)
        yield row(f"{case.name}_memory", cost.peak, "MB", of="peak resident")


def write_long(path: Path) -> None:
    """Write a recording of LONG frames to ``path``: the shipped one, again and again."""
    one = recordings.read(RECORDING)
    long = one.at(np.arange(LONG) % len(one))
    counts = {name: getattr(long, name) for name in ("electrodes", "pdc", "tac", "tdc")}
    about = {"scene": "", "seed": 0, "made_by": "profile_verbs", "note": "the shipped recording, repeated"}
    write_simulated(path, time=np.arange(LONG) / 100, **counts, truth=long.truth, **about)


def long_conversion(folder: Path) -> list[Row]:
    """Yield rows of what `convert` of a long recording costs; folder : for scratch files"""
    write_long(folder / "long.h5")
    cost = run(Case("long", "convert {}/long.h5 --out {}/whole"), folder)
    of = f"{LONG} frames, {cost.wall:.1f} s on the wall, load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
    yield row("convert_700_cpu", cost.cpu, "s", 12.0, of=of)
    yield row("convert_700_memory", cost.peak, "MB", of="peak resident")


if __name__ == "__main__":
    sys.exit(main())
