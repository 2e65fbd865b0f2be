"""Measure errors of displacements, forces and contact positions against the truth; report them; choose by them.

The truth is a finite-element mesh or a known load.
Each metric has a baseline, its value for no displacement, no force or the mean position.
All displacements are (C, n, 3) m, one contact per row; every function treats each contact by itself.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from .errors import TactileError

Depth = Callable[[np.ndarray], np.ndarray]  # (C, n, 3) m -> (C, n) m
MOVING = 10e-6  # m: nodes that move less do not belong to a contact (docs/sources.md, Networks)
CORE = 0.3  # share of the peak height above which a node belongs to the core of a contact (docs/sources.md)
Row = dict[str, Any]
HEADER = "| name | value | unit | target | baseline | set | |\n|---|---|---|---|---|---|---|"
COSTS = ("s", "ms", "MB")  # units of time and memory: their rows may miss a target without failing a run


def lengths(vectors: np.ndarray) -> np.ndarray:
    """Return the Euclidean lengths (...,) of vectors (..., k), in float64."""
    return np.sqrt(np.square(vectors, dtype=np.float64).sum(-1))


def rms_in_contact(predicted: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Return the root mean square error (C,) m of predicted from true (C, n, 3) m, over nodes that truly move by 10 um.

    It is NaN if no node does. Its mean over contacts is called rmsC in docs/sources.md, Networks."""
    moving = lengths(true) > MOVING
    squares = np.where(moving, lengths(predicted - true) ** 2, 0.0).sum(-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.sqrt(squares / moving.sum(-1))


def max_error(predicted: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Return the error (C,) m of the worst node: the largest length of predicted - true (C, n, 3) m."""
    return lengths(predicted - true).max(-1)


def height(displacement: np.ndarray) -> np.ndarray:
    """Return the displacement (C, n) m along +y, into the DIGIT's gel, from displacement (C, n, 3) m of its nodes."""
    return np.asarray(displacement[..., 1], np.float64)


def core_height_error(predicted: np.ndarray, true: np.ndarray, depth: Depth = height) -> np.ndarray:
    """Return the RMS error (C,) m of the depth over the core, nodes above 30 % of the true peak; NaN without contact.

    predicted, true : (C, n, 3) m, displacements of the nodes in C contacts
    depth : function to nodes' depths: `height` on the DIGIT, `lengths` on the BioTac, whose pad is curved"""
    found, truth = depth(predicted), depth(true)
    peak = truth.max(-1, keepdims=True)
    core = (truth > CORE * peak) & (peak > MOVING)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.sqrt((np.square(found - truth) * core).sum(-1) / core.sum(-1))


def peak_depth_error(predicted: np.ndarray, true: np.ndarray, depth: Depth = height) -> np.ndarray:
    """Return the absolute error (C,) of the largest depth, as a share of the true largest depth; NaN without contact.
    predicted, true : (C, n, 3) m; depth : `height` on the DIGIT, `lengths` on the BioTac"""
    peak, truth = depth(predicted).max(-1), depth(true).max(-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(truth > MOVING, np.abs(peak - truth) / truth, np.nan)


def dent_center(displacement: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """Return the centre (C, 2) = (x, z) m of the dent, its core's depth-weighted mean; NaN if no node moves by 10 um.

    displacement : (C, n, 3) m, of the nodes; rest : (n, 3) m, their places at rest
    """
    return core_center(height(displacement), np.asarray(rest, np.float64)[:, [0, 2]])


def core_center(depth: np.ndarray, places: np.ndarray, least: float = MOVING) -> np.ndarray:
    """Return the mean (C, 2) m of places (n, 2) m over dents' cores, by depth (C, n) m; NaN if none is over least m."""
    peak = depth.max(-1, keepdims=True)
    weight = np.where((depth > CORE * peak) & (peak > least), depth, 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        return weight @ places / weight.sum(-1, keepdims=True)


def mean(values: np.ndarray) -> float | None:
    """Return the mean of the finite values (C,); None if there are none (JSON has no NaN)."""
    values = np.asarray(values)[np.isfinite(values)]
    return float(values.mean()) if len(values) else None


def mesh_metrics(predicted: np.ndarray, true: np.ndarray, depth: Depth = height) -> dict[str, np.ndarray]:
    """Return four metrics (C,) by name of displacements predicted against true (C, n, 3) m: rms_um, max_um,
    core_height_um, and peak_depth_percent; all but max_um are NaN without contact.
    depth : `height` on the DIGIT, `lengths` on the BioTac"""
    return {
        "rms_um": 1e6 * rms_in_contact(predicted, true),
        "max_um": 1e6 * max_error(predicted, true),
        "core_height_um": 1e6 * core_height_error(predicted, true, depth),
        "peak_depth_percent": 1e2 * peak_depth_error(predicted, true, depth),
    }


def row(
    name: str,
    value: float | None,
    unit: str,
    target: float | None = None,
    *,
    baseline: float | None = None,
    of: str = "",
    at_least: bool = False,
) -> Row:
    """Return a row of a report: name, value, unit, target, ok, baseline, set (``of``, the data); four digits.

    value : None or NaN if nothing could be measured, which misses any target
    baseline : the value of doing nothing, or of the strongest simple answer
    ok : true if |value| <= target, or, with ``at_least``, if value >= target; None without a target
    """
    ok = None
    if target is not None:
        ok = value is not None and bool(value >= target if at_least else abs(value) <= target)
    value, target, baseline = (
        float(f"{number:.4g}") if number is not None and np.isfinite(number) else None
        for number in (value, target, baseline)
    )
    return {"name": name, "value": value, "unit": unit, "target": target, "ok": ok, "baseline": baseline, "set": of}


def line(row: Row) -> str:
    """Return a row as a line of a Markdown table: name, value, unit, target, baseline, set, and "ok" or "MISSED"."""
    mark = {None: "", True: "ok", False: "MISSED"}[row["ok"]]
    cells = [row["name"], row["value"], row["unit"], row["target"], row["baseline"], row["set"], mark]
    return "| " + " | ".join("" if cell is None else str(cell) for cell in cells) + " |"


def failed(rows: list[Row]) -> list[Row]:
    """Return the rows that miss their target, without those in s, ms and MB, which vary with the machine."""
    return [found for found in rows if found["ok"] is False and found["unit"] not in COSTS]


def order(sizes: list[float], errors: list[float]) -> float:
    """Return the observed order of accuracy: slope of the straight line fitted to log(errors) over log(sizes)."""
    return float(np.polyfit(np.log(sizes), np.log(errors), 1)[0])


class Candidate(NamedTuple):
    """Method with its measured error, in the unit of the bound, and its cost, ms."""

    name: str
    error: float
    ms: float


def cheapest(candidates: Sequence[Candidate], bound: float, unit: str, what: str = "") -> Candidate:
    """Return the candidate of least cost whose error is at most the bound, in ``unit``.

    what : the errors' subject, for the message. Raises TactileError, which names the most exact one, if none is.
    """
    good = [each for each in candidates if each.error <= bound]
    if not good:
        best = min(candidates, key=lambda each: each.error)
        found = f"{bound:g} {unit}" + (f" of {what}" if what else "")
        raise TactileError("--error", found, f"{best.error:.3g} or more, which {best.name} has", "Allow more")
    return min(good, key=lambda each: each.ms)
