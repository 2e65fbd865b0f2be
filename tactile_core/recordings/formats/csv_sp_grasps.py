"""CSV of grasps by BioTac SPs, ff_biotac_1..24 (3dperceptionlab/biotacsp-stability-set-v2): no time stamps."""

from __future__ import annotations

from collections.abc import Collection

from ...sensors import SP
from ..recording import Recording
from ..tables.table import Table
from . import fingers_of, of_finger, share_of_fingers

CONTAINER, SENSOR = "csv", SP
NAME = "CSV with ff_biotac_1..24, mf_..., th_... of BioTac SPs, a grasp a line"
STYLE = "{}_biotac_{}"


def score(keys: Collection[str]) -> float:
    """Return the share of the columns of the finger of which the file has most."""
    return share_of_fingers(keys, STYLE)


def fingers(keys: Collection[str]) -> tuple[int, ...]:
    """Return the numbers of the fingers that a file holds, ascending."""
    return fingers_of(keys, STYLE)


def read(table: Table, finger: int) -> Recording:
    """Read one finger. Raises TactileError for a column that is missing, and the errors of ``assemble``."""
    return of_finger(table, NAME, STYLE, finger, snapshots=True)
