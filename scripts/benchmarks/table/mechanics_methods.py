"""Measure each tier of contact mechanics against the reference tier, on random contacts that this solved once."""

from __future__ import annotations

import numpy as np

from benchmarks.mechanics.contact_tiers import fast_misses, miss, read_truth, solved
from tactile_core.accuracy import Row, row
from tactile_core.errors import TactileError
from tactile_core.files import compiled
from tactile_core.mechanics.error_estimate import REFERENCE_SHARE, measured
from tactile_core.simulation.pairs_file import read_pairs
from tactile_core.simulation.scene import load_scene

from .method import TEST_SET, TRAINING, Method, peak_mb

NAMES = tuple(f"{sensor}_{tier}" for sensor in ("digit", "biotac") for tier in ("fast", "full", "reference"))
TRUTH = TRAINING / "reference_contacts.npz"
QUICK = 2  # contacts that the full tier solves in a quick run
EVERY = 7  # one test press in so many, in a quick run
IN_LOOP, IN_LOOP_QUICK = 500, 18  # contacts per sensor, alone and on paths
REPEATS = {"fast": 3, "full": 1}


def measure(name: str, quick: bool) -> Method:
    """Measure one tier on one sensor, named like "digit_fast": median time of random contacts, and their error.
    quick : on fewer contacts"""
    sensor, tier = name.split("_")
    if tier == "reference":
        return _reference(sensor, quick)
    truths, found, ms = read_truth(TRUTH, sensor), [], []
    for truth in truths[: QUICK if quick and tier == "full" else None]:
        tries = [_solved(sensor, truth.contact, tier) for _ in range(REPEATS[tier])]
        if tries[0] is not None:
            found.append((truth, tries[0][0]))
            ms.append(1e3 * min(seconds for _, seconds in tries))
    mb, misses = peak_mb(), []
    for truth, solution in found:
        pair = solution.displacement, float(np.linalg.norm(solution.force)), truth.displacement, truth.force
        misses.append(miss(truth.number, truth.share, *pair))
    shape, force, baseline = (
        np.median([getattr(each, of) for each in misses]) for of in ("shape", "force", "baseline")
    )
    of = f"{len(misses)} random contacts, without friction, against the reference tier"
    more = [row(f"mechanics_{name}_force_error", 100 * force, "percent", baseline=100, of=of)]
    took = float(np.median(ms))
    if tier == "fast":
        more += _on_test_contacts(sensor, quick)
        loop = _in_the_loop(sensor, quick)
        took = next((each["value"] for each in loop if each["name"].endswith("alone_cpu")), took)
        more += loop
    return Method("mechanics", name, took, mb, 1e6 * shape, "um", 1e6 * baseline, of, tuple(more))


def _solved(sensor, contact, tier):  # noqa: ANN001, ANN202 (as `solved`)
    try:
        found, _, seconds = solved(sensor, contact, tier)
    except TactileError:
        return None
    return found, seconds


def _reference(sensor: str, quick: bool) -> Method:
    """Return the reference tier's results from `measure_tiers.py`: a contact takes a minute or more. A whole run
    solves the quickest one again, for its memory."""
    truths = read_truth(TRUTH, sensor)
    if not quick:
        _solved(sensor, min(truths, key=lambda truth: truth.seconds).contact, "reference")
    full = measured()["tiers"]["full"][sensor]["against_reference"]
    ms, error = 1e3 * np.median([truth.seconds for truth in truths]), REFERENCE_SHARE * full["shape_um"]
    of = f"{len(truths)} random contacts, by measure_tiers.py: a third of the full tier's error (assumed)"
    mb = None if quick else peak_mb()
    return Method("mechanics", f"{sensor}_reference", float(ms), mb, error, "um", full["baseline_um"], of)


def _in_the_loop(sensor: str, quick: bool) -> list[Row]:
    """Time random contacts with friction, each alone and as steps of a path; no rows without numba. quick : fewer"""
    from benchmarks import measure_loop

    if not compiled.available():
        return []
    count = IN_LOOP_QUICK if quick else IN_LOOP
    found = list(measure_loop.of_sensor(sensor, count))
    return [each for name, times, error, _ in found for each in measure_loop.as_rows(name, times, error)]


def _on_test_contacts(sensor: str, quick: bool) -> list[Row]:
    """Return rows of the fast tier's errors against the full tier, with friction. quick : on fewer contacts"""
    pairs, (scene, _) = read_pairs(TEST_SET), load_scene(TRAINING)
    if quick:
        pairs = pairs.select_rows(np.flatnonzero(pairs.press % EVERY == 0))
    found = list(fast_misses(sensor, pairs, scene))
    shape, force, baseline = (
        np.median([getattr(each, name) for each in found]) for name in ("shape", "force", "baseline")
    )
    of = f"{len(found)} test contacts with friction, against the full tier"
    name = f"mechanics_{sensor}_fast_from_full"
    return [
        row(f"{name}_error", 1e6 * shape, "um", baseline=1e6 * baseline, of=of),
        row(f"{name}_force_error", 100 * force, "percent", baseline=100, of=of),
    ]
