"""Encode one sensor's displacements for training, in the nodes' own frames, as coefficients; compute their loss."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
import torch
from torch import Tensor

from ..accuracy import MOVING
from ..sensors import SOURCE, electrodes
from ..translation.contact_frame import PLACE_UNIT, ContactFrame

Z = 2  # the axis that a mirror image reverses, of forces and, in nodes' own frames, of displacements
SAME = 1e-4  # rad: angles closer than this are one


def image_of_nodes(frame: ContactFrame) -> np.ndarray:
    """Return the index (n,) of each node's mirror image; nodes behind the lattice (poles) are their own. Raises
    ValueError for a lattice whose columns have no images."""
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
    """Return for each electrode of a sensor the index (19,) of the one nearest to its mirror image in z."""
    at = electrodes(sensor)
    return np.square(at[:, None] * [1, 1, -1] - at).sum(-1).argmin(axis=1)


def across(vectors: np.ndarray) -> np.ndarray:
    """Mirror vectors (..., 3) in z, in place; returns them."""
    vectors[..., Z] *= -1
    return vectors


ROWS = 512  # contacts at a time: bounds the float32 copy of the int16 data to tens of megabytes
EXTRA = 16  # columns of oversampling and
ROUNDS = 4  # power iterations: Halko, Martinsson and Tropp 2011, ample for a spectrum that decays as fast as this one
SILENT = -1  # index that stands for a sample without contact
FEWEST = 100  # least nodes that a squared error is divided by: light touches move few (assumed)
ROOT_FLOOR = 1e-6  # m, rounds the root of the loss at zero error
LEAST_AWAY = 0.01  # cells, rounds the distance of places at zero
BASIS_ROWS = 12_000  # contacts that the bases are drawn from, fifty times as many as fields are taken (assumed)
SMALLEST_SCALE = 0.03  # least scale of a coefficient, its spread, over the largest one (assumed)
Fields = Callable[[np.ndarray], Tensor]  # contact indices (B,) -> (B, size) in millimetres: float32's middle range


class SurfaceCodec:
    """Displacements of one sensor, their moving frame and linear bases, in the host's memory.

    data : (D, n, 3) int16 in the sensor's own frame, in ``unit`` m; contact D + i is contact i mirrored
    wide : (K, 3n) orthonormal rows, fields of the whole surface; near : (K', 3w), fields of the window's w nodes, for
        what ``wide`` leaves
    place : (C, 2) of dents, C = 2 D if mirrored, or D; modes : (C, K + K') coefficients over ``scale`` (K + K',) m
    total : (C,) m2, sum of squared displacements; moving : (C,) number of nodes that move, at least FEWEST
    baseline : m, loss of no displacement, mean over training contacts
    In the methods, rows (B,) are contact indices, D + i for the mirror image of i, SILENT for no contact. Arguments:
    rows (R,) of the training contacts, numbers `wide`, `near` of basis fields, generator of the bases' random start,
    mirrored, true to add the mirror images"""

    def __init__(
        self, data: np.ndarray, unit: float, rows: np.ndarray, frame: ContactFrame, wide: int, near: int,
        generator: torch.Generator, *, mirrored: bool = False,
    ) -> None:  # fmt: skip
        self.frame, self.unit = frame, unit
        self.data = data
        self._image, every = None, np.arange(len(data))
        if mirrored:
            self._image, every = image_of_nodes(frame), np.arange(2 * len(data))
            rows = np.concatenate([rows, rows + len(data)])
        self.place = _in_parts(lambda part: torch.from_numpy(frame.place(self._local(part))), every).numpy()
        self.cell, self.left = frame.cells(self.place)
        some = rows[:: max(1, len(rows) // BASIS_ROWS)]
        self.wide = principal_basis(self._whole, some, wide, generator)
        self.near = principal_basis(self._tapered, some, near, generator)
        metres = _in_parts(self._coefficients, every).mul_(1e-3)
        spread = metres[rows].square().mean(0).sqrt()
        self.scale = spread.clamp(min=max(SMALLEST_SCALE * float(spread.max()), 1e-9))
        self.modes = metres.div_(self.scale)
        self.total, self.moving = _in_parts(self._sizes, every).T
        self.baseline = max(float((self.total[rows] / self.moving[rows]).sqrt().mean()), 1e-9)

    def _local(self, rows: np.ndarray) -> np.ndarray:
        """Return displacements (B, n, 3) float32 of contacts rows (B,), in ``unit`` m, in the nodes' own frames."""
        some, turned = self.data[rows % len(self.data)], rows >= len(self.data)
        values = np.rint(self.frame.to_local(some)) if self.frame.turn.any() else some.astype(np.float32)
        if turned.any():
            values[turned] = across(values[turned][:, self._image])
        return values

    def _millimetres(self, rows: np.ndarray) -> Tensor:
        return torch.from_numpy(self._local(rows)) * (1e3 * self.unit)

    def _whole(self, rows: np.ndarray) -> Tensor:
        return self._millimetres(rows).flatten(1)

    def _rest_in_window(self, rows: np.ndarray, whole: Tensor) -> Tensor:
        rest = whole - whole @ self.wide.T @ self.wide
        fields = rest.view(len(rows), -1, 3).numpy()
        return torch.from_numpy(self.frame.windows(fields, self.cell[rows])).flatten(1)

    def _tapered(self, rows: np.ndarray) -> Tensor:
        """Return what ``wide`` leaves of rows (B,) in the window, (B, 3w) mm, faded toward its edge, where decoded gel
        would have a step."""
        fade = torch.from_numpy(self.frame.fade())
        windows = self._rest_in_window(rows, self._whole(rows)).view(len(rows), *fade.shape, 3)
        return (windows * fade[:, :, None]).flatten(1)

    def _coefficients(self, rows: np.ndarray) -> Tensor:
        whole = self._whole(rows)
        return torch.cat([whole @ self.wide.T, self._rest_in_window(rows, whole) @ self.near.T], -1)

    def _sizes(self, rows: np.ndarray) -> Tensor:
        squares = 1e-6 * self._millimetres(rows).square().sum(-1)
        return torch.stack([squares.sum(-1), (squares > MOVING**2).sum(-1).clamp(min=FEWEST).float()], -1)

    def inputs(self, rows: np.ndarray) -> Tensor:
        """Return the encoder's input (B, K + K' + 4) of rows (B,): coefficients, place, remainder; 0 if silent."""
        at = np.maximum(rows, 0)
        place = torch.from_numpy(np.concatenate([self.place[at], self.left[at]], -1))
        return torch.cat([self.modes[at], place], -1) * touching(rows)

    def cells(self, place: Tensor) -> tuple[Tensor, Tensor]:
        """Round place (B, 2) to cells (B, 2), see `ContactFrame.cells`, and remainders (B, 2), which carry
        gradients."""
        middle = torch.tensor([self.frame.rows - 1.0, self.frame.columns - 1.0], device=place.device) / 2
        at = place * PLACE_UNIT + middle
        cell = torch.round(torch.minimum(at.detach().clamp(min=0.0), 2 * middle))
        return cell.long(), (at - cell).clamp(-1.0, 1.0)

    def true_place(self, rows: np.ndarray) -> Tensor:
        """Return the true places (B, 2) of rows' (B,) dents, row and column in tens of cells; 0 for silent ones."""
        return torch.from_numpy(self.place[np.maximum(rows, 0)]) * touching(rows)

    def astray(self, place: Tensor, rows: np.ndarray) -> Tensor:
        """Return the mean distance, cells, of place (B, 2) from that of rows (B,); silent ones count LEAST_AWAY."""
        away = PLACE_UNIT * (place - self.true_place(rows).to(place.device)) * touching(rows).to(place.device)
        return (away.square().sum(-1) + LEAST_AWAY**2).sqrt().mean()

    def loss(self, modes: Tensor, cell: Tensor, rows: np.ndarray) -> Tensor:
        """Return the mean error of modes (B, K + K'), coefficients over ``scale``, around cell (B, 2) against the
        contacts rows (B,): rms over moving nodes, divided by that of no displacement.

        The root is taken contact by contact, like in the reported metric, so that deep contacts do not dominate shallow
        ones. The bases are orthonormal, so an error in coefficients is one of nodes; the part outside both bases is
        added. Only the product of errors in both bases is neglected (near fields are nearly orthogonal to wide ones,
        being their remainder)."""
        at, touched, device = np.maximum(rows, 0), touching(rows), modes.device
        with torch.no_grad():
            true = self._at_cells(at, cell) * touched
            beyond = (self.total[at] - true.square().sum(-1)).clamp(min=0.0) * touched[:, 0]
        squares = (modes * self.scale.to(device) - true.to(device)).square().sum(-1) + beyond.to(device)
        return (squares / self.moving[at].to(device) + ROOT_FLOOR**2).sqrt().mean() / self.baseline

    def field(self, modes: Tensor, cell: Tensor) -> Tensor:
        """Decode modes (B, K + K') around cell (B, 2) to displacement (B, n, 3) m in nodes' own frames, on the host."""
        metres, wide, width = modes.cpu() * self.scale, len(self.wide), self.frame.width
        whole = (metres[:, :wide] @ self.wide).view(len(modes), -1, 3).numpy()
        near = (metres[:, wide:] @ self.near).view(len(modes), width, width, 3).numpy()
        return torch.from_numpy(self.frame.add(whole, near, cell.cpu().numpy()))

    def true(self, rows: np.ndarray) -> Tensor:
        """Return the true displacements (B, n, 3) m of rows (B,), in the nodes' own frames; zero if silent."""
        values = torch.from_numpy(self._local(np.maximum(rows, 0)))
        return values * (self.unit * touching(rows)[:, :, None])

    def _at_cells(self, rows: np.ndarray, cells: Tensor) -> Tensor:
        """Return coefficients (B, K + K') m of contacts rows (B,) in windows around cells (B, 2), not around their
        own."""
        metres, cell = self.modes[rows] * self.scale, cells.cpu().numpy()
        moved = (cell != self.cell[rows]).any(-1)
        if moved.any():
            wide = len(self.wide)
            rest = self._whole(rows[moved]) - 1e3 * metres[moved, :wide] @ self.wide
            fields = rest.view(len(rest), -1, 3).numpy()
            windows = torch.from_numpy(self.frame.windows(fields, cell[moved])).flatten(1)
            metres[moved, wide:] = 1e-3 * windows @ self.near.T
        return metres


def _in_parts(values: Callable[[np.ndarray], Tensor], rows: np.ndarray) -> Tensor:
    """Return values(rows), (n, ...), for rows (n,), computed in parts into one array: separate ones fragment memory."""
    first = values(rows[:ROWS])
    found = first.new_empty(len(rows), *first.shape[1:])
    found[:ROWS] = first
    for start in range(ROWS, len(rows), ROWS):
        found[start : start + ROWS] = values(rows[start : start + ROWS])
    return found


def touching(rows: np.ndarray) -> Tensor:
    """Return the mask (B, 1) of rows (B,): 1 for contacts, 0 for silent samples."""
    return torch.from_numpy((rows != SILENT).astype(np.float32))[:, None]


def principal_basis(fields: Fields, rows: np.ndarray, modes: int, generator: torch.Generator) -> Tensor:
    """Return orthonormal rows (K, size), K = min(modes, contacts, size), that span most of the fields. They are not
    centred, so that no displacement has zero coefficients, and rounded to float16, the shipped dtype.
    fields : function from contact indices (B,) to fields (B, size) mm; rows : contacts to use"""
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
