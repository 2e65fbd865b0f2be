"""Measure each tier of contact mechanics against the reference tier, on random contacts that this solved once."""

from __future__ import annotations

import numpy as np

from benchmarks.mechanics.contact_tiers import miss, read_truth, solved
from tactile_core.errors import TactileError
from tactile_core.files import compiled
from tactile_core.mechanics.error_estimate import REFERENCE_SHARE, measured

from .method import TRAINING, Method, peak_mb

NAMES = tuple(f"{sensor}_{tier}" for sensor in ("digit", "biotac") for tier in ("fast", "full", "reference"))
TRUTH = TRAINING / "reference_contacts.npz"
QUICK = 2  # contacts that the full tier solves in a quick run
IN_LOOP, IN_LOOP_QUICK = 500, 18  # contacts whose time is taken in the fast tier


def measure(name: str, quick: bool) -> Method:
    """Measure one tier on one sensor, named like "digit_fast": median time of random contacts, and their error.
    quick : on fewer contacts"""
    sensor, tier = name.split("_")
    if tier == "reference":
        return _reference(sensor, quick)
    ms, misses = [], []
    for truth in read_truth(TRUTH, sensor)[: QUICK if quick and tier == "full" else None]:
        try:
            found, _, seconds = solved(sensor, truth.contact, tier)
        except TactileError:
            continue
        ms.append(1e3 * seconds)
        pair = found.displacement, float(np.linalg.norm(found.force)), truth.displacement, truth.force
        misses.append(miss(truth.number, truth.share, *pair))
    mb, took = peak_mb(), float(np.median(ms))
    shape, baseline = (1e6 * np.median([getattr(each, name) for each in misses]) for name in ("shape", "baseline"))
    if tier == "fast" and compiled.available():
        took = _alone_ms(sensor, quick)
    of = f"{len(misses)} random contacts, without friction, against the reference tier"
    return Method("mechanics", name, took, mb, shape, "um", baseline, of)


def _reference(sensor: str, quick: bool) -> Method:
    """Return the reference tier's results from `measure_tiers.py`: a contact takes a minute or more. A whole run
    solves the quickest one again, for its memory."""
    truths = read_truth(TRUTH, sensor)
    if not quick:
        solved(sensor, min(truths, key=lambda truth: truth.seconds).contact, "reference")
    full = measured()["tiers"]["full"][sensor]["against_reference"]
    ms, error = 1e3 * np.median([truth.seconds for truth in truths]), REFERENCE_SHARE * full["shape_um"]
    of = f"{len(truths)} random contacts, by measure_tiers.py: a third of the full tier's error (assumed)"
    mb = None if quick else peak_mb()
    return Method("mechanics", f"{sensor}_reference", float(ms), mb, error, "um", full["baseline_um"], of)


def _alone_ms(sensor: str, quick: bool) -> float:
    """Return the fast tier's median CPU ms per random contact with friction, solved alone. quick : on fewer"""
    from benchmarks import measure_loop

    times, _ = measure_loop.measure(sensor, 1, IN_LOOP_QUICK if quick else IN_LOOP)
    return measure_loop.quantiles(times)[0]
