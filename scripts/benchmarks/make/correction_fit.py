"""Kernel ridge regression of the correction's forces and fields, on contacts known in both tiers."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from tactile_core.mechanics.fast.correction import (
    ALL,
    ESSENTIAL,
    LINES,
    MIRRORED,
    Learned,
    alike,
    kernel,
    rubs,
    squares,
)

FIELDS = 32  # learned fields per sensor
_WIDTHS = 2.0, 4.0, 8.0, 16.0  # of the kernel, in standard deviations of a feature
# Ridge over the kernel's mean diagonal. With a hundredth of it the fit extrapolated worse: a ring without tilt was 25 %
# off in force.
_RIDGES = 1e-1, 1.0
MOST = 0.6  # limit of the logarithm of a force's factor: beyond, contacts are too small for the fast tier's lattice
WHOLE = np.array([[0.0, 1.0, 1.0]])  # ``Learned.trust`` of a correction that is applied in full


class Known(NamedTuple):
    """n samples. x : (n, f) features; log_ratio : (n,), natural, of the full tier's force to the fast one's
    fields : (n, g, 3), as ``Learned.field``; fold : (n,) when it is held out; rubbing : (n,) bool, with friction"""

    x: np.ndarray
    log_ratio: np.ndarray
    fields: np.ndarray
    fold: np.ndarray
    rubbing: np.ndarray

    def select_rows(self, which: np.ndarray) -> Known:
        """Return some of the samples; which : (n,) bool, or their indices"""
        return Known(*(values[which] for values in self))


def mirrored(field: np.ndarray) -> np.ndarray:
    """Mirror fields (..., LINES * LINES, 3) across z = 0."""
    grid = field.reshape(*field.shape[:-2], LINES, LINES, 3)[..., :, ::-1, :]
    return (grid * [1.0, 1.0, -1.0]).reshape(field.shape)


class Choice(NamedTuple):
    """Kernel ridge regression's settings: ``width`` of the kernel, ``ridge`` over the mean of the kernel's diagonal."""

    width: float
    ridge: float

    def near(self, a: np.ndarray, b: np.ndarray, a_rubs: np.ndarray, b_rubs: np.ndarray) -> np.ndarray:
        """Return the kernel (n, m) of scaled features a (n, j), b (m, j) with friction a_rubs (n,), b_rubs (m,)."""
        return kernel(a, b, squares(b), self.width) * alike(a_rubs[:, None], b_rubs)

    def weights(self, scaled: np.ndarray, rubbing: np.ndarray, goals: np.ndarray) -> np.ndarray:
        """Fit weights (n, k) of scaled features (n, f), with friction ``rubbing`` (n,), to goals (n, k)."""
        near = self.near(scaled, scaled, rubbing, rubbing)
        return np.linalg.solve(near + self.ridge * np.eye(len(near)) * np.trace(near) / len(near), goals)


def fit(known: Known, for_force: Choice, by_few: Choice, for_fields: Choice) -> Learned:
    """Fit a correction to known samples and their mirror images, by kernel ridge regression with the three settings of
    ``choices``: for_force by all features, by_few of forces by the ``ESSENTIAL`` ones, for_fields."""
    x = np.concatenate([known.x, known.x * MIRRORED])
    fields = np.concatenate([known.fields, mirrored(known.fields)])
    log_ratio = np.clip(np.tile(known.log_ratio, 2), -MOST, MOST)
    shift, scale = x.mean(axis=0) * (MIRRORED > 0), x.std(axis=0) + 1e-9
    scaled, rubbing = (x - shift) / scale, rubs(x)
    flat = fields.reshape(len(fields), -1)
    _, _, basis = np.linalg.svd(flat, full_matrices=False) if len(flat) < flat.shape[1] else _by_covariance(flat)
    basis = basis[:FIELDS]
    few = scaled[:, ESSENTIAL]
    return Learned(
        shift, scale, scaled.astype(np.float32), rubbing.astype(np.float32),
        np.array([for_force.width, by_few.width, for_fields.width]),
        np.array([for_force.weights(scaled, rubbing, log_ratio), by_few.weights(few, rubbing, log_ratio)]),
        for_fields.weights(scaled, rubbing, flat @ basis.T).astype(np.float32),
        basis.reshape(len(basis), LINES * LINES, 3).astype(np.float16), WHOLE,
    )  # fmt: skip


def _by_covariance(flat: np.ndarray) -> tuple[None, None, np.ndarray]:
    values, vectors = np.linalg.eigh(flat.T @ flat)
    return None, None, vectors[:, np.argsort(values)[::-1]].T


def choices(known: Known, kind: bool) -> tuple[Choice, Choice, Choice]:
    """Choose settings by held-out presses, those with friction if ``kind`` is true, else those without: for forces by
    all features, for forces by the ``ESSENTIAL`` ones, for fields."""
    coarse = known.fields[:, ::7].reshape(len(known.x), -1)  # enough points of the grid to choose by
    forces = np.clip(known.log_ratio, -MOST, MOST)[:, None]
    every = [Choice(width, ridge) for width in _WIDTHS for ridge in _RIDGES]
    both = [_fold_errors(known, kind, ALL, np.column_stack([forces, coarse]), choice) for choice in every]
    few = [_fold_errors(known, kind, ESSENTIAL, forces, choice) for choice in every]
    pairs = itertools.product(range(len(every)), repeat=2)
    one, other = min(pairs, key=lambda pair: _size((both[pair[0]][:, :1] + few[pair[1]]) / 2))
    fields = min(range(len(every)), key=lambda i: _size(both[i][:, 1:]))
    return every[one], every[other], every[fields]


def _fold_errors(known: Known, kind: bool, parts: slice | np.ndarray, goals: np.ndarray, choice: Choice) -> np.ndarray:
    """Return errors (m, k) of goals (n, k) of the samples of one kind in each fold, learned from the rest.
    kind : true for those with friction; parts : the features that are used, a slice or their indices"""
    error, rubbing = np.zeros_like(goals), rubs(known.x)
    for f in np.unique(known.fold):
        rest, held = known.fold != f, (known.fold == f) & (known.rubbing == kind)
        scaled = ((known.x - known.x[rest].mean(axis=0)) / (known.x[rest].std(axis=0) + 1e-9))[:, parts]
        near = choice.near(scaled[held], scaled[rest], rubbing[held], rubbing[rest])
        error[held] = near @ choice.weights(scaled[rest], rubbing[rest], goals[rest]) - goals[held]
    return error[known.rubbing == kind]


def _size(error: np.ndarray) -> float:
    """Return the sum of median and mean of each row's root mean square, of an error (m, k)."""
    size = np.sqrt((error**2).mean(axis=1))
    return float(np.median(size) + size.mean())
