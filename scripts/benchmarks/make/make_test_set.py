"""Make the test set of the translation networks: paired contacts solved by the full tier on both sensors.

    python3 scripts/benchmarks/make/make_test_set.py --work DIR --out FILE [--presses 210] [--seed 1] [--workers 1]

Stop it at any time: presses that are solved stay in DIR and are not solved again. In the end all presses of this seed
in DIR are merged into FILE, which is replaced, with its card beside it; ``--presses 0`` solves none and merges what
there is so far. Press i draws all it needs from (seed, i); presses with an odd number lie in a region that training can
leave out. Rows are like those of ``pair_sampling``, but the full tier needs no correction, and the fluid film over the
electrodes is computed from its own deformed inner skin. About half a minute per press on one core. The set that ships
has the presses 0 to 129; no contact was found for 11 of them.
"""

from __future__ import annotations

import dataclasses
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # `benchmarks` is no package that is installed

from benchmarks.measured_rows import in_processes, parser_of
from tactile_core import sensors
from tactile_core.errors import TactileError
from tactile_core.files import atomic, checksummed
from tactile_core.geometry.indenters import Box, Indenter, Ring
from tactile_core.mechanics.force_search import UnreachableError
from tactile_core.mechanics.penetration import PenetrationError
from tactile_core.mechanics.placement import DEPTH_LIMIT, Placement, depth_at, pose_at, surface_drop
from tactile_core.mechanics.solution import Solution, Step
from tactile_core.mechanics.solve import solve, solve_path
from tactile_core.sensors import SOURCE, TARGET
from tactile_core.simulation import pairs_writer
from tactile_core.simulation.pair_sampling import draw_place, pair_row, paired
from tactile_core.simulation.pairs_writer import Made, card, card_path
from tactile_core.simulation.scene import Scene, load_scene

SCENE = Path(__file__).resolve().parents[3] / "scenes" / "training"
STEP = 1e-6  # m, of the displacements in the file: 0.3 um rms of rounding, a tenth of the least target
REGION_X = -14e-3  # m: the region of the pad toward the tip, x below this, that a network may be kept from seeing
SHARES = 0.25, 0.55, 1.0  # of a press's greatest depth on the BioTac, at which it is sampled
_SHALLOWEST, _DEEPEST = 0.3e-3, 1.5e-3  # m, a press's greatest depth on the BioTac, uniform between (assumed)
_SLIDE_MOST = 1e-3  # m, likewise of slides (assumed)
_SLIDING = 4, 11  # numbers, of twelve presses, that end with a slide: one on the whole gel, one in the region
# Numbers, of eight presses, of the box's and the ring's, one in the region each; other bodies take turns in the rest.
_BOX, _RING, _OTHERS = (0, 5), (2, 7), (1, 3, 4, 6)
_TRIES = 12  # reductions by a fifth to a depth that both sensors bear: to a fourteenth
Job = tuple[Path, int, int]  # folder, seed, number


@dataclasses.dataclass(frozen=True)
class TestPress:
    """Press ``number`` of the test set. which : index of the scene's indenter; depth : m, greatest, on the BioTac
    slide : (2,) m, along and across the finger, from the greatest depth on; None for none"""

    __test__ = False  # not a test, whatever pytest takes its name for

    number: int
    which: int
    indenter: Indenter
    place: Placement
    depth: float
    slide: np.ndarray | None


Pair = tuple[np.ndarray, Solution, Solution]  # slide (2,) m, and both sensors' contacts


def draw_press(scene: Scene, seed: int, number: int) -> TestPress:
    """Draw press ``number`` from ``seed``; one with an odd number has x below ``REGION_X``. Raises TactileError unless
    the scene has a box, a ring and other bodies."""
    random = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number,)))
    which = _turn(scene, number)
    indenter = scene.indenters[which].build()
    while True:
        place = draw_place(random, paired(scene))
        if number % 2 == 0 or place.x < REGION_X:
            break
    drawn = random.uniform(_SHALLOWEST, _DEEPEST)
    heading, length = random.uniform(0, 2 * np.pi), random.uniform(0, _SLIDE_MOST)
    slide = length * np.array([np.cos(heading), np.sin(heading)]) if number % 12 in _SLIDING else None
    thick = depth_at(DEPTH_LIMIT, SOURCE, indenter, pose_at(SOURCE, indenter, place))
    depth = _borne(indenter, place, min(drawn, thick), paired(scene).friction)
    return TestPress(number, which, indenter, place, depth, slide)


