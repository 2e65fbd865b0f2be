"""Contacts in the form that a training step needs: simulated readings of a sensor, surfaces' codes, forces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from ..mechanics.electrodes.biotac_sheet import rest_counts
from ..sensors import COUNT_SIGN, PAIR, REST_COUNTS
from ..sensors.readout import converted
from ..simulation.pairs_file import Pairs, Split
from ..translation.contact_frame import ContactFrame
from ..translation.posterior import DEPTH_SCALE, FORCE_SCALE
from .options import Options
from .surface_codec import SILENT, SurfaceCodec, across, image_of_electrodes, touching


@dataclass(frozen=True)
class Batch:
    """A batch of B contacts of e electrodes.

    rows : (B,) contact indices; SILENT for none, C + i for the mirror image of contact i
    signed : (B,) rows, with SILENT for signals that have lost their signs: such a signal fits several places
    signal : (B, e + 1) counts, and 1 if rectified; biotac, digit : (B, K + 4) inputs of the mesh encoders
    force : (B, 3) N; pressure : (B, 1) Pa; state : (B, STATE) of the contact, 0 without one"""

    rows: np.ndarray
    signed: np.ndarray
    signal: Tensor
    biotac: Tensor
    digit: Tensor
    force: Tensor
    pressure: Tensor
    state: Tensor


class Contacts:
    """C training pairs and their split, with both surfaces' codes. Row i < C is contact i, row C + i its mirror image,
    row SILENT no contact. frames : `ContactFrame` of "biotac" (the source) and of "digit" (the target)
    biotac, digit : their `SurfaceCodec`; generator : of the random numbers with which the codecs' bases start
    electrodes : how many a signal has; rest : (e,) counts, of the sensor at rest; depth : (C,) m, of the gel's dent
    device : that batches go to; the contacts themselves stay in the host's memory"""

    def __init__(
        self, pairs: Pairs, split: Split, options: Options, frames: dict[str, ContactFrame], generator: torch.Generator,
        device: torch.device | None = None,
    ) -> None:  # fmt: skip
        self.pairs, self.split, self.options = pairs, split, options
        self.device = device or torch.device("cpu")
        self.depth = pairs.displacement_digit[:, :, 1].max(1) * np.float32(pairs.scale_digit)
        self.electrodes, self.rest = pairs.signal.shape[1], rest_counts(pairs.pair[0])
        self.biotac, self.digit = (
            SurfaceCodec(
                getattr(pairs, f"displacement_{name}"), getattr(pairs, f"scale_{name}"), split.train, frames[name],
                getattr(options, f"wide_{name}"), getattr(options, f"near_{name}"), generator,
                mirrored=options.mirrored > 0,
            )
            for name in PAIR
        )  # fmt: skip

    def with_silence(self, rows: np.ndarray) -> np.ndarray:
        """Return rows (B,) with SILENT appended, ``options.silence`` times their number and at least once."""
        return np.concatenate([rows, np.full(max(1, round(self.options.silence * len(rows))), SILENT)])

    def drawn(self, rng: np.random.Generator) -> np.ndarray:
        """Draw an epoch's rows (B,): training contacts in random order, some mirrored, and silent samples among
        them."""
        rows = rng.permutation(self.with_silence(self.split.train))
        turned = (rng.random(len(rows)) < self.options.mirrored) & (rows != SILENT)
        return rows + turned * len(self.pairs.press)

    def read(self, rows: np.ndarray, rng: np.random.Generator, rectified: float = 0.0, unit: float = 0.0) -> np.ndarray:
        """Simulate the readings (B, e + 1) of rows (B,): e changes in counts and, last, 1 if they are rectified.
        rectified, unit : as in `measured`"""
        at, turned = self._which(rows)
        true = self.pairs.signal[at] * (rows != SILENT)[:, None]
        true[turned] = true[turned][:, image_of_electrodes(self.pairs.pair[0])]
        return measured(true, rng, self.options, rectified, unit, self.rest)

    def batch(self, rows: np.ndarray, signal: np.ndarray) -> Batch:
        """Return the `Batch` of rows (B,), as in the class; signal : (B, e + 1) their readings by `read`"""
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
        """Return the pairs' indices (B,) of rows (B,), 0 for silent samples, and a mask (B,) of those mirrored."""
        contacts = len(self.pairs.press)
        return np.maximum(rows, 0) % contacts, rows >= contacts


def measured(
    change: np.ndarray, rng: np.random.Generator, options: Options, rectified: float = 0.0, unit: float = 0.0,
    rest_counts: np.ndarray = REST_COUNTS,
) -> np.ndarray:  # fmt: skip
    """Simulate what e electrodes read (B, e + 1) of a true change (B, e) counts: the change, and 1 if it is rectified.

    Rectified changes get the sign of a thinning film, as the networks read them. Simulated are a gain error for each
    channel, noise, whole counts and the ends of 12 bits. The rest lies near that of a typical unit, ``rest_counts``
    (e,), and between whole counts, like the mean of many readings.
    unit : share of frames with a real unit's uncertainty: wider gains, an error of the rest
    rectified : share of frames that lose their sign, like those of unknown units, whose tare cannot be corrected after
        rectifying: wider gains, an error of the rest, missing channels
    Frames of either share also have an error in proportion to their size: no simulated contact is quite a real one."""
    folded = rng.random((len(change), 1)) < rectified
    gain = 1.0 + options.gain * rng.standard_normal(change.shape)
    rest = rest_counts + rng.random(change.shape)
    noise = options.noise * rng.standard_normal(change.shape)
    real = rng.random((len(change), 1)) < unit
    if unit:
        gain = np.where(real, np.exp(options.unit_gain * rng.standard_normal(change.shape)), gain)
        noise += real * options.unit_offset * rng.standard_normal(change.shape)
    if rectified:
        strange = np.exp(options.rectified_gain * rng.standard_normal(change.shape))
        strange *= rng.random(change.shape) >= options.rectified_missing
        gain = np.where(folded, strange, gain)
        noise += folded * options.rectified_offset * rng.standard_normal(change.shape)
    if unit or rectified:
        size = np.linalg.norm(change, axis=1, keepdims=True)
        noise += (real | folded) * options.misfit * size * rng.standard_normal(change.shape)
    found = converted(rest + gain * change + noise) - rest
    found = np.where(folded, COUNT_SIGN * np.abs(found), found)
    return np.concatenate([found, folded], -1).astype(np.float32)
