"""Measure translation from signals to the displacements of both sensors, by our networks in numpy."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from benchmarks.translation.test_set import SEED, as_read
from tactile_core import accuracy
from tactile_core.accuracy import Row, row
from tactile_core.jobs import solved_gel
from tactile_core.simulation.pairs_file import Pairs, read_pairs
from tactile_core.training.step_errors import joined, mesh_columns, metric_rows, parts, true_displacement
from tactile_core.translation.translate import load_translator

from .method import TEST_SET, Method, best_ms, peak_mb

BATCHES = 1, 500  # frames per call
NAMES = (*(f"{kind}_{batch}" for kind in ("numpy", "numpy_confidence") for batch in BATCHES), "numpy_solved_100")
EVERY = 3  # one test press in so many, in a quick run; prime to how box, ring and others take turns
Change = np.ndarray  # (B, 19) counts
Surfaces = Callable[[Change], tuple[np.ndarray, np.ndarray]]


def measure(name: str, quick: bool) -> Method:
    """Measure a translation named like "numpy_solved_1": a key of KINDS, and the frames per call. quick : on fewer"""
    kind, batch = name.rsplit("_", 1)
    pairs = read_pairs(TEST_SET)
    if quick:
        pairs = pairs.select_rows(np.flatnonzero(pairs.press % EVERY == 0))
    change = as_read(pairs.signal, SEED)
    work = KINDS[kind]()
    some = np.resize(change, (int(batch), change.shape[1]))
    ms, mb = best_ms(lambda: work(some), int(batch), most=200), peak_mb()
    found = {each["name"]: each for each in _errors(work, pairs, change)}
    of = f"{len(pairs.press)} test contacts, signal to DIGIT"
    chain, skin = found["chain_rms_um"], found["S2MPN_rms_um"]
    more = row(
        f"translation_{name}_biotac_error",
        skin["value"],
        "um",
        baseline=skin["baseline"],
        of=of.replace("DIGIT", "BioTac"),
    )
    return Method("translation", name, ms, mb, chain["value"], "um", chain["baseline"], of, (more,))


def _numpy() -> Surfaces:
    nets = load_translator().nets

    def surfaces(change: Change) -> tuple[np.ndarray, np.ndarray]:
        biotac, digit = nets.likely_latents(nets.encode_signal(change))
        return nets.decode_source(biotac), nets.decode_target(digit)

    return surfaces


def _numpy_solved() -> Surfaces:
    """Return a function that translates and then solves the found contact on the DIGIT, as ``convert --gel solved``."""
    translator = load_translator()

    def surfaces(change: Change) -> tuple[np.ndarray, np.ndarray]:
        found = translator(plain_signals(change))
        arrays = {name: getattr(found, name) for name in ("displacement_digit", "contact_center", "force", "flags")}
        return found.displacement_biotac, solved_gel.solved(arrays)["displacement_digit"]

    return surfaces


def _numpy_confidence() -> Surfaces:
    """Return a function that translates with all that `tactile convert` computes: force, errors, confidence, flags."""
    translator = load_translator()

    def surfaces(change: Change) -> tuple[np.ndarray, np.ndarray]:
        found = translator(plain_signals(change))
        return found.displacement_biotac, found.displacement_digit

    return surfaces


def plain_signals(change: Change) -> Any:
    """Return signals with the changes (T, 19) counts, as of a tared recording without flags or warnings."""
    from tactile_core.recordings import Signals

    count = len(change)
    return Signals(
        change=change, rest=np.zeros(19), drift=np.zeros(19), electrodes=change, kind="tared",
        quiet=np.zeros(count, bool), flags=np.zeros(count, np.uint16), pdc=np.full(count, np.nan), warnings=(),
        report={},
    )  # fmt: skip


KINDS = {"numpy": _numpy, "numpy_confidence": _numpy_confidence, "numpy_solved": _numpy_solved}


def _errors(work: Surfaces, pairs: Pairs, change: Change) -> list[Row]:
    rows = np.arange(len(pairs.press))
    columns = joined(map(partial(_columns, work, pairs, change), parts(len(rows))))
    return metric_rows(columns, pairs, rows, "seen indenters", {})


def _columns(work: Surfaces, pairs: Pairs, change: Change, part: slice) -> dict[str, np.ndarray]:
    rows = np.arange(len(pairs.press))[part]
    skin, gel = (true_displacement(pairs, sensor, rows) for sensor in ("biotac", "digit"))
    on_skin, on_gel = work(change[part])
    return {
        **mesh_columns("baseline_biotac", 0 * skin, skin, accuracy.lengths),
        **mesh_columns("baseline_digit", 0 * gel, gel),
        **mesh_columns("S2MPN", on_skin, skin, accuracy.lengths), **mesh_columns("chain", on_gel, gel),
    }  # fmt: skip
