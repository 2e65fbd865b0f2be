"""What the toolkit adds to a translation or a solved contact by itself: rounding, and heights between the nodes."""

from __future__ import annotations

import functools
import json
from pathlib import Path
from typing import Any

from .errors import TactileError

TABLE = Path(__file__).parent / "data" / "sampling.json"


@functools.cache
def measured() -> dict[str, Any]:
    """What ``scripts/measure_sampling.py`` found; bins of depth over thickness, m."""
    return json.loads(TABLE.read_text(encoding="utf-8"))


def height_error(share: float) -> float:
    """um rms of a height map between nodes that 95 of 100 contacts stay below, up to a depth over the thickness."""
    bins = measured()["bins"]
    reached = [each for each in bins if each["depth_share_to"] < share] + [_bin_of(share)]
    return 1e6 * max(each["rms_95_m"] for each in reached)


def _bin_of(share: float) -> dict[str, float]:
    """The bin of a depth; the deepest beyond it."""
    bins = measured()["bins"]
    return next((each for each in bins if share <= each["depth_share_to"]), bins[-1])


def rounding() -> float:
    """um, largest that float32 changes in a translated gel."""
    return 1e6 * measured()["float32_m"]


def check_translation(bound: float, pictured: bool) -> str:
    """What `tactile convert` adds to its networks' answer, in words; pictured : whether there are heights or pictures.

    Raises TactileError where that is more than the bound, um: there is nothing more exact to choose.
    """
    added = height_error(1.0) if pictured else rounding()
    what = "heights between nodes" if pictured else "rounding to float32"
    if added > bound:
        raise TactileError("--error", f"{bound:g} um", f"{added:.3g} or more, which {what} adds", "Allow more")
    return f"{what} adds {added:.2g} um to what the networks say, at most {bound:g} um: nothing to choose"
