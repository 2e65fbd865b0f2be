"""The scale on which networks read signals, and their building blocks in numpy, float32: names and sums are torch's."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..errors import TactileError

Pass = Callable[[np.ndarray], np.ndarray]  # a block of frames through a network
BLOCK = 64  # frames per block: enough for matrix products at full speed
Tensors = dict[str, np.ndarray]
COUNT_SCALE = 15.0  # counts: noise of 1.5 counts over a gain error of 10 %, see `compress`
COMPRESSED_LIMIT = 8.0  # arcsinh(4095 / 15) is 6.3: no 12-bit reading lies outside, and sinh cannot overflow
NORM_EPSILON = 1e-5  # torch.nn.LayerNorm's default


class SignalDistance(NamedTuple):
    """Distances of signals from the training signals; the card holds quantiles of each.

    mahalanobis : (T,) float32, Mahalanobis distance of the signal's latent from the training latents
    residual : (T,) float32, rms over electrodes of the signal autoencoder's (SVB's) error over its rms in validation
    largest : (T,) float32, counts, largest absolute change of an electrode"""

    mahalanobis: np.ndarray
    residual: np.ndarray
    largest: np.ndarray


DISTANCES = SignalDistance._fields


def compress(change: np.ndarray) -> np.ndarray:
    """Convert change (...) counts to the networks' scale: arcsinh(change / 15 counts).

    A reading s has a noise variance of 1.5^2 + (0.1 s)^2 counts^2 (training augmentation); arcsinh(s / 15) is the
    variance-stabilising transform of that law (Bartlett 1947), so a light touch weighs as much as a firm one."""
    return np.arcsinh(np.asarray(change, np.float32) / np.float32(COUNT_SCALE))


def expand(compressed: np.ndarray) -> np.ndarray:
    """Convert compressed changes (...) back to counts: inverse of `compress`."""
    return np.sinh(np.clip(compressed, -COMPRESSED_LIMIT, COMPRESSED_LIMIT)) * np.float32(COUNT_SCALE)


def linear(x: np.ndarray, tensors: Tensors, name: str) -> np.ndarray:
    """Map x (T, inputs) to (T, outputs) by tensors `name`.weight (outputs, inputs), as in torch, and `name`.bias."""
    return x @ tensors[f"{name}.weight"].T + tensors[f"{name}.bias"]


def layer_norm(x: np.ndarray, tensors: Tensors, name: str) -> np.ndarray:
    """Normalise x (..., width) over its last axis (Ba et al. 2016), with torch's biased variance; tensors : hold
    `name`.weight and `name`.bias (width,)"""
    centred = x - _mean(x)
    spread = np.sqrt(_mean(np.square(centred)) + np.float32(NORM_EPSILON))
    return centred / spread * tensors[f"{name}.weight"] + tensors[f"{name}.bias"]


def _mean(x: np.ndarray) -> np.ndarray:
    """Average x over its last axis, which is kept; for a single frame `np.mean`'s checks cost more than the sum."""
    return np.add.reduce(x, axis=-1, keepdims=True) / np.float32(x.shape[-1])


def silu(x: np.ndarray) -> np.ndarray:
    """Compute x * sigmoid(x) of any shape, written with tanh because exp overflows for large negative x."""
    return x * (np.float32(0.5) * (np.float32(1.0) + np.tanh(np.float32(0.5) * x)))


def plain(x: np.ndarray, tensors: Tensors, name: str, layers: int) -> np.ndarray:
    """Apply linear layers with ReLU between them to x (T, inputs); return (T, outputs). tensors : see `plain_shapes`"""
    for layer in range(layers):
        x = linear(np.maximum(x, 0) if layer else x, tensors, f"{name}.{layer}")
    return x


def residual(x: np.ndarray, tensors: Tensors, name: str, blocks: int) -> np.ndarray:
    """Apply a residual MLP (docs/sources.md, Networks) of ``blocks`` and a linear skip to x (T, inputs); return (T,
    outputs). tensors : by `residual_shapes`' names"""
    hidden = linear(x, tensors, f"{name}.first")
    for block in range(blocks):
        inner = layer_norm(hidden, tensors, f"{name}.blocks.{block}.norm")
        inner = silu(linear(inner, tensors, f"{name}.blocks.{block}.up"))
        hidden = hidden + linear(inner, tensors, f"{name}.blocks.{block}.down")
    out = linear(layer_norm(hidden, tensors, f"{name}.norm"), tensors, f"{name}.last")
    return out + x @ tensors[f"{name}.skip.weight"].T


def plain_shapes(name: str, sizes: tuple[int, ...]) -> dict[str, tuple[int, ...]]:
    """Return `plain`'s tensors' shapes by name; name : their prefix; sizes : of inputs, then each layer's outputs"""
    shapes: dict[str, tuple[int, ...]] = {}
    for layer, (inputs, outputs) in enumerate(zip(sizes[:-1], sizes[1:], strict=True)):
        shapes |= {f"{name}.{layer}.weight": (outputs, inputs), f"{name}.{layer}.bias": (outputs,)}
    return shapes


def residual_shapes(name: str, inputs: int, outputs: int, width: int, blocks: int) -> dict[str, tuple[int, ...]]:
    """Return `residual`'s tensors' shapes by name; name : their prefix; inputs, outputs, width, blocks : its sizes"""
    shapes: dict[str, tuple[int, ...]] = {
        f"{name}.first.weight": (width, inputs),
        f"{name}.last.weight": (outputs, width),
        f"{name}.last.bias": (outputs,),
        f"{name}.skip.weight": (outputs, inputs),
    }
    vectors = [f"{name}.first.bias", f"{name}.norm.weight", f"{name}.norm.bias"]
    for block in (f"{name}.blocks.{index}" for index in range(blocks)):
        shapes |= {f"{block}.up.weight": (width, width), f"{block}.down.weight": (width, width)}
        vectors += [f"{block}.{part}" for part in ("norm.weight", "norm.bias", "up.bias", "down.bias")]
    return shapes | {vector: (width,) for vector in vectors}


def in_blocks(function: Pass, x: np.ndarray, shape: tuple[int, ...], name: str) -> np.ndarray:
    """Apply a function to frames x (T, *shape) in blocks padded to equal length; a single frame is not padded. Raises
    TactileError, which calls the network `name`, if x has another shape."""
    x = np.asarray(x, np.float32)
    if x.shape[1:] != shape:
        expected = "(T, " + ", ".join(map(str, shape)) + ")"
        raise TactileError(f"networks, {name}", f"array of shape {x.shape}", expected, "Give frames first")
    if len(x) == 1:
        return function(x)
    out = np.empty(0, np.float32)
    for start in range(0, max(len(x), 1), BLOCK):  # an empty recording still gives a result its shape
        part = x[start : start + BLOCK]
        if len(part) < BLOCK:
            part = np.concatenate([part, np.zeros((BLOCK - len(part), *shape), np.float32)])
        result = function(part)[: len(x) - start]
        if start == 0:
            out = np.empty((len(x), *result.shape[1:]), np.float32)
        out[start : start + BLOCK] = result
    return out
