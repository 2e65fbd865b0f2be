"""Measure the cost of each verb of ``tactile``, in its own process: time, memory, and the heavy libraries it loads.

    python scripts/benchmarks/profile_verbs.py --json FILE   and 700 frames converted, with the ten hottest functions
    python scripts/benchmarks/profile_verbs.py --quick --json FILE  each verb on as little as it takes, about a minute

CPU time is user and system together, on one thread; a machine's load changes it less than wall time. The cases and
what each may load are in ``CASES``; tests/scripts/test_profile_verbs.py runs them too.
"""

from __future__ import annotations

import dataclasses
import importlib.util
import io
import json
import os
import re
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
from tactile_core.files import png_writer
from tactile_core.jobs import live
from tactile_core.jobs.convert import load_tools
from tactile_core.recordings import Truth, write_simulated
from tactile_core.sensors import SAMPLE_RATE

ROOT = Path(__file__).resolve().parents[2]
RECORDING = ROOT / "scenes" / "press_roll_slide" / "press_roll_slide.h5"
ONE_CORE = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
LONG, HOT = 700, 10  # frames of the long recording, functions that are named
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
HOTTEST = """
import cProfile, json, pstats, sys
from tactile_core.cli import main as cli
profile = cProfile.Profile()
profile.runcall(cli.main, sys.argv[2:])
stats = pstats.Stats(profile).stats
found = [[name, at, line, time] for (at, line, name), (_, _, time, _, _) in stats.items()]
open(sys.argv[1], "w").write(json.dumps(sorted(found, key=lambda one: -one[3])))
"""


class Case(NamedTuple):
    """A command line, which libraries of HEAVY it may load, and the exit status it ends with.

    In the words, {} stands for a scratch folder; it holds what cases before have written, touch.csv and scene.toml.
    """

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
    Case("adapt", f"adapt {RECORDING} --out {{}}/sensor.toml", "numpy h5py msgspec"),
    Case("render_fast", "render {}/converted/touch/frames.h5 --out {}/fast --preset fast", "numpy h5py PIL"),
    Case(
        "render_standard", "render {}/converted/touch/frames.h5 --out {}/standard --frames :2",
        "numpy h5py PIL mitsuba drjit",
    ),
    Case("simulate --plan", "simulate {}/scene.toml --out {}/planned.h5 --plan", "numpy msgspec scipy"),
    Case("simulate", "simulate {}/scene.toml --out {}/simulated.h5", f"{SOLVING} cholespy"),
    Case("simulate_gel", "simulate {}/scene.toml --keep displacement_digit --out {}/gel.h5", SOLVING),
    Case("pairs", f"pairs {ROOT / 'scenes' / 'press_sphere'} --count 2 --out {{}}/pairs.h5", f"{SOLVING} cholespy"),
    Case("mesh", "mesh digit --out {}/rest.ply", "numpy"),
    Case("mesh_fast", f"mesh digit {BALL} --out {{}}/fast.ply", "numpy scipy"),
    Case("mesh_full", f"mesh digit {BALL} --tier full --out {{}}/full.ply", "numpy scipy pypardiso"),
    Case("train", "train {}/absent.h5 --out {}/trained", "numpy h5py tqdm torch", status=2),  # what its import costs
    Case("scenes", "scenes copy press --out {}/scenes"),
    Case("doctor", "doctor"),
)  # fmt: skip


class Cost(NamedTuple):
    """Cost of one run. cpu, wall, imports : s; peak : MB; loaded : libraries of HEAVY."""

    status: int
    cpu: float
    wall: float
    imports: float
    peak: float
    loaded: set[str]


def main(arguments: list[str] | None = None) -> int:
    """Measure, print and write the results."""
    parser = parser_of(__doc__)
    parser.add_argument("--quick", action="store_true", help=f"without the {LONG} frames")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_inputs(folder)
        parts = verbs(folder), packings(), live_picture(), [] if options.quick else long_conversion(folder)
        return finished(printed(one for part in parts for one in part), options.json)


def write_inputs(folder: Path) -> None:
    """Write touch.csv, the first 100 frames of the shipped recording; scene.toml, one press of 11 frames."""
    write_scene(folder, (0.0, -8.0, 0.0, 0.0), (0.1, -8.0, 0.0, 0.3))
    electrodes = recordings.read(RECORDING).electrodes[:100]
    names = ["timestamp", "tdc", "tac", "pdc", *(f"pac{i}" for i in range(1, 23)), *(f"ele{i}" for i in range(1, 20))]
    rows = np.full((len(electrodes), len(names)), 2000.0)
    rows[:, 0], rows[:, -19:] = 1.6e9 + np.arange(len(electrodes)) / 100, electrodes
    np.savetxt(folder / "touch.csv", rows, fmt="%.10g", delimiter=",", header=",".join(names), comments="")


def write_scene(folder: Path, *points: tuple[float, float, float, float]) -> None:
    """Write scene.toml of a 7 mm ball; points : its way, (time s, x mm, z mm, force N)."""
    lines = ["    {{ time_s = {}, x_mm = {}, z_mm = {}, force_n = {} }},\n".format(*point) for point in points]
    (folder / "scene.toml").write_text(
        f"""format = "tactile-scene-1"
name = "ball"
description = "A ball."
[[indenters]]
kind = "sphere"
name = "ball"
radius_mm = 3.5
[recording]
indenter = "ball"
points = [
{"".join(lines)}]
""",
        encoding="utf-8",
    )


