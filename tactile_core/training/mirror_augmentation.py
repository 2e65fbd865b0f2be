"""Mirrored contacts: both sensors are even in z, so every contact's mirror image is a contact too."""

from __future__ import annotations

import functools

import numpy as np

from ..sensors import SOURCE, electrodes
from ..translation.contact_frame import ContactFrame

Z = 2  # the axis that turns round, of forces and, in nodes' own frames, of displacements
SAME = 1e-4  # rad: angles closer than this are one


def image_of_nodes(frame: ContactFrame) -> np.ndarray:
    """Mirror image (n,) of each node; nodes behind the lattice (poles) are their own.

    Raises ValueError for a lattice whose columns have no images.
    """
    columns, angle = np.arange(frame.columns), frame.turn[: frame.columns].astype(float)
    image = columns[::-1]
    if angle.any():  # columns stand round an axis, where the first is its own image if it lies behind
        apart = np.angle(np.exp(1j * (angle[:, None] + angle)))
        image = np.abs(apart).argmin(axis=1)
        if np.abs(apart[columns, image]).max() > SAME:
            raise ValueError("the lattice is not even in z: some columns have no image")
    nodes = np.arange(len(frame.turn))
    grid = nodes[: frame.rows * frame.columns].reshape(frame.rows, frame.columns)
    return np.concatenate([grid[:, image].ravel(), nodes[grid.size :]])


@functools.cache
def image_of_electrodes(sensor: str = SOURCE) -> np.ndarray:
    """Mirror image (19,) of each electrode."""
    at = electrodes(sensor)
    return np.square(at[:, None] * [1, 1, -1] - at).sum(-1).argmin(axis=1)


def across(vectors: np.ndarray) -> np.ndarray:
    """Return the vectors (..., 3) as the mirror shows them; overwrites them."""
    vectors[..., Z] *= -1
    return vectors
