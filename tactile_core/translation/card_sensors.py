"""Tell from a model card which two sensors its networks translate between: it names the nodes of both."""

from __future__ import annotations

import os
from typing import Any

from .. import sensors
from ..errors import TactileError
from ..sensors import PAIR
from ..sensors.descriptor import OWN
from ..sensors.descriptor import names as known_sensors

NODES = "_nodes_sha256"  # after a sensor's name in a card, the hash of its surface
REST = "rest_counts"  # in a card: counts at rest that changes are those of, where the sensor's table holds none


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
