"""Measure translation from signals to the displacements of both sensors, by our networks in numpy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.translation.test_set import SEED, as_read
from tactile_core.jobs import solved_gel
from tactile_core.training.step_errors import mesh_columns, metric_rows, true_displacement
from tactile_core.translation.translate import load_translator

from .method import Method, best_ms, peak_mb, test_contacts

BATCHES = 1, 500  # frames per call
NAMES = (*(f"{kind}_{batch}" for kind in ("numpy", "numpy_confidence") for batch in BATCHES), "numpy_solved_100")
Gels = Callable[[np.ndarray], np.ndarray]  # change (B, 19) counts -> displacement of the gel (B, M, 3) m


def measure(name: str, quick: bool) -> Method:
    """Measure a translation named like "numpy_solved_1": a key of KINDS, and the frames per call. quick : on fewer"""
    kind, batch = name.rsplit("_", 1)
    pairs = test_contacts(quick)
    change = as_read(pairs.signal, SEED)
    work = KINDS[kind]()
    some = np.resize(change, (int(batch), change.shape[1]))
    ms, mb = best_ms(lambda: work(some), int(batch), most=200), peak_mb()
    gel = true_displacement(pairs, "digit", slice(None))
    columns = mesh_columns("baseline_digit", 0 * gel, gel) | mesh_columns("chain", work(change), gel)
    rows = metric_rows(columns, pairs, np.arange(len(gel)), "seen indenters", {})
    chain = next(each for each in rows if each["name"] == "chain_rms_um")
    of = f"{len(gel)} test contacts, signal to DIGIT"
    return Method("translation", name, ms, mb, chain["value"], "um", chain["baseline"], of)


def _numpy() -> Gels:
    """Return a function that translates by the networks alone, to both surfaces."""
    nets = load_translator().nets

    def gels(change: np.ndarray) -> np.ndarray:
        biotac, digit = nets.likely_latents(nets.encode_signal(change))
        nets.decode_source(biotac)
        return nets.decode_target(digit)

    return gels


def _numpy_solved() -> Gels:
    """Return a function that translates and then solves the found contact on the DIGIT, as ``convert --gel solved``."""
    translator = load_translator()
    names = "displacement_digit", "contact_center", "force", "flags"

    def gels(change: np.ndarray) -> np.ndarray:
        found = translator(plain_signals(change))
        return solved_gel.solved({name: getattr(found, name) for name in names})["displacement_digit"]

    return gels


def _numpy_confidence() -> Gels:
    """Return a function that translates with all that `tactile convert` computes: force, errors, confidence, flags."""
    translator = load_translator()
    return lambda change: translator(plain_signals(change)).displacement_digit


def plain_signals(change: np.ndarray) -> Any:
    """Return signals of ``change`` (T, 19) counts, as of a tared recording without flags or warnings."""
    from tactile_core.recordings import Signals

    count = len(change)
    return Signals(
        change=change, rest=np.zeros(19), drift=np.zeros(19), electrodes=change, kind="tared",
        quiet=np.zeros(count, bool), flags=np.zeros(count, np.uint16), pdc=np.full(count, np.nan), warnings=(),
        report={},
    )  # fmt: skip


KINDS = {"numpy": _numpy, "numpy_confidence": _numpy_confidence, "numpy_solved": _numpy_solved}