def _borne(indenter: Indenter, place: Placement, depth: float, friction: float) -> float:
    """Return ``depth``, m, on the BioTac, reduced by fifths until the fast tier solves a contact of the same force on
    the DIGIT too. friction : Coulomb's coefficient"""
    for _ in range(_TRIES):
        try:
            force = solve(SOURCE, indenter, place, depth=depth, friction=friction).axial_force
            if force > 0:
                solve(TARGET, indenter, place, force=force, friction=friction)
            break
        except (UnreachableError, PenetrationError):
            depth *= 0.8  # where an edge sinks in between nodes the full tier does not follow either
    return depth


def _turn(scene: Scene, number: int) -> int:
    """Return the index of the indenter whose turn it is, so that all come about equally often. Raises TactileError."""
    built = [spec.build() for spec in scene.indenters]
    boxes, rings = ([i for i, one in enumerate(built) if isinstance(one, kind)] for kind in (Box, Ring))
    others = [i for i in range(len(built)) if i not in boxes + rings]
    if scene.pairs is None or len(boxes) != 1 or len(rings) != 1 or not others:
        found = f"{len(boxes)} boxes, {len(rings)} rings, {len(others)} others"
        raise TactileError("test set, scene", found, "[pairs], one box, one ring and other indenters")
    cycle, turn = divmod(number, 8)
    if turn in _BOX:
        return boxes[0]
    return rings[0] if turn in _RING else others[(len(_OTHERS) * cycle + _OTHERS.index(turn)) % len(others)]


def full_rows(scene: Scene, press: TestPress) -> tuple[list[dict[str, np.ndarray]], dict[str, np.ndarray]]:
    """Solve a press; return the arrays of each contact by name, as in a file of pairs, and a record of scalars.

    The record: wanted, number of contacts; lost, text on why the last ones are missing, or empty; seconds of CPU.
    """
    began = time.process_time()
    rows: list[dict[str, np.ndarray]] = []
    steps = [(share * press.depth, np.zeros(2)) for share in SHARES]
    if press.slide is not None:
        steps.append((press.depth, press.slide))
    named: dict[str, np.ndarray] = {
        "press": np.array(press.number, np.int32),
        "indenter": np.array(press.which, np.int16),
        "place": np.array(dataclasses.astuple(press.place), np.float32),
    }
    lost = ""
    try:
        for slide, biotac, digit in _pairs(press, steps, paired(scene).friction):
            rows.append({**named, "slide": slide.astype(np.float32), **pair_row(biotac, digit)})
    except TactileError as error:
        lost = str(error)
    took = np.array(time.process_time() - began)
    return rows, {"wanted": np.array(len(steps), np.int32), "lost": np.array(lost), "seconds": took}


def _pairs(press: TestPress, steps: list[tuple[float, np.ndarray]], friction: float) -> Iterator[Pair]:
    """Yield slide and both sensors' contacts of each step. Raises TactileError at a step that is not found on one.
    steps : pairs of depth m and slide (2,) m; friction : Coulomb's coefficient"""
    on_biotac, trouble = _on_biotac(press, steps, friction)
    if on_biotac:
        slides = [slide for _, slide in steps[: len(on_biotac)]]
        pose = pose_at(TARGET, press.indenter, press.place)
        limit = depth_at(DEPTH_LIMIT, TARGET, press.indenter, pose)
        asked = [Step(force=found.axial_force, slide=tuple(to)) for to, found in zip(slides, on_biotac, strict=True)]
        on_digit = solve_path(TARGET, press.indenter, pose, asked, "full", friction, limit)
        yield from zip(slides, on_biotac, on_digit, strict=True)
    if trouble:
        raise trouble


def _on_biotac(
    press: TestPress, steps: list[tuple[float, np.ndarray]], friction: float
) -> tuple[list[Solution], TactileError | None]:
    """Return the contacts found on the BioTac, and the error that ended them or None. While it slides, the indenter
    keeps its depth under the surface. steps : pairs of depth m and slide (2,) m; friction : Coulomb's coefficient"""
    pose, surface, found = pose_at(SOURCE, press.indenter, press.place), sensors.biotac_surface(), []
    drops = [surface_drop(surface, press.indenter, pose, pose.slid(*slide)) for _, slide in steps]
    asked = [Step(max(depth + drop, 0.0), slide=tuple(to)) for (depth, to), drop in zip(steps, drops, strict=True)]
    try:
        for contact in solve_path(SOURCE, press.indenter, pose, asked, "full", friction):
            if contact.axial_force <= 0:
                raise TactileError("full tier, biotac", "no force", "a contact")
            found.append(contact)
    except TactileError as error:
        return found, error
    return found, None


