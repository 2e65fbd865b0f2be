"""Measure the cost of each part of a simulation, a conversion and a rendering, for `--plan`.

    python scripts/benchmarks/measure_costs.py                       writes data/costs.json, about five minutes
    python scripts/benchmarks/measure_costs.py --quick --json FILE   one sensor, and writes FILE alone

Each command runs in a process of its own on few and on many frames; a straight line through both gives the cost at the
start and per frame. Times are CPU time of one thread; memory is peak resident; sizes are those of the files written.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # `benchmarks` is no package that is installed

from benchmarks.measured_rows import parser_of
from benchmarks.profile_verbs import RECORDING, Case, run, write_scene
from tactile_core.files import atomic, provenance
from tactile_core.files.shipped import shipped
from tactile_core.geometry.indenters import Sphere
from tactile_core.mechanics.placement import FRICTION, Placement
from tactile_core.mechanics.solve import Sensor, solve

TABLE = shipped("costs.json")
FEW, MANY = 10, 130  # frames in contact of the two scenes
FRAMES = 20, 300  # of the two conversions
FORCES = 0.3, 0.9  # N, of the full tier's contacts
SETS = {  # what is added -> the outputs asked for, each beside those before it
    "digit": "displacement_digit", "biotac": "displacement_biotac", "electrodes": "electrodes",
    "both": "displacement_biotac,displacement_digit", "all": "electrodes,displacement_biotac,displacement_digit",
}  # fmt: skip


class Part(NamedTuple):
    """Measured cost. start : CPU s before the first frame; ms : CPU ms a frame; mb : MB, peak; kb : kB disk a frame"""

    start: float
    ms: float
    mb: float
    kb: float


def main(arguments: list[str] | None = None) -> int:
    """Measure and write the costs; returns the exit status."""
    parser = parser_of(__doc__)
    parser.add_argument("--quick", action="store_true", help="the DIGIT alone, and leave the table as it is")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        parts = {f"simulate_{each}": simulate(folder, SETS[each]) for each in (["digit"] if options.quick else SETS)}
        if not options.quick:
            parts["simulate_nothing"] = simulate(folder, SETS["digit"], force=0.0)
            parts |= conversions(folder)
    found = {
        "how": "scripts/benchmarks/measure_costs.py: CPU s of one thread, MB resident, kB a frame on disk",
        "machine": provenance.machine(), "versions": provenance.versions(),
        "parts": {name: part._asdict() for name, part in parts.items()},
        "full_ms": {} if options.quick else full_tier(),
    }  # fmt: skip
    if options.json:
        atomic.write_json(options.json, found)
    if not options.quick:
        atomic.write_json(TABLE, found)
    return 0


def ball_way(contacts: int, force: float) -> list[tuple[float, float, float, float]]:
    """Return a ball's path, rows (s, x mm, z mm, N): a frame at 0 N, then ``contacts`` frames at ``force`` N."""
    return [(0.0, -10.0, -2.0, 0.0), (0.01, -10.0, -2.0, force), (contacts / 100, -6.0, 2.0, force)]


def between(folder: Path, name: str, commands: list[str], frames: tuple[int, int]) -> Part:
    """Return a part's cost at its start and per frame, by a straight line through two runs, on few frames and on many.
    commands : one for each, which write to "out" in the scratch ``folder``; name : of the part"""
    costs, sizes, out = [], [], folder / "out"
    for command in commands:
        costs.append(run(Case(name, command), folder))
        sizes.append(sum(file.stat().st_size for file in out.rglob("*") if file.is_file()))
        shutil.rmtree(out)
    few, many = frames
    ms = 1e3 * (costs[1].cpu - costs[0].cpu) / (many - few)
    return Part(max(costs[0].cpu - few * ms / 1e3, 0.0), ms, costs[1].peak, (sizes[1] - sizes[0]) / (many - few) / 1e3)


def simulate(folder: Path, keep: str, force: float = 0.3) -> Part:
    """Measure the cost of `tactile simulate --keep KEEP` under a ball; folder : for scratch files; force : N"""
    commands = []
    for contacts in (FEW, MANY):
        scene = folder / f"scene_{contacts}"
        scene.mkdir(exist_ok=True)
        write_scene(scene, *ball_way(contacts, force))
        commands.append(f"simulate {scene} --keep {keep} --out {folder}/out/touch.h5")
    return between(folder, "simulate", commands, (FEW, MANY))


def conversions(folder: Path) -> dict[str, Part]:
    """Measure `convert --keep` for each kind of output ("convert_latent", ...) and the fast picture ("render_fast"), on
    the numbers of frames `FRAMES`; return name -> cost. folder : for scratch files"""
    keeps = "latent", "displacement", "height", "image"
    words = {f"convert_{keep}": f"convert {RECORDING} --keep {keep}" for keep in keeps}
    words["render_fast"] = f"render {RECORDING} --preset fast"
    ends = [f"--out {folder}/out --frames 40:{40 + frames}" for frames in FRAMES]
    return {name: between(folder, name, [f"{each} {end}" for end in ends], FRAMES) for name, each in words.items()}


def full_tier() -> dict[str, dict[str, float]]:
    """Measure the full tier's CPU ms per contact at a given force: sensor -> "smooth" and, with friction, "rough"."""
    ways = {"smooth": 0.0, "rough": FRICTION}
    sensors: tuple[Sensor, ...] = "biotac", "digit"
    return {sensor: {way: contact_ms(sensor, friction) for way, friction in ways.items()} for sensor in sensors}


def contact_ms(sensor: Sensor, friction: float) -> float:
    """Return the CPU ms per contact that the full tier takes at FORCES, the mean. friction : Coulomb's coefficient"""
    began = time.process_time()
    for force in FORCES:
        solve(sensor, Sphere(3.5e-3), Placement(-8e-3, 0.0, 0.0), force=force, tier="full", friction=friction)
    return 1e3 * (time.process_time() - began) / len(FORCES)


if __name__ == "__main__":
    sys.exit(main())
