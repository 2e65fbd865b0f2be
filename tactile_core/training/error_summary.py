"""Summarise metrics of contacts in rows: depth bins and indenters count alike, deeper and sliding contacts apart."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..accuracy import Row, row
from ..simulation.pairs_file import Pairs
from .step_errors import Columns

BINS = (0.1e-3, 0.3e-3, 0.6e-3, 0.9e-3, 1.2e-3)  # m, of depth on the BioTac, the sensor that is read (assumed)

MEDIANS = ("position_mm", "percent")
BASELINES = {"MVB": "baseline_biotac", "S2MPN": "baseline_biotac", "D2B": "baseline_biotac"}


def in_bins(values: np.ndarray, depth: np.ndarray, indenter: np.ndarray, median: bool = False) -> float | None:
    """Return the mean over depths of the mean over indenters of contacts' mean (or median); None without any."""
    middle = np.median if median else np.mean
    bins = []
    for low, high in zip(BINS[:-1], BINS[1:], strict=True):
        inside = np.isfinite(values) & (depth >= low) & (depth < high)
        each = [middle(values[inside & (indenter == kind)]) for kind in np.unique(indenter[inside])]
        if each:
            bins.append(np.mean(each))
    return float(np.mean(bins)) if bins else None


def metric_rows(
    columns: Columns, pairs: Pairs, rows: np.ndarray, set_name: str, targets: dict[str, float]
) -> list[Row]:
    """Make a row for each metric over the contacts in these rows that press without sliding, averaged as `in_bins`."""
    still = ~pairs.slide[rows].any(-1)
    depth, indenter = pairs.depth_biotac[rows], pairs.indenter[rows]
    found = []
    for name, values in columns.items():
        if not name.startswith("baseline_"):
            at = np.where(still, values, np.nan)
            value = in_bins(at, depth, indenter, is_median(name))
            baseline = in_bins(np.where(still, _baseline(columns, name), np.nan), depth, indenter, is_median(name))
            found.append(metric_row(name, value, baseline, targets.get(name), set_name))
    return found


def is_median(name: str) -> bool:
    """Return true if a metric is summarised by its median: distances of places and shares of forces and peaks."""
    return name.endswith(MEDIANS)


def _baseline(columns: Columns, name: str) -> np.ndarray:
    step, metric = name.split("_", 1)
    nothing = columns.get(
        "baseline_counts" if metric == "counts" else f"{BASELINES.get(step, 'baseline_digit')}_{metric}"
    )
    return np.full(len(columns[name]), np.nan) if nothing is None else nothing


def metric_row(name: str, value: float | None, baseline: float | None, target: float | None, set_name: str) -> Row:
    """Make one row of a report; the unit is the name's last word. Larger is better for an intersection over union."""
    unit = name.rsplit("_", 1)[1].replace("percent", "%").replace("iou", "1")
    target = None if value is None else target
    return row(name, value, unit, target, baseline=baseline, of=set_name, at_least=name.endswith("iou"))


def slices(pairs: Pairs, rows: np.ndarray) -> Iterable[tuple[str, np.ndarray]]:
    """Yield name and mask over ``rows`` of contacts with rows of their own: light, of each depth, deeper, sliding."""
    depth, sliding = pairs.depth_biotac[rows], pairs.slide[rows].any(-1)
    yield "lighter than 0.1 mm", (depth < BINS[0]) & ~sliding
    for low, high in zip(BINS[:-1], BINS[1:], strict=True):
        yield f"{1e3 * low:g} to {1e3 * high:g} mm", (depth >= low) & (depth < high) & ~sliding
    yield "deeper than 1.2 mm", (depth >= BINS[-1]) & ~sliding
    yield "sliding", sliding
