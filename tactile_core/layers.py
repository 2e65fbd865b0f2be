"""The building blocks of the networks in numpy, float32: each with the tensor names and the arithmetic of torch."""

from __future__ import annotations

import numpy as np

Tensors = dict[str, np.ndarray]
NORM_EPSILON = 1e-5  # torch.nn.LayerNorm's default


def linear(x: np.ndarray, tensors: Tensors, name: str) -> np.ndarray:
    """x (T, inputs) -> (T, outputs); weight (outputs, inputs) as torch keeps it."""
    return x @ tensors[f"{name}.weight"].T + tensors[f"{name}.bias"]


def normalised(x: np.ndarray) -> np.ndarray:
    """(T, width) less its mean over its spread: the layer norm of Ba et al. 2016 with torch's biased variance, but for
    scale and shift."""
    centred = x - _mean(x)
    centred /= np.sqrt(_mean(np.square(centred)) + np.float32(NORM_EPSILON))
    return centred


def _mean(x: np.ndarray) -> np.ndarray:
    """Over the last axis; `np.mean` without its checks, which cost a single frame more than the sum does."""
    return np.add.reduce(x, axis=-1, keepdims=True) / np.float32(x.shape[-1])


def silu(x: np.ndarray) -> np.ndarray:
    """x * sigmoid(x), written with tanh because exp overflows for large negative x."""
    half = np.float32(0.5) * x
    return half * np.tanh(half) + half


def plain(x: np.ndarray, tensors: Tensors, name: str, layers: int) -> np.ndarray:
    """Linear layers with ReLU between them."""
    for layer in range(layers):
        x = linear(np.maximum(x, 0) if layer else x, tensors, f"{name}.{layer}")
    return x


class Residual:
    """A residual MLP with a linear skip from input to output (networks.md), ready to run.

    Scale and shift of each layer norm are folded into the linear layer after it, and the first layer stands beside the
    skip: fewer passes over few numbers, which is what a frame alone waits for.
    tensors : under the names of torch's module, ``name`` before them; blocks : as many as the module has
    """

    def __init__(self, tensors: Tensors, name: str, blocks: int) -> None:
        first = tensors[f"{name}.first.weight"]
        self._width, self._first_bias = len(first), tensors[f"{name}.first.bias"]
        self._first_and_skip = np.concatenate([first, tensors[f"{name}.skip.weight"]])
        self._blocks = [
            (
                *_folded(tensors, f"{name}.blocks.{block}.norm", f"{name}.blocks.{block}.up"),
                tensors[f"{name}.blocks.{block}.down.weight"],
                tensors[f"{name}.blocks.{block}.down.bias"],
            )
            for block in range(blocks)
        ]
        self._last = _folded(tensors, f"{name}.norm", f"{name}.last")

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """x (T, inputs) -> (T, outputs)."""
        both = x @ self._first_and_skip.T
        hidden, skip = both[:, : self._width] + self._first_bias, both[:, self._width :]
        for up, up_bias, down, down_bias in self._blocks:
            inner = normalised(hidden) @ up.T
            inner += up_bias
            hidden += silu(inner) @ down.T
            hidden += down_bias
        last, last_bias = self._last
        return normalised(hidden) @ last.T + last_bias + skip


def _folded(tensors: Tensors, norm: str, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Weight (outputs, inputs) and bias (outputs,) of a linear layer that takes what a layer norm scales and shifts."""
    weight = tensors[f"{name}.weight"].astype(np.float64)
    shift = weight @ tensors[f"{norm}.bias"] + tensors[f"{name}.bias"]
    return (weight * tensors[f"{norm}.weight"]).astype(np.float32), shift.astype(np.float32)


def plain_shapes(name: str, sizes: tuple[int, ...]) -> dict[str, tuple[int, ...]]:
    """Tensor shapes of `plain` with these layer sizes."""
    shapes: dict[str, tuple[int, ...]] = {}
    for layer, (inputs, outputs) in enumerate(zip(sizes[:-1], sizes[1:], strict=True)):
        shapes |= {f"{name}.{layer}.weight": (outputs, inputs), f"{name}.{layer}.bias": (outputs,)}
    return shapes


def residual_shapes(name: str, inputs: int, outputs: int, width: int, blocks: int) -> dict[str, tuple[int, ...]]:
    """Tensor shapes of `Residual`."""
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
