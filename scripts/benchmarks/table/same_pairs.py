"""Ours and ACROSS's networks, trained on the same pairs: rows that the benchmark quotes, as no weights of it ship."""

from __future__ import annotations

import datetime
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.translation.noise import as_read
from benchmarks.translation.test_set import SEED
from tactile_core.accuracy import Row, row
from tactile_core.files import atomic, provenance
from tactile_core.simulation.pairs_file import read_pairs
from tactile_core.training.error_summary import metric_rows
from tactile_core.training.step_errors import our_bodies, translation_metrics
from tactile_core.translation.networks import load

from .method import TEST_SET
from .translation_methods import SAME_PAIRS

STEPS = "MVB", "MVD", "S2MPN", "M2MPN", "chain"


def train_both(pairs: Path) -> None:
    """Train both on a file of pairs, measure both on the test contacts, write ``across_rows.json``."""
    from tactile_core.training.train import train

    from ..competitors.across_training import measure

    with tempfile.TemporaryDirectory() as folder:
        began = time.process_time()
        card = train(pairs, folder, progress=lambda share, text: print(f"{share:.0%} {text}", file=sys.stderr))
        seconds = time.process_time() - began
        ours = our_rows(Path(folder) / "weights")
    described = f"{card['pairs']['contacts']['train']} contacts, CPU"
    write(pairs, [*ours, row("training_s", seconds, "s", of=described)], measure(pairs, TEST_SET))


def our_rows(weights: Path) -> list[Row]:
    """Errors of a weights folder on the test contacts."""
    pairs = read_pairs(TEST_SET)
    rows, change = np.arange(len(pairs.press)), as_read(pairs.signal, SEED)
    columns = translation_metrics(load(weights), pairs, rows, change, our_bodies())
    found = metric_rows(columns, pairs, rows, "seen indenters", {})
    return [each for each in found if each["name"] in [f"{step}_rms_um" for step in STEPS]]


def write(pairs: Path, ours: list[Row], across: list[Row]) -> None:
    """Write the measurements with how, when and where they were made."""
    count = len(read_pairs(pairs).press)
    how = f"scripts/benchmark.py --across {pairs.name}: both trained on the same pairs, split by press"
    record = {
        "how": how,
        "pairs": count,
        "contacts": len(read_pairs(TEST_SET).press),
        "date": datetime.date.today().isoformat(),
        "machine": provenance.machine(),
    }
    atomic.write_json(SAME_PAIRS, record | {"ours": ours, "across": across})
