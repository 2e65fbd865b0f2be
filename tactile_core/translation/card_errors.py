"""Read the error of a set of weights on held-out presses from their training, and the baseline, from their card."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

ROW, SET = "chain_rms_um", "test presses"  # BioTac signals to the gel's displacement, rms over its nodes
WORSE = 0.8  # of the baseline, the error of no displacement at all: above it weights hardly translate (assumed)


def chain_error(card: Mapping[str, Any]) -> tuple[float, float] | None:
    """Return error and baseline, um, of the translation on held-out presses; None where the card has no such row."""
    rows = card.get("errors")
    for row in rows if isinstance(rows, list) else []:
        if isinstance(row, dict) and (row.get("name"), row.get("set")) == (ROW, SET):
            value, baseline = row.get("value"), row.get("baseline")
            if isinstance(value, int | float) and isinstance(baseline, int | float):
                return float(value), float(baseline)
    return None


def doubt(card: Mapping[str, Any]) -> str:
    """Write a sentence on weights that are worse than none, or hardly better; "" for those that translate."""
    found = chain_error(card)
    if found is None or found[0] <= WORSE * found[1]:
        return ""
    judged = "worse" if found[0] > found[1] else "hardly better"
    return (
        f"these weights are {judged} than none: off by {found[0]:.3g} um (rms of the gel) on held-out presses from"
        f" their training, where no displacement at all is off by {found[1]:.3g} um: train on more pairs, or longer"
    )
