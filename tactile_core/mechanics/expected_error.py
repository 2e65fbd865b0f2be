"""What error each finite-strain tier is expected to make, by depth; the fast tier's comes with its correction."""

from __future__ import annotations

import numpy as np

# Depth over thickness, rms shape error m over nodes that move more than 10 um, relative error of force.
# Full tier: against the reference tier, 7 mm ball at one place, 0.2 to 1.2 mm deep (docs/mechanics.md, tiers); forces
# were off by up to 0.8 %, so 1 % is what is stated. Between BioTac meshes the shape jumps by some 6 um: which inner
# nodes the core holds changes with the mesh (assumed to be why). Both last rows are assumed.
# The reference tier's own error is taken as a third: halving cells of order 2 leaves a quarter, the rest is a margin
# (assumed).
_FULL = {
    "digit": np.array([[0.05, 1.2e-6, 0.01], [0.15, 1.5e-6, 0.01], [0.3, 4.5e-6, 0.01], [0.6, 10e-6, 0.01]]),
    "biotac": np.array([[0.15, 5e-6, 0.01], [0.5, 9e-6, 0.01], [0.6, 12e-6, 0.01]]),
}
_REFERENCE_SHARE = 1 / 3


def expected_error(tier: str, sensor: str, depth: float) -> tuple[float, float]:
    """Expected shape error, m, and relative force error of the full or reference tier at a depth over the thickness."""
    if depth <= 0:
        return 0.0, 0.0
    table = _FULL[sensor]
    row = table[min(int(np.searchsorted(table[:, 0], depth)), len(table) - 1)]
    share = 1.0 if tier == "full" else _REFERENCE_SHARE
    return float(row[1] * share), float(row[2] * share)
