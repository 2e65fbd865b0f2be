"""Make scripts/benchmarks/translation/gel_force.npy: the force that a DIGIT's gel carries, linear in its displacement.

    python scripts/benchmarks/make/make_gel_force.py pairs.h5      of the file that the shipped weights are trained on

Ridge regression on every seventh training contact of the pairs; its strength is chosen by the validation presses'
median error of the force's size. Errors count against the force and 0.2 N, so that light touches do not rule.
"""

from __future__ import annotations

import io
import sys
from pathlib import Path

import h5py
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # `benchmarks` is no package that is installed

from benchmarks.translation.contact_rows import TABLE
from tactile_core import accuracy
from tactile_core.files import atomic
from tactile_core.simulation.pairs_file import Pairs, read_pairs, split_presses

EVERY = 7  # of the training contacts: 6,000 of 50,000
RIDGES = (1e-3, 1e-2, 1e-1, 1.0)  # of the mean square of a contact's displacements
FLOOR = 0.2  # N


def main(arguments: list[str]) -> int:
    """Fit, choose and write the matrix; returns the exit status."""
    pairs = read_pairs(arguments[0])
    with h5py.File(arguments[0]) as file:
        forces = file["force_digit"][()].astype(float)
    split = split_presses(pairs.press, 0, arguments[0])
    (moved, force), (other, true) = (
        (_moved(pairs, rows), forces[rows]) for rows in (split.train[::EVERY], split.validation)
    )
    weight = 1 / (accuracy.lengths(force) + FLOOR)[:, None]
    seen = moved * weight
    alike = (seen @ seen.T).astype(float)
    fits = {}
    for ridge in RIDGES:
        share = np.linalg.solve(alike + ridge * np.trace(alike) / len(alike) * np.eye(len(alike)), force * weight)
        fits[ridge] = (seen.T @ share.astype(np.float32)).astype(np.float32)
        print(f"ridge {ridge:g}: {100 * _error(other @ fits[ridge], true):.2f} % of the force on validation presses")
    best = min(RIDGES, key=lambda ridge: _error(other @ fits[ridge], true))
    content = io.BytesIO()
    np.save(content, fits[best])
    atomic.write_bytes(TABLE, content.getvalue())
    return 0


def _moved(pairs: Pairs, rows: np.ndarray) -> np.ndarray:
    """Displacements (n, 3 M) m of the gel."""
    moved = pairs.displacement_digit[rows].reshape(len(rows), -1)
    return moved.astype(np.float32) * np.float32(pairs.scale_digit)


def _error(found: np.ndarray, true: np.ndarray) -> float:
    return float(np.median(np.abs(accuracy.lengths(found) / accuracy.lengths(true) - 1)))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