def file_of(folder: Path, seed: int, number: int) -> Path:
    """Return the path of the file in ``folder`` that holds the contacts of press ``number`` of a seed."""
    return folder / f"press_{seed}_{number:05d}.h5"


def solve_one(job: Job) -> str:
    """Solve one press, unless its file is there; return a line to print. job : folder, seed, number"""
    path = file_of(*job)
    if path.exists():
        return f"{path.name}: was there"
    scene, _ = load_scene(SCENE)
    press = draw_press(scene, *job[1:])
    rows, record = full_rows(scene, press)
    columns = {name: np.stack([row[name] for row in rows]) for name in rows[0]} if rows else {}
    why = np.frombuffer(str(record["lost"]).encode(), np.uint8)
    checksummed.write(path, {**columns, **record, "lost": why, "count": np.int32(len(rows))})
    what = f"{scene.indenters[press.which].name} {press.depth * 1e3:.2f} mm, {len(rows)} of {record['wanted']} contacts"
    return f"{path.name}: {what}, {record['seconds']:.1f} s {record['lost']}"


def merge(folder: Path, seed: int, out: Path) -> dict:
    """Join a seed's solved presses, which lie in a folder, into one file of pairs, ``out``; write its card beside it,
    and return the card."""
    files = sorted(folder.glob(f"press_{seed}_*.h5"))
    counts, wanted, lost = [], 0, {}
    for path in files:
        record = checksummed.read(path, names=("count", "wanted", "lost"))
        counts.append(int(record["count"]))
        wanted += int(record["wanted"])
        if len(record["lost"]):
            lost[path.stem] = record["lost"].tobytes().decode()
    scene, text = load_scene(SCENE)
    with atomic.new_file(out) as partial, tempfile.TemporaryDirectory() as scratch:
        fine = Path(scratch) / "fine.h5"
        pairs_writer.merge(files, sum(counts), fine, Made(text, [spec.name for spec in scene.indenters], seed))
        _coarsen(fine, partial)
    record = {**card(out), "tier": "full", "contacts_wanted": wanted, "presses_solved": len(files), "lost": lost}
    atomic.write_json(card_path(out), record)
    return record


def _coarsen(fine: Path, out: Path) -> None:
    """Write the file ``fine`` to ``out`` in a third of the bytes: displacements in steps of STEP, gzip at its best."""
    import h5py

    with h5py.File(fine) as source, h5py.File(out, "w") as file:
        file.attrs.update(source.attrs)
        file.attrs.update(tier="full", unseen_region_x=REGION_X)
        for name, data in source.items():
            values, attributes = data[()], dict(data.attrs)
            if "scale" in attributes:
                values = np.rint(values * (attributes["scale"] / STEP)).astype(np.int16)
                attributes["scale"] = STEP
            packed = {"chunks": True, "compression": "gzip", "compression_opts": 9, "shuffle": True}
            file.create_dataset(name, data=values, track_times=False, **packed).attrs.update(attributes)


def _numbers(text: str) -> range:
    """Return the range that a text, N or FROM:TO:STEP, names."""
    return range(*map(int, text.split(":")))


def main() -> int:
    """Solve presses by the full tier on both sensors, merge them into the test set; returns the exit status."""
    parser = parser_of(__doc__, json=False)
    parser.add_argument("--work", type=Path, required=True, help="folder for the solved presses")
    parser.add_argument("--out", type=Path, required=True, help="the HDF5 file to write")
    parser.add_argument("--presses", type=_numbers, default=range(210), metavar="N", help="how many presses to solve,"
                        " three or four contacts each, or FROM:TO:STEP, which ones (210)")  # fmt: skip
    parser.add_argument("--seed", type=int, default=1, help="of the presses (1; the training pairs have 0)")
    parser.add_argument("--workers", type=int, default=1, help="processes (1)")
    arguments = parser.parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)
    jobs = [(arguments.work, arguments.seed, number) for number in arguments.presses]
    in_processes(solve_one, jobs, arguments.workers)
    record = merge(arguments.work, arguments.seed, arguments.out)
    contacts = f"{record['contacts']} of {record['contacts_wanted']} contacts"
    print(f"{arguments.out}: {contacts}, {record['presses_solved']} presses")
    for name, why in record["lost"].items():
        print(f"{name}: {why}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
