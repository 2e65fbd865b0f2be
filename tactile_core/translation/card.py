"""Read from a model card which two sensors its networks translate between, and their error on held-out presses."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from .. import sensors
from ..errors import TactileError
from ..sensors import PAIR
from ..sensors.descriptor import OWN
from ..sensors.descriptor import names as known_sensors

NODES = "_nodes_sha256"  # after a sensor's name in a card, the hash of its surface
REST = "rest_counts"  # in a card: counts at rest that changes are those of, where the sensor's table holds none

ROW, SET = "chain_rms_um", "test presses"  # BioTac signals to the gel's displacement, rms over its nodes
WORSE = 0.8  # of the baseline, the error of no displacement at all: above it weights hardly translate (assumed)


def pair_of(card: dict[str, Any], where: str | os.PathLike) -> tuple[str, str]:
    """Return the sensor that is read and the gel that is translated to.

    Raises TactileError for a sensor that is not known here, and for two that are not one of each kind.
    """
    of = sorted(key.removesuffix(NODES) for key in card if key.endswith(NODES))
    if len(of) != 2:
        return PAIR
    missing = [name for name in of if name not in known_sensors()]
    if missing:
        advice = f"Put the folder of {missing[0]} into the one that ${OWN} names"
        raise TactileError(where, f"networks of {' and '.join(of)}", f"of {', '.join(known_sensors())}", advice)
    source, target = sorted(of, key=sensors.is_gel)
    if sensors.is_gel(source) or not sensors.is_gel(target):
        raise TactileError(where, f"networks of {' and '.join(of)}", "a sensor of skin and fluid, and a gel")
    return source, target


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
