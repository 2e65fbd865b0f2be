"""The fixed linear front end of the mesh autoencoders: principal fields of the training contacts."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch
from torch import Tensor

ROWS = 512  # contacts at a time: bounds the float32 copy of the int16 data to tens of megabytes
EXTRA = 16  # columns of oversampling and
ROUNDS = 4  # power iterations: Halko, Martinsson and Tropp 2011, ample for a spectrum that decays as fast as this one
Fields = Callable[[np.ndarray], Tensor]  # row numbers (B,) -> (B, size) in millimetres: float32's middle range


def principal_basis(fields: Fields, rows: np.ndarray, modes: int, generator: torch.Generator) -> Tensor:
    """Return the orthonormal rows (K, size) that span most of the fields; K = min(modes, contacts, size).

    Not centred: no displacement has the coefficients zero. Rounded to float16, the dtype it is shipped in.
    rows : contacts to use
    """
    size = fields(rows[:1]).shape[1]
    modes = min(modes, len(rows), size)
    columns = min(modes + EXTRA, len(rows), size)
    basis = torch.randn(size, columns, generator=generator)
    for _ in range(ROUNDS):
        basis, _ = torch.linalg.qr(_covariance(fields, rows, basis))
    small = basis.T @ _covariance(fields, rows, basis)
    values, vectors = torch.linalg.eigh((small + small.T) / 2)
    leading = vectors[:, torch.argsort(values, descending=True)[:modes]]
    return (basis @ leading).T.contiguous().half().float()


def _covariance(fields: Fields, rows: np.ndarray, basis: Tensor) -> Tensor:
    """Compute (X^T X) basis with X (rows, size)."""
    total = torch.zeros_like(basis)
    for start in range(0, len(rows), ROWS):
        part = fields(rows[start : start + ROWS])
        total += part.T @ (part @ basis)
    return total
