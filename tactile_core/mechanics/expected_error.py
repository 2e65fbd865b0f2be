"""What error each tier is expected to make, by depth, as ``scripts/measure_tiers.py`` measured it."""

from __future__ import annotations

import functools
import json
from pathlib import Path
from typing import Any

TABLE = Path(__file__).parent.parent / "data" / "mechanics_tiers.json"
REFERENCE_SHARE = 1 / 3  # of the full tier's error (assumed: halving cells of order 2 leaves a quarter; a margin on it)


@functools.cache
def measured() -> dict[str, Any]:
    """The table: how, and by tier and sensor ms a contact and errors in bins of depth over thickness."""
    return json.loads(TABLE.read_text(encoding="utf-8"))


def expected_error(tier: str, sensor: str, share: float) -> tuple[float, float]:
    """Shape error, m rms, and relative force error that 95 of 100 contacts at a depth over thickness stay below.

    The fast tier's are from the full tier, whose own come on top; deeper than measured: those of the deepest bin.
    """
    if share <= 0:
        return 0.0, 0.0
    bins = measured()["tiers"][tier][sensor]["bins"]
    found = next((each for each in bins if share <= each["depth_share_to"]), bins[-1])
    return 1e-6 * found["shape_95_um"], found["force_95"]
