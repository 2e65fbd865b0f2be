"""CSV of the public set of slides: timestamp,tdc,tac,pdc,pac1..22,ele1..19, a separator at the end of each row."""

from __future__ import annotations

from functools import partial

from ...sensors import ELECTRODES
from ..assemble import check_electrodes
from ..recording import Recording
from ..tables.table import Table
from . import of_table, share

CONTAINER = "csv"
NAME = "CSV with timestamp, tdc, tac, pdc, pac1..22, ele1..19"
PAC = [f"pac{i}" for i in range(1, 23)]
ELECTRODE_NAMES = [f"ele{i}" for i in range(1, ELECTRODES + 1)]

score = partial(share, wanted=["timestamp", *ELECTRODE_NAMES])


def read(table: Table) -> Recording:
    """Return a table's recording. Raises TactileError for a missing column, and for what `assemble` refuses."""
    held = sum(name.startswith("ele") and name[3:].isdigit() for name in table.header)
    if held > ELECTRODES:
        check_electrodes(table.path, held, "line 1")
    return of_table(table, NAME, "timestamp", ELECTRODE_NAMES, pac=PAC)
