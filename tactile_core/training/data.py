"""Training contacts as tensors: coefficients to read, nodes to be right on, signals as a sensor reads them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from ..sensors import COUNT_MAX, REST_COUNT
from .basis import coefficients, principal_basis
from .options import Options
from .pairs import Pairs, Split

PARTS = 4  # a quarter of the nodes, drawn once, enters the loss of a step, each quarter in turn: a quarter of the work
SILENT = -1  # row number of a sample without contact
NODE_FLOOR = 0.05  # weight of a resting node where the deepest has 1.05 (assumed): rest is not free
PEAK_FLOOR = 10e-6  # m, below this depth there is no dent to weigh
ROOT_FLOOR = 1e-6  # m, rounds the root of the loss at zero error


class Surface:
    """One sensor's displacements and their linear basis.

    basis : (K, 3n) orthonormal rows            unit : m, rms of the leading coefficient in training
    modes : (C, K) coefficients over unit       null : m, loss of no displacement, mean over training contacts
    """

    def __init__(
        self, data: np.ndarray, scale: float, rows: np.ndarray, modes: int, generator: torch.Generator
    ) -> None:
        self.data, self.scale = data, scale
        self.nodes = data.shape[1]
        self.basis = principal_basis(data, scale, rows, modes, generator)
        metres = coefficients(data, scale, self.basis)
        self.unit = max(float(metres[rows, 0].square().mean().sqrt()), 1e-9)
        self.modes = metres / self.unit
        spread = self.basis.view(len(self.basis), self.nodes, 3)
        order = torch.randperm(self.nodes, generator=generator).numpy()  # a stride could fall in step with the lattice
        self._nodes = [np.sort(order[start::PARTS]) for start in range(PARTS)]
        self._parts = [spread[:, nodes].flatten(1).contiguous() for nodes in self._nodes]
        self.null = 1.0
        self.null = max(self._loss_of_nothing(rows), 1e-9)

    def _loss_of_nothing(self, rows: np.ndarray) -> float:
        """Mean loss of no displacement over these contacts and all nodes."""
        total = 0.0
        for start in range(0, len(rows), 256):
            chunk = rows[start : start + 256]
            still = torch.zeros(len(chunk), self.modes.shape[1])
            total += sum(float(self.loss(still, chunk, part)) for part in range(PARTS)) * len(chunk) / PARTS
        return total / len(rows)

    def inputs(self, rows: np.ndarray) -> Tensor:
        """(B, K) coefficients of the contacts; zero for silent ones."""
        return self.modes[np.maximum(rows, 0)] * _touching(rows)

    def true(self, rows: np.ndarray, part: int) -> Tensor:
        """(B, n', 3) m, the nodes of one part."""
        values = self.data[np.maximum(rows, 0)[:, None], self._nodes[part]].astype(np.float32)
        return torch.from_numpy(values) * self.scale * _touching(rows)[:, :, None]

    def loss(self, modes: Tensor, rows: np.ndarray, part: int) -> Tensor:
        """Mean over contacts of the rms node error, nodes weighted with their true depth; 1 for no displacement.

        The root is taken contact by contact, as in the figure we report: deep contacts do not drown shallow ones.
        """
        part %= PARTS
        true = self.true(rows, part)
        error = (modes * self.unit @ self._parts[part]).view(true.shape) - true
        with torch.no_grad():
            depth = true.square().sum(-1).sqrt()
            weight = NODE_FLOOR + depth / depth.amax(-1, keepdim=True).clamp(min=PEAK_FLOOR)
            weight = weight / weight.sum(-1, keepdim=True)
        squares = (error.square().sum(-1) * weight).sum(-1)
        return (squares + ROOT_FLOOR**2).sqrt().mean() / self.null


def _touching(rows: np.ndarray) -> Tensor:
    return torch.from_numpy((rows != SILENT).astype(np.float32))[:, None]


@dataclass(frozen=True)
class Batch:
    """A few contacts as a step of training sees them.

    rows : (B,) contact numbers, SILENT without contact          change : (B, 19) counts as read
    biotac, digit : (B, K) coefficients                          force : (B, 3) N
    part : which quarter of the nodes the loss looks at
    """

    rows: np.ndarray
    change: Tensor
    biotac: Tensor
    digit: Tensor
    force: Tensor
    part: int


class Contacts:
    """All contacts, their split, both surfaces."""

    def __init__(self, pairs: Pairs, split: Split, options: Options, generator: torch.Generator) -> None:
        self.pairs, self.split, self.options = pairs, split, options
        train = split.train
        self.biotac = Surface(pairs.displacement_biotac, pairs.scale_biotac, train, options.modes_biotac, generator)
        self.digit = Surface(pairs.displacement_digit, pairs.scale_digit, train, options.modes_digit, generator)
        self.force_unit = max(float(np.sqrt(np.square(pairs.force[train]).sum(-1).mean())), 1e-9)

    def with_silence(self, rows: np.ndarray) -> np.ndarray:
        """The rows and, behind them, the share of silent samples."""
        return np.concatenate([rows, np.full(max(1, round(self.options.silence * len(rows))), SILENT)])

    def read(self, rows: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """(B, 19) counts, the signals of the contacts as a sensor would give them: see `measured`."""
        true = self.pairs.signal[np.maximum(rows, 0)] * (rows != SILENT)[:, None]
        return measured(true, rng, self.options)

    def batch(self, rows: np.ndarray, change: np.ndarray, part: int) -> Batch:
        """The contacts of these rows with these signals."""
        force = torch.from_numpy(self.pairs.force[np.maximum(rows, 0)]) * _touching(rows)
        return Batch(rows, torch.from_numpy(change), self.biotac.inputs(rows), self.digit.inputs(rows), force, part)


def measured(change: np.ndarray, rng: np.random.Generator, options: Options) -> np.ndarray:
    """True changes (B, 19) counts -> as read: gain error a channel, noise, whole counts, the ends of the 12 bits.

    The rest lies near 3,300 counts (sensors.md) and between whole counts, as the mean of many readings does.
    """
    gain = 1.0 + options.gain * rng.standard_normal(change.shape)
    rest = REST_COUNT + rng.random(change.shape)
    reading = np.round(rest + gain * change + options.noise * rng.standard_normal(change.shape))
    return (np.clip(reading, 0, COUNT_MAX) - rest).astype(np.float32)
