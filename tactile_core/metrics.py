"""Errors of displacements, forces and contact places, always against the truth (finite-element mesh, known load).

Each figure has a null answer, the figure of doing nothing: no displacement, no force, the mean place.
All displacements are (C, n, 3) m, one contact a row; every function works contact by contact.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Depth = Callable[[np.ndarray], np.ndarray]  # (C, n, 3) m -> (C, n) m
MOVING = 10e-6  # m: nodes that move less do not belong to a contact (networks.md)
CORE = 0.3  # share of the peak height above which a node belongs to the core of a contact (networks.md)


def lengths(vectors: np.ndarray) -> np.ndarray:
    """Euclidean length over the last axis, in float64."""
    return np.sqrt(np.square(vectors, dtype=np.float64).sum(-1))


def rms_in_contact(predicted: np.ndarray, true: np.ndarray) -> np.ndarray:
    """(C,) m: root mean square of the vector error over the nodes whose true displacement exceeds 10 um.

    NaN where no node moves that far. The average over contacts is the rmsC of networks.md.
    """
    moving = lengths(true) > MOVING
    squares = np.where(moving, lengths(predicted - true) ** 2, 0.0).sum(-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.sqrt(squares / moving.sum(-1))


def max_error(predicted: np.ndarray, true: np.ndarray) -> np.ndarray:
    """(C,) m: largest vector error of a node."""
    return lengths(predicted - true).max(-1)


def height(displacement: np.ndarray) -> np.ndarray:
    """(C, n) m: how far nodes moved along +y, into the DIGIT's gel."""
    return np.asarray(displacement[..., 1], np.float64)


def core_height_error(predicted: np.ndarray, true: np.ndarray, depth: Depth = height) -> np.ndarray:
    """(C,) m: rms error of the depth over the core, the nodes above 30 % of the true peak; NaN without contact.

    depth : what depth means on this surface: `height` on the DIGIT, `lengths` on the BioTac, whose pad is curved
    """
    found, truth = depth(predicted), depth(true)
    peak = truth.max(-1, keepdims=True)
    core = (truth > CORE * peak) & (peak > MOVING)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.sqrt((np.square(found - truth) * core).sum(-1) / core.sum(-1))


def peak_depth_error(predicted: np.ndarray, true: np.ndarray, depth: Depth = height) -> np.ndarray:
    """(C,): error of the depth of the deepest node, share of the true one; NaN without contact."""
    peak, truth = depth(predicted).max(-1), depth(true).max(-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(truth > MOVING, np.abs(peak - truth) / truth, np.nan)


def dent_center(displacement: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """(C, 2) m: (x, z) of the dent, mean place of its core weighted with depth; NaN where nothing moves 10 um.

    displacement : (C, n, 3) m
    rest : (n, 3) m
    """
    return core_center(height(displacement), np.asarray(rest, np.float64)[:, [0, 2]])


def core_center(depth: np.ndarray, places: np.ndarray, least: float = MOVING) -> np.ndarray:
    """(C, 2), mean of the places (n, 2) of a dent's core, weighted with depth (C, n) m; NaN if none is above least."""
    peak = depth.max(-1, keepdims=True)
    weight = np.where((depth > CORE * peak) & (peak > least), depth, 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        return weight @ places / weight.sum(-1, keepdims=True)


def mean(values: np.ndarray) -> float | None:
    """Mean over contacts without the NaN ones; None if none is left (JSON knows no NaN)."""
    values = np.asarray(values)[np.isfinite(values)]
    return float(values.mean()) if len(values) else None


def mesh_figures(predicted: np.ndarray, true: np.ndarray, depth: Depth = height) -> dict[str, np.ndarray]:
    """The four figures of a mesh for each contact: micrometres, and per cent for the peak."""
    return {
        "rms_um": 1e6 * rms_in_contact(predicted, true),
        "max_um": 1e6 * max_error(predicted, true),
        "core_height_um": 1e6 * core_height_error(predicted, true, depth),
        "peak_depth_percent": 1e2 * peak_depth_error(predicted, true, depth),
    }
