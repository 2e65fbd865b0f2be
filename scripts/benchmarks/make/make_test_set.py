"""Make the test set of the translation networks: paired contacts solved by the full tier on both sensors.

    python3 scripts/benchmarks/make/make_test_set.py --work DIR --out FILE [--presses 210] [--seed 1] [--workers 1]

Stop it at any time: presses that are solved stay in DIR and are not solved again. In the end all presses of this seed
in DIR are merged into FILE, which is replaced, with its card beside it; ``--presses 0`` solves none and merges what
there is so far. Presses with an odd number lie in a region that training can leave out. About half a minute per press
on one core. The set that ships has the presses 0 to 129; no contact was found for 11 of them.
"""

from __future__ import annotations

import argparse
import pathlib
import sys
import tempfile

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT), str(ROOT / "scripts")]
SCENE = ROOT / "scenes" / "training"

from benchmarks.make import full_pairs  # noqa: E402
from benchmarks.measured_rows import in_processes  # noqa: E402
from tactile_core.files import atomic, checksummed  # noqa: E402
from tactile_core.simulation import pairs_writer  # noqa: E402
from tactile_core.simulation.pairs_writer import Made, card, card_path  # noqa: E402
from tactile_core.simulation.scene import load_scene  # noqa: E402

STEP = 1e-6  # m, of the displacements in the file: 0.3 um rms of rounding, a tenth of the least target
Job = tuple[pathlib.Path, int, int]  # folder, seed, number


def file_of(folder: pathlib.Path, seed: int, number: int) -> pathlib.Path:
    """Return the path of the file in ``folder`` that holds the contacts of press ``number`` of a seed."""
    return folder / f"press_{seed}_{number:05d}.h5"


def solve_one(job: Job) -> str:
    """Solve one press, unless its file is there; return a line to print. job : folder, seed, number"""
    path = file_of(*job)
    if path.exists():
        return f"{path.name}: was there"
    scene, _ = load_scene(SCENE)
    press = full_pairs.draw_press(scene, *job[1:])
    rows, record = full_pairs.full_rows(scene, press)
    columns = {name: np.stack([row[name] for row in rows]) for name in rows[0]} if rows else {}
    why = np.frombuffer(str(record["lost"]).encode(), np.uint8)
    checksummed.write(path, {**columns, **record, "lost": why, "count": np.int32(len(rows))})
    what = f"{scene.indenters[press.which].name} {press.depth * 1e3:.2f} mm, {len(rows)} of {record['wanted']} contacts"
    return f"{path.name}: {what}, {record['seconds']:.1f} s {record['lost']}"


def merge(folder: pathlib.Path, seed: int, out: pathlib.Path) -> dict:
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
        fine = pathlib.Path(scratch) / "fine.h5"
        pairs_writer.merge(files, sum(counts), fine, Made(text, [spec.name for spec in scene.indenters], seed))
        _coarsen(fine, partial)
    record = {**card(out), "tier": "full", "contacts_wanted": wanted, "presses_solved": len(files), "lost": lost}
    atomic.write_json(card_path(out), record)
    return record


def _coarsen(fine: pathlib.Path, out: pathlib.Path) -> None:
    """Write the file ``fine`` to ``out`` in a third of the bytes: displacements in steps of STEP, gzip at its best."""
    import h5py

    with h5py.File(fine) as source, h5py.File(out, "w") as file:
        file.attrs.update(source.attrs)
        file.attrs.update(tier="full", unseen_region_x=full_pairs.REGION_X)
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
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=pathlib.Path, required=True, help="folder for the solved presses")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="the HDF5 file to write")
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
