"""Training contacts as a step of training sees them: signals as a sensor reads them, surfaces, forces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from ..mechanics.electrodes.law import rest_counts
from ..simulation.pairs_file import Pairs, Split
from ..translation.contact_frame import ContactFrame
from ..translation.posterior import DEPTH_SCALE, FORCE_SCALE
from .mirror_augmentation import across, image_of_electrodes
from .noise_model import measured
from .options import Options
from .surface_codec import SILENT, SurfaceCodec, touching


@dataclass(frozen=True)
class Batch:
    """A few contacts as a step of training sees them.

    rows : (B,) contact numbers as of ``Contacts``               signal : (B, 20) what SVB reads
    biotac, digit : (B, K) what the mesh encoders read           force : (B, 3) N
    pressure : (B, 1) Pa                                         state : (B, STATE) of the contact, 0 without one
    signed : (B,) rows, SILENT where the signal has lost its sign: such a signal fits several places
    """

    rows: np.ndarray
    signed: np.ndarray
    signal: Tensor
    biotac: Tensor
    digit: Tensor
    force: Tensor
    pressure: Tensor
    state: Tensor


class Contacts:
    """Contacts with their split and both surfaces. SILENT is the number of no contact, C + i of contact i in a mirror.

    electrodes : how many a signal has; rest : (e,) counts that their changes are those of
    device : where batches go; the contacts themselves stay in the host's memory
    """

    def __init__(
        self, pairs: Pairs, split: Split, options: Options, frames: dict[str, ContactFrame], generator: torch.Generator,
        device: torch.device | None = None,
    ) -> None:  # fmt: skip
        self.pairs, self.split, self.options = pairs, split, options
        self.device = device or torch.device("cpu")
        self.depth = _depth(pairs)
        self.electrodes, self.rest = pairs.signal.shape[1], rest_counts(pairs.pair[0])
        self.biotac, self.digit = (
            SurfaceCodec(
                getattr(pairs, f"displacement_{name}"), getattr(pairs, f"scale_{name}"), split.train, frames[name],
                getattr(options, f"wide_{name}"), getattr(options, f"near_{name}"), generator,
                mirrored=options.mirrored > 0,
            )
            for name in ("biotac", "digit")
        )  # fmt: skip

    def with_silence(self, rows: np.ndarray) -> np.ndarray:
        """Return the rows and, behind them, the share of silent samples."""
        return np.concatenate([rows, np.full(max(1, round(self.options.silence * len(rows))), SILENT)])

    def drawn(self, rng: np.random.Generator) -> np.ndarray:
        """Draw the contacts of an epoch, in its order: contacts of the split or their mirror images, and silence."""
        rows = rng.permutation(self.with_silence(self.split.train))
        turned = (rng.random(len(rows)) < self.options.mirrored) & (rows != SILENT)
        return rows + turned * len(self.pairs.press)

    def read(self, rows: np.ndarray, rng: np.random.Generator, rectified: float = 0.0, unit: float = 0.0) -> np.ndarray:
        """Simulate signals (B, 20) of the contacts as a sensor reads them: see `noise_model.measured`."""
        at, turned = self._which(rows)
        true = self.pairs.signal[at] * (rows != SILENT)[:, None]
        true[turned] = true[turned][:, image_of_electrodes(self.pairs.pair[0])]
        return measured(true, rng, self.options, rectified, unit, self.rest)

    def batch(self, rows: np.ndarray, signal: np.ndarray) -> Batch:
        """Return the contacts of these rows with these signals."""
        at, turned = self._which(rows)
        force = self.pairs.force[at]
        force[turned] = across(force[turned])
        load = torch.from_numpy(force) * touching(rows)
        pressure = torch.from_numpy(self.pairs.pressure[at])[:, None] * touching(rows)
        scaled = np.stack([np.linalg.norm(force, axis=-1) / FORCE_SCALE, self.depth[at] / DEPTH_SCALE], -1)
        strength = torch.from_numpy(np.arcsinh(scaled).astype(np.float32)) * touching(rows)
        state = torch.cat([self.digit.true_place(rows), strength], -1)
        read = torch.from_numpy(signal), self.biotac.inputs(rows), self.digit.inputs(rows), load, pressure, state
        signed = np.where(signal[:, -1] > 0, SILENT, rows)
        return Batch(rows, signed, *(each.to(self.device) for each in read))

    def _which(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rows (B,) of the pairs, 0 for silent ones, and which (B,) are mirrored."""
        contacts = len(self.pairs.press)
        return np.maximum(rows, 0) % contacts, rows >= contacts


def _depth(pairs: Pairs) -> np.ndarray:
    """Depth (C,) float32 m of each contact's deepest node of the gel."""
    return pairs.displacement_digit[:, :, 1].max(1) * np.float32(pairs.scale_digit)
