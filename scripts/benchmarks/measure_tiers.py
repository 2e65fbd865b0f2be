"""Measure each tier of contact mechanics: its error, by depth, beside its time.

    python scripts/benchmarks/measure_tiers.py --work DIR            writes data/mechanics_tiers.json, and the
                                                                   reference tier's contacts
    python scripts/benchmarks/measure_tiers.py --quick --json FILE   a few contacts, no reference tier

The fast tier is compared with the full tier on the test contacts that ship, with friction, and on random contacts
without. The full tier is compared with the reference tier on the first of these random contacts, and on the presses of
a 7 mm ball at one place that scripts/validate_mechanics.py left in docs/mechanics.csv. The reference tier's own error
is taken as a third of the full tier's (assumed: halving cells of order 2 leaves a quarter; the rest is a margin). Times
are CPU time on one core of a contact from rest, its mesh included, without friction: the median.
Stop it at any time: what the finite-strain tiers solved stays in DIR and is not solved again. Needs the extra [fem].
"""

from __future__ import annotations

import re
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # `benchmarks` is no package that is installed

from benchmarks.measured_rows import parser_of, read_table
from benchmarks.mechanics import tiers
from benchmarks.mechanics.contact_tiers import SENSORS, Miss, by_depth, fast_misses, miss, solved, write_truth
from benchmarks.mechanics.random_contacts import RandomContact, random_contacts
from tactile_core.errors import TactileError
from tactile_core.files import atomic, provenance
from tactile_core.mechanics.error_estimate import REFERENCE_SHARE, TABLE
from tactile_core.mechanics.placement import DEPTH_LIMIT
from tactile_core.mechanics.solve import Sensor, Tier
from tactile_core.simulation.pairs_file import read_pairs
from tactile_core.simulation.scene import load_scene

ROOT = Path(__file__).resolve().parents[2]
TRAINING, REPORT = ROOT / "scenes" / "training", ROOT / "docs" / "mechanics.csv"
SEED = 20261122  # of the random contacts: the correction has learned from those of seed 0
# Random contacts: one of each indenter, five on the BioTac, whose full tier finds deep edges sooner; the first three.
FULL, REFERENCE = {"digit": 9, "biotac": 45}, 3
QUICK = 3
FAST_EDGES, FULL_EDGES = (0.05, 0.1, 0.2, 0.3, 0.4, 0.6), (0.2, 0.6)  # of the bins of depth over thickness
SAYS = {
    "fast": "linear with a learned correction; its error against the full tier",
    "full": "finite strain on a mesh graded round the contact; its error against the reference tier, without friction",
    "reference": "finite strain on cells half as large; its error a third of the full tier's (assumed)",
}


def main(arguments: list[str] | None = None) -> int:
    """Solve contacts by each tier, compare them, write the table of errors and times; returns the exit status."""
    parser = parser_of(__doc__)
    parser.add_argument("--work", type=Path, metavar="DIR", help="where contacts that were solved are kept")
    parser.add_argument("--quick", action="store_true", help=f"{QUICK} random contacts, few test contacts")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as scratch:
        work = options.work or Path(scratch)
        work.mkdir(parents=True, exist_ok=True)
        found, truth = table(work, options.quick)
    if options.json:
        atomic.write_json(options.json, found)
    if not options.quick:
        atomic.write_json(TABLE, found)
        write_truth(TRAINING / "reference_contacts.npz", truth, SEED)
    return 0


def table(work: Path, quick: bool) -> tuple[dict, dict[Sensor, list]]:
    """Return the data file's content, for each tier and sensor ms and errors in bins of depth, and sensor -> the
    reference tier's contacts by ``keep``. work : folder of solved contacts; quick : few contacts, no reference tier"""
    found, truth = {tier: {"says": says} for tier, says in SAYS.items()}, {}
    for sensor in SENSORS:
        entries, truth[sensor] = measure(sensor, work, quick)
        for tier, entry in entries.items():
            found[tier][sensor] = entry
    how = "scripts/benchmarks/measure_tiers.py: errors at one depth, rms um over nodes that move more than 10 um "
    how += "and relative"
    return {"how": f"{how}; CPU ms a contact, one core", "machine": provenance.machine(), "tiers": found}, truth