def run(case: Case, folder: Path) -> Cost:
    """Run one case in a fresh process."""
    file = folder / "record.json"
    file.unlink(missing_ok=True)
    words = [word.replace("{}", str(folder)) for word in case.words.split()]
    began = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-X", "importtime", "-c", CHILD, str(file), *words], capture_output=True, text=True,
        env={**os.environ, **ONE_CORE, "PYTHONPATH": str(ROOT)}, cwd=ROOT, timeout=300,
    )  # fmt: skip
    wall = time.perf_counter() - began
    if not file.exists():
        raise AssertionError(f"{case.name}: {done.stderr[-1000:]}")
    result = json.loads(file.read_text())
    imports = sum(int(own) for own in re.findall(r"^import time: +(\d+) \|", done.stderr, re.MULTILINE)) / 1e6
    loaded = {name.partition(".")[0] for name in result["modules"]} & set(HEAVY)
    return Cost(result["status"], result["cpu"], wall, imports, result["peak"], loaded)


def verbs(folder: Path) -> list[Row]:
    """CPU time and peak memory of each verb."""
    for case in CASES:
        cost = run(case, folder)
        if cost.status != case.status:
            yield row(f"{case.name}_failed", cost.status, "status", of=case.words)
            continue
        loads = " ".join(sorted(cost.loaded)) or "-"
        of = f"{cost.wall:.2f} s on the wall, imports {cost.imports:.2f} s; loads {loads}"
        # 0.15 s: a target (one does not notice it); Python alone takes 0.02 s of it.
        yield row(f"{case.name}_cpu", cost.cpu, "s", 0.15 if case.name == "help" else None, of=of)
        yield row(f"{case.name}_memory", cost.peak, "MB", of="peak resident")


def packings() -> list[Row]:
    """Measure the cost of a picture of the demo as PNG, by zlib's level, and with the toolkit's settings."""
    from PIL import Image

    from tactile_core.pictures import shading
    from tactile_core.pictures.height_map import height_map

    truth = recordings.read(RECORDING).truth.displacement_digit[60:340:20]
    shader = shading.Shader()
    pictures = [shader(heights) for heights in height_map(truth)]
    ways = {f"level_{level}": {"compress_level": level} for level in (1, 3, 4, 6)}
    ways |= {"huffman": png_writer.PACKING, "toolkit": None}
    for name, packing in ways.items():
        began, size = time.process_time(), 0
        for picture in pictures:
            out = io.BytesIO()
            if packing is None:
                png_writer.write_png(out, picture)
            else:
                Image.fromarray(picture).save(out, "PNG", **packing)
            size += len(out.getvalue())
        each = 1e3 * (time.process_time() - began) / len(pictures)
        yield row(f"png_{name}", each, "ms", of=f"{size / len(pictures) / 1e3:.1f} kB a picture")


def live_picture() -> list[Row]:
    """Measure the thread time of `tactile watch` from a frame's rows to its picture."""
    recording, view, work = recordings.read(RECORDING), live.View(load_tools(), SAMPLE_RATE), []
    for start, stop in [(0, 60), *((i, i + 1) for i in range(60, 160))]:
        rows = dataclasses.replace(
            recording, electrodes=recording.electrodes[start:stop], pdc=recording.pdc[start:stop]
        )
        shown = view.show(rows, time.perf_counter())
        work += [] if shown is None else [shown.work]
    yield row("watch_picture", 1e3 * float(np.median(work)), "ms", 20.0, of=f"{len(work)} pictures, median, one core")


def write_long(path: Path) -> None:
    """The shipped recording, again and again, LONG frames in all."""
    one = recordings.read(RECORDING)
    rows = np.arange(LONG) % len(one)
    held = {name: getattr(one.truth, name) for name in Truth.__dataclass_fields__}
    truth = Truth(**{name: values[rows] for name, values in held.items() if isinstance(values, np.ndarray)})
    counts = {name: getattr(one, name)[rows] for name in ("electrodes", "pdc", "tac", "tdc")}
    about = {"scene": "", "seed": 0, "made_by": "profile_verbs", "note": "the shipped recording, repeated"}
    write_simulated(path, time=np.arange(LONG) / 100, **counts, truth=truth, **about)


def long_conversion(folder: Path) -> list[Row]:
    """Profile `convert` of a long recording with its default outputs: where its time goes, its hottest functions."""
    write_long(folder / "long.h5")
    cost = run(Case("long", "convert {}/long.h5 --out {}/whole"), folder)
    of = f"{LONG} frames, {cost.wall:.1f} s on the wall, load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
    yield row("convert_700_cpu", cost.cpu, "s", 12.0, of=of)
    yield row("convert_700_memory", cost.peak, "MB", of="peak resident")
    timings = json.loads((folder / "whole" / "long" / "timings.json").read_text(encoding="utf-8"))
    for stage, each in timings["ms_a_frame"].items():
        yield row(f"convert_700_{stage}", each, "ms", of="a frame, on the wall")
    file = folder / "hot.json"
    words = ["convert", str(folder / "long.h5"), "--out", str(folder / "again")]
    environment = {**os.environ, **ONE_CORE, "PYTHONPATH": str(ROOT)}
    subprocess.run([sys.executable, "-c", HOTTEST, file, *words], env=environment, check=True, capture_output=True)
    for place, (name, at, number, seconds) in enumerate(json.loads(file.read_text())[:HOT], 1):
        where = f" {Path(at).name}:{number}" if number else ""
        yield row(f"hot_{place}", seconds, "s", of=f"{name.strip('<>{}')}{where}")


if __name__ == "__main__":
    sys.exit(main())
