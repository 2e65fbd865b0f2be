"""A few hundred typical signals of the training's simulated contacts, for `tactile adapt` to match. They ship with the
weights as ``signals.safetensors``, whose hash is in the card under "signals"."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import TactileError
from ..recordings.unit.gain_matching import match
from ..sensors import electrode_count
from ..sensors.readout import NOISE
from . import weights
from .card import pair_of
from .layers import compress, expand

FILE = "signals.safetensors"
COUNT = 512  # typical signals; fewer are worse (gains of 30 % found to 16-20 % with 256, to 10-12 % with 512 and more)
FEWEST = 16  # of them: from fewer contacts nothing can be matched (assumed)
TOUCHING = 15.0  # counts, root of the sum of squares: ten times the noise; below, a signal says nothing about gains
TURNS = 15  # of k-means; more change nothing that matters
MOST = 10_000  # signals that k-means looks at
TRIES = 2_000  # readings made up to find the match's own bias


@dataclass(frozen=True, eq=False)
class ReferenceSignals:
    """Typical signals of simulated contacts, and the bias of matching readings to them.
    typical : (P, 19) counts, signed
    bias_signed, bias_rectified : (19,), log gains that matching finds even for the simulated contacts' own readings,
        signed or rectified: a typical signal is a mean of signals and therefore smaller than they are"""

    typical: np.ndarray
    bias_signed: np.ndarray
    bias_rectified: np.ndarray

    def bias(self, rectified: bool) -> np.ndarray:
        """Return the log gain (19,) to subtract from a match: of rectified readings if true, else of signed ones."""
        return self.bias_rectified if rectified else self.bias_signed


def touching(change: np.ndarray) -> np.ndarray:
    """Mark (n,) bool the frames of change (n, 19) counts that are large enough to determine gains."""
    return np.sqrt(np.square(change).sum(axis=1)) >= TOUCHING


def make(signal: np.ndarray, seed: int = 0) -> ReferenceSignals:
    """Return typical signals of simulated contacts, by k-means in the networks' scale. Raises TactileError for too few.
    signal : (C, 19) counts, the contacts' changes without noise; seed : of the random choices"""
    random = np.random.default_rng(seed)
    signal = np.asarray(signal, np.float64)
    signal = signal[touching(signal)]
    if len(signal) < 2 * FEWEST:
        raise TactileError("typical signals", f"{len(signal)} contacts", f"at least {2 * FEWEST}", "Make more pairs")
    chosen = compress(signal[random.permutation(len(signal))[:MOST]]).astype(np.float64)
    typical = expand(_k_means(chosen, random)).astype(np.float16).astype(np.float64)
    read = signal[random.integers(len(signal), size=TRIES)] + NOISE * random.standard_normal((TRIES, signal.shape[1]))
    bias = [
        match(np.abs(read) if rectified else read, typical, rectified, prior=0.01).log_gain
        for rectified in (False, True)
    ]
    return ReferenceSignals(typical, *bias)


def _k_means(points: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Return centres (p, 19) of points (n, 19) by Lloyd's k-means; p is COUNT, or n / 2 if that is less."""
    count = min(COUNT, len(points) // 2)
    centres = points[random.choice(len(points), count, replace=False)]
    for _ in range(TURNS):
        near = (np.square(centres).sum(axis=1) - 2 * points @ centres.T).argmin(axis=1)
        sums = np.zeros_like(centres)
        np.add.at(sums, near, points)
        held = np.bincount(near, minlength=count)
        centres = np.where(held[:, None] > 0, sums / np.maximum(held, 1)[:, None], centres)
    return centres


def write(folder: str | os.PathLike, signals: ReferenceSignals) -> dict:
    """Write ``signals.safetensors`` into a weights folder; return the card's entry: count, file, sha256, unit."""
    arrays: dict[str, np.ndarray] = {
        "typical": signals.typical.astype(np.float16),
        "bias.signed": signals.bias_signed.astype(np.float32),
        "bias.rectified": signals.bias_rectified.astype(np.float32),
    }
    data = weights.to_safetensors(arrays)
    weights.write_bytes(Path(folder) / FILE, data)
    return {"count": len(signals.typical), "file": FILE, "sha256": weights.sha256(data), "unit": "counts"}


def read(folder: str | os.PathLike) -> ReferenceSignals:
    """Read the typical signals of a weights folder. Raises TactileError for a card without them, or a file that is
    missing, changed or of another shape."""
    card, _ = weights.read_card(folder)
    entry: Any = card.get("signals")
    whole = isinstance(entry, dict) and isinstance(entry.get("sha256"), str)
    if not whole or type(entry.get("count")) is not int or not 0 < entry["count"] <= MOST:
        where = f"{Path(folder) / weights.CARD_NAME}, signals"
        raise TactileError(where, "no typical signals", "their count and sha256", weights.ADVICE)
    electrodes = electrode_count(pair_of(card, Path(folder) / weights.CARD_NAME)[0])
    shapes = {"typical": (entry["count"], electrodes), "bias.signed": (electrodes,), "bias.rectified": (electrodes,)}
    arrays = weights.read_verified(Path(folder) / FILE, entry["sha256"], shapes)
    for name, array in arrays.items():
        if not np.isfinite(array).all():
            raise TactileError(f"{Path(folder) / FILE}, {name}", "nan or infinite", "finite numbers", weights.ADVICE)
    names = ("typical", "bias.signed", "bias.rectified")
    return ReferenceSignals(*(arrays[name].astype(np.float64) for name in names))