def measure(sensor: Sensor, work: Path, quick: bool) -> tuple[dict[Tier, dict], list[dict]]:
    """Measure every tier of one sensor: return tier -> its entry of ``table``, and the reference tier's contacts."""
    full = FULL[sensor]
    contacts = list(random_contacts(QUICK if quick else full, SEED))
    kept = {tier: [keep(work, sensor, tier, i, contact) for i, contact in enumerate(contacts[:count])]
            for tier, count in (("fast", full), ("full", full), ("reference", 0 if quick else REFERENCE))}  # fmt: skip
    pairs, (scene, _) = read_pairs(TRAINING / "test_contacts.h5"), load_scene(TRAINING)
    if quick:
        pairs = pairs.select_rows(np.flatnonzero(pairs.press < 2 * QUICK))
    fast = [*fast_misses(sensor, pairs, scene), *misses(kept["fast"], kept["full"])]
    finer = by_depth([*misses(kept["full"], kept["reference"]), *validated(sensor)], FULL_EDGES)
    bins = {"fast": by_depth(fast, FAST_EDGES), "full": finer, "reference": [share_of(each) for each in finer]}
    found = {tier: {"ms": middle(kept[tier]), "bins": bins[tier]} for tier in bins}
    for tier in ("fast", "full"):
        all_depths = by_depth(misses(kept[tier], kept["reference"]), (DEPTH_LIMIT,))
        found[tier]["against_reference"] = all_depths[0] if all_depths else None
    return found, [one for one in kept["reference"] if one]


def keep(work: Path, sensor: Sensor, tier: Tier, number: int, contact: RandomContact) -> dict[str, np.ndarray]:
    """Return a random contact in one tier, read from its file, or else solved and written there; {} if there is none.
    Arrays by name: number, share (depth over thickness), displacement (n, 3) m, force N (its size), seconds of CPU."""
    path = work / f"{sensor}_{tier}_{SEED}_{number:03d}.npz"
    if tier == "fast" or not path.exists():
        try:
            found, share, seconds = solved(sensor, contact, tier)
        except TactileError as error:
            print(f"{path.stem}, {contact.name}: {error}", file=sys.stderr)
            return {}
        sentence = f"{path.stem}, {contact.name}, {share:.2f} of the thickness: {seconds:.3g} s"
        print(sentence, file=sys.stderr, flush=True)
        force = np.linalg.norm(found.force)
        with atomic.new_file(path) as partial, open(partial, "wb") as file:
            np.savez(file, displacement=found.displacement, force=force, share=share, seconds=seconds, number=number)
    with np.load(path, allow_pickle=False) as file:
        return dict(file)


def misses(found: list[dict], true: list[dict]) -> Iterator[Miss]:
    """Yield the errors of one tier's contacts ``found`` against a finer tier's, ``true``, if both tiers found them.
    Both lists hold what ``keep`` returns, in the same order."""
    for one, other in zip(found, true, strict=False):
        if one and other:
            pair = one["displacement"], float(one["force"]), other["displacement"], float(other["force"])
            yield miss(-1 - int(one["number"]), float(one["share"]), *pair)


def validated(sensor: Sensor) -> Iterator[Miss]:
    """Yield the errors of the full tier's presses in the validation's report, docs/mechanics.csv."""
    rows = {row["name"]: row for row in read_table(REPORT)}
    for name, row in rows.items():
        depth = re.fullmatch(rf"{sensor}_full_([\d.]+)mm(\S*)_shape_rms", name)
        if depth:
            force = float(rows[name.replace("_shape_rms", "_force_error")]["value"]) / 100
            share = 1e-3 * float(depth[1]) / tiers.thickness_of(sensor)
            yield Miss(-100, share, 1e-6 * float(row["value"]), abs(force), 1e-6 * float(row["baseline"]))


def share_of(full: dict) -> dict:
    """Return a bin of the reference tier's errors: the full tier's errors, ``full``, times REFERENCE_SHARE."""
    errors = ("shape_um", "shape_95_um", "force", "force_95")
    return full | {name: float(f"{REFERENCE_SHARE * full[name]:.4g}") for name in errors} | {"assumed": True}


def middle(kept: list[dict]) -> float | None:
    """Return the median CPU ms of the contacts ``kept``, which ``keep`` returned; None if none was solved."""
    return float(f"{1e3 * np.median([one['seconds'] for one in kept if one]):.4g}") if any(kept) else None


if __name__ == "__main__":
    sys.exit(main())
