"""The fixed linear front end of the mesh autoencoders: principal displacements of the training contacts."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

ROWS = 512  # contacts at a time: bounds the float32 copy of the int16 data to tens of megabytes
EXTRA = 16  # columns of oversampling and
ROUNDS = 4  # power iterations: Halko, Martinsson and Tropp 2011, ample for a spectrum that decays as fast as this one


def principal_basis(data: np.ndarray, scale: float, rows: np.ndarray, modes: int, generator: torch.Generator) -> Tensor:
    """Orthonormal rows (K, 3n) that span most of the displacement; K = min(modes, contacts, 3n).

    Not centred: no displacement has the coefficients zero. Rounded to float16, the dtype it is shipped in.
    data : (C, n, 3) int16, times scale in m
    rows : contacts to use
    """
    flat = data.reshape(len(data), -1)
    modes = min(modes, len(rows), flat.shape[1])
    columns = min(modes + EXTRA, len(rows), flat.shape[1])
    basis = torch.randn(flat.shape[1], columns, generator=generator)
    for _ in range(ROUNDS):
        basis, _ = torch.linalg.qr(_covariance(flat, scale, rows, basis))
    small = basis.T @ _covariance(flat, scale, rows, basis)
    values, vectors = torch.linalg.eigh((small + small.T) / 2)
    leading = vectors[:, torch.argsort(values, descending=True)[:modes]]
    return (basis @ leading).T.contiguous().half().float()


def _covariance(flat: np.ndarray, scale: float, rows: np.ndarray, basis: Tensor) -> Tensor:
    """(X^T X) basis with X (rows, 3n) in millimetres, which keeps float32 in its middle range."""
    total = torch.zeros_like(basis)
    for start in range(0, len(rows), ROWS):
        part = _millimetres(flat, scale, rows[start : start + ROWS])
        total += part.T @ (part @ basis)
    return total


def _millimetres(flat: np.ndarray, scale: float, rows: np.ndarray) -> Tensor:
    return torch.from_numpy(flat[rows].astype(np.float32)) * (1e3 * scale)


def coefficients(data: np.ndarray, scale: float, basis: Tensor) -> Tensor:
    """Coefficients (C, K) in metres of all contacts in the basis."""
    flat = data.reshape(len(data), -1)
    every = np.arange(len(data))
    parts = [_millimetres(flat, scale, every[start : start + ROWS]) @ basis.T for start in range(0, len(data), ROWS)]
    return torch.cat(parts) * 1e-3
