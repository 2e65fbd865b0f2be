"""The building blocks of the networks in numpy, float32: each with the tensor names and the arithmetic of torch."""

from __future__ import annotations

import numpy as np

Tensors = dict[str, np.ndarray]
NORM_EPSILON = 1e-5  # torch.nn.LayerNorm's default


def linear(x: np.ndarray, tensors: Tensors, name: str) -> np.ndarray:
    """Map x (T, inputs) to (T, outputs); weight (outputs, inputs) as in torch."""
    return x @ tensors[f"{name}.weight"].T + tensors[f"{name}.bias"]


def layer_norm(x: np.ndarray, tensors: Tensors, name: str) -> np.ndarray:
    """Normalise the last axis (Ba et al. 2016), biased variance as in torch."""
    centred = x - _mean(x)
    spread = np.sqrt(_mean(np.square(centred)) + np.float32(NORM_EPSILON))
    return centred / spread * tensors[f"{name}.weight"] + tensors[f"{name}.bias"]


def _mean(x: np.ndarray) -> np.ndarray:
    """Average over the last axis; `np.mean`'s checks cost more than the sum for a single frame."""
    return np.add.reduce(x, axis=-1, keepdims=True) / np.float32(x.shape[-1])


def silu(x: np.ndarray) -> np.ndarray:
    """Compute x * sigmoid(x), written with tanh because exp overflows for large negative x."""
    return x * (np.float32(0.5) * (np.float32(1.0) + np.tanh(np.float32(0.5) * x)))


def plain(x: np.ndarray, tensors: Tensors, name: str, layers: int) -> np.ndarray:
    """Apply linear layers with ReLU between them."""
    for layer in range(layers):
        x = linear(np.maximum(x, 0) if layer else x, tensors, f"{name}.{layer}")
    return x


def residual(x: np.ndarray, tensors: Tensors, name: str, blocks: int) -> np.ndarray:
    """Apply a residual MLP with a linear skip from input to output (docs/sources.md, Networks)."""
    hidden = linear(x, tensors, f"{name}.first")
    for block in range(blocks):
        inner = layer_norm(hidden, tensors, f"{name}.blocks.{block}.norm")
        inner = silu(linear(inner, tensors, f"{name}.blocks.{block}.up"))
        hidden = hidden + linear(inner, tensors, f"{name}.blocks.{block}.down")
    out = linear(layer_norm(hidden, tensors, f"{name}.norm"), tensors, f"{name}.last")
    return out + x @ tensors[f"{name}.skip.weight"].T


def plain_shapes(name: str, sizes: tuple[int, ...]) -> dict[str, tuple[int, ...]]:
    """Return the tensor shapes of `plain` with these layer sizes."""
    shapes: dict[str, tuple[int, ...]] = {}
    for layer, (inputs, outputs) in enumerate(zip(sizes[:-1], sizes[1:], strict=True)):
        shapes |= {f"{name}.{layer}.weight": (outputs, inputs), f"{name}.{layer}.bias": (outputs,)}
    return shapes


def residual_shapes(name: str, inputs: int, outputs: int, width: int, blocks: int) -> dict[str, tuple[int, ...]]:
    """Return the tensor shapes of `residual`."""
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
