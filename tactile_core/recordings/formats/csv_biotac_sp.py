"""CSV of a BioTac SP, ff_e1..24 or ff_biotac_1..24 (also mf, th): no recording to translate; see ``biotac_sp``."""

from __future__ import annotations

import re
from collections.abc import Collection

from ..assemble import check_electrodes
from ..recording import Recording
from ..table import Table

CONTAINER = "csv"
NAME = "CSV with ff_e1..24 or ff_biotac_1..24 of a BioTac SP"
COLUMN = re.compile(r"(ff|mf|rf|lf|th)_(e|biotac_)\d+$")


def score(keys: Collection[str]) -> float:
    """Return 1 for a finger's electrodes, of which a few may be missing, else 0."""
    return float(sum(bool(COLUMN.match(key)) for key in keys) >= 20)


def read(table: Table) -> Recording:
    """Raise TactileError: a BioTac SP has 24 electrodes."""
    check_electrodes(table.path, 24, "line 1")
    raise AssertionError("24 electrodes are refused")
