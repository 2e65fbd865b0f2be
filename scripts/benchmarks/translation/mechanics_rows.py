"""From the BioTac's mesh to the DIGIT's by mechanics alone, beside M2MPN: also where networks never were trained.

No number of it is learned, so the region that `evaluate_translation.py --kept-apart` keeps from networks is like any
other.
"""

from __future__ import annotations

import contextlib

import numpy as np

from tactile_core.accuracy import Row
from tactile_core.errors import TactileError
from tactile_core.mechanics.ball_contact import skin_contact
from tactile_core.simulation.full_pairs import REGION_X
from tactile_core.simulation.pairs_file import Pairs
from tactile_core.training.error_summary import in_bins, metric_rows
from tactile_core.training.step_errors import Bodies, Columns, digit_columns, joined, mesh_columns, true_displacement

SHARE = 2 / 3  # of the baseline, at most, in a part of the pad never trained on (docs/sources.md, Targets)


def mechanics_rows(pairs: Pairs, bodies: Bodies) -> list[Row]:
    """Rows over contacts that press without sliding, in the whole pad and in the region at the tip."""
    still = ~pairs.slide.any(axis=1)
    sets = {"seen indenters": still, "the tip, by mechanics alone": still & (pairs.place[:, 0] < REGION_X)}
    found = []
    for name, inside in sets.items():
        rows = np.flatnonzero(inside)
        columns = joined(_columns(pairs, rows[start : start + 1], bodies) for start in range(len(rows)))
        baseline = in_bins(columns["baseline_digit_rms_um"], pairs.depth_biotac[rows], pairs.indenter[rows])
        targets = {} if name == "seen indenters" or baseline is None else {"mechanics_rms_um": SHARE * baseline}
        found += metric_rows(columns, pairs, rows, name, targets)
    return found


def _columns(pairs: Pairs, rows: np.ndarray, bodies: Bodies) -> Columns:
    """Metrics of one contact; one that is not found or not borne by the gel counts as no displacement."""
    skin, gel = (true_displacement(pairs, sensor, rows) for sensor in ("biotac", "digit"))
    found = np.zeros_like(gel)
    with contextlib.suppress(TactileError):
        found[0] = skin_contact(skin[0].astype(float)).on_gel().displacement
    return {
        **mesh_columns("baseline_digit", np.zeros_like(gel), gel),
        **mesh_columns("mechanics", found, gel),
        **digit_columns("mechanics", found, pairs.contact_patch_digit[rows], bodies),
    }
