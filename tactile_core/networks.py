"""The five networks and the force estimate as numpy: what runs where there is no torch, Blender included.

Every network of `training/modules.py` has its forward pass here, with the same tensor names; float32 throughout.
SVB  signal autoencoder       MVB  BioTac mesh autoencoder       MVD  DIGIT mesh autoencoder
S2MPN  signal latent -> BioTac latent       M2MPN  BioTac latent -> DIGIT latent

Results are computed in blocks of `BLOCK` frames, padded with zeros, so that the same frame gives the same numbers alone
and in a recording: the matrix products then always have the same shape (equal bits with OpenBLAS as measured by the
tests' machines; where a BLAS splits work otherwise, equal to a relative 1e-5).
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .errors import TactileError
from .layers import Tensors, plain, plain_shapes, residual, residual_shapes
from .weights import ADVICE, CARD_NAME, read_card, read_verified

Pass = Callable[[np.ndarray], np.ndarray]  # a block of frames through a network
ELECTRODES = 19
SIGNAL_HIDDEN = (256, 128, 64)  # SVB of the authors' later code (sensors.md)
BLOCK = 16  # frames a block: small enough for single frames in Blender, large enough to use the cache
COUNT_SCALE = 15.0  # counts: noise of 1.5 counts over a gain error of 10 %, see `compress`
COMPRESSED_LIMIT = 8.0  # arcsinh(4095 / 15) is 6.3: no 12-bit reading lies outside, and sinh cannot overflow
NETS = ("SVB", "MVB", "S2MPN", "MVD", "M2MPN", "force")
WEIGHTS_FOLDER = Path(__file__).parent / "weights"
# The card names the hash of every file of weights; this names the card that ships.
SHIPPED_CARD_SHA256 = "996b98a35af216b0c2aee2244ffbd06ff200bcfa33a55ef023d5e4354b4fca10"
MAX_SIZE = 100_000  # of anything in a card: larger than any network here, small enough to refuse a damaged number


@dataclass(frozen=True)
class SignalDistance:
    """How far signals lie from those the networks were trained on; the card holds quantiles of each.

    mahalanobis : (T,) float32, distance of the signal latent to the training latents in their standard deviations
    residual : (T,) float32, what SVB cannot reproduce, rms over the electrodes in units of its residual in validation
    largest : (T,) float32, counts, largest absolute change of an electrode
    """

    mahalanobis: np.ndarray
    residual: np.ndarray
    largest: np.ndarray


def compress(change: np.ndarray) -> np.ndarray:
    """Counts -> the scale the networks see: arcsinh(change / 15 counts).

    A reading s has a noise variance of 1.5^2 + (0.1 s)^2 counts^2 (training augmentation); arcsinh(s / 15) is the
    variance-stabilising transform of that law (Bartlett 1947), so a light touch weighs as much as a firm one.
    """
    return np.arcsinh(np.asarray(change, np.float32) / np.float32(COUNT_SCALE))


def expand(compressed: np.ndarray) -> np.ndarray:
    """Inverse of `compress`, in counts."""
    return np.sinh(np.clip(compressed, -COMPRESSED_LIMIT, COMPRESSED_LIMIT)) * np.float32(COUNT_SCALE)


def tensor_shapes(net: str, sizes: dict[str, int]) -> dict[str, tuple[int, ...]]:
    """Tensor names and shapes of one network from the sizes in its card."""
    if net == "SVB":
        latent, hidden = sizes["latent"], SIGNAL_HIDDEN
        shapes = plain_shapes("encoder", (ELECTRODES, *hidden, 2 * latent))
        shapes |= plain_shapes("decoder", (latent, *hidden[::-1], ELECTRODES))
        shapes |= {"distance.mean": (latent,), "distance.whitening": (latent, latent)}
        return shapes | {"distance.residual": (ELECTRODES,)}
    width, blocks = sizes["width"], sizes["blocks"]
    if net in ("MVB", "MVD"):
        modes, latent = sizes["modes"], sizes["latent"]
        shapes = residual_shapes("encoder", modes, 2 * latent, width, blocks)
        shapes |= residual_shapes("decoder", latent, modes, width, blocks)
        return shapes | {"basis": (modes, 3 * sizes["nodes"]), "scale": (1,)}
    if net == "force" and sizes["compliance"]:
        return {"compliance": (sizes["inputs"], 3)}
    shapes = residual_shapes("map", sizes["inputs"], sizes["outputs"], width, blocks)
    return shapes | ({"scale": (1,)} if net == "force" else {})


SIZE_NAMES = {
    "SVB": ("latent",),
    "MVB": ("blocks", "latent", "modes", "nodes", "width"),
    "MVD": ("blocks", "latent", "modes", "nodes", "width"),
    "S2MPN": ("blocks", "inputs", "outputs", "width"),
    "M2MPN": ("blocks", "inputs", "outputs", "width"),
    "force": ("blocks", "compliance", "inputs", "outputs", "width"),
}


class Networks:
    """The trained networks. Arrays are float32, T first; displacements in metres, forces in newtons, changes in counts.

    tensors : network -> tensor name -> array
    card : the model card (see `training/export.py` for its fields)
    sha256 : hash of the card, which pins every file: the name of these weights
    """

    def __init__(self, tensors: dict[str, Tensors], card: dict, sha256: str = "") -> None:
        self.card, self.sha256 = card, sha256
        self.sizes: dict[str, dict[str, int]] = {net: card["nets"][net]["sizes"] for net in NETS}
        self.tensors = {
            net: {name: np.ascontiguousarray(array, np.float32) for name, array in tensors[net].items()} for net in NETS
        }

    def encode_signal(self, change: np.ndarray) -> np.ndarray:
        """change (T, 19) counts against rest -> latent_signal (T, 8), the mean of SVB's posterior."""
        return self._blocks(self._encode_signal, change, (ELECTRODES,), "encode_signal")

    def decode_signal(self, latent_signal: np.ndarray) -> np.ndarray:
        """latent_signal (T, 8) -> change (T, 19) counts as SVB understood them."""
        size = self.sizes["SVB"]["latent"]
        return self._blocks(lambda z: expand(self._decode_signal(z)), latent_signal, (size,), "decode_signal")

    def s2m(self, latent_signal: np.ndarray) -> np.ndarray:
        """latent_signal (T, 8) -> latent_biotac (T, L)."""
        return self._map("S2MPN", latent_signal)

    def m2m(self, latent_biotac: np.ndarray) -> np.ndarray:
        """latent_biotac (T, L) -> latent_digit (T, L')."""
        return self._map("M2MPN", latent_biotac)

    def encode_biotac(self, displacement: np.ndarray) -> np.ndarray:
        """displacement (T, N, 3) m of the BioTac's outer skin -> latent_biotac (T, L)."""
        return self._encode_mesh("MVB", displacement)

    def encode_digit(self, displacement: np.ndarray) -> np.ndarray:
        """displacement (T, M, 3) m of the DIGIT's gel -> latent_digit (T, L')."""
        return self._encode_mesh("MVD", displacement)

    def decode_biotac(self, latent_biotac: np.ndarray) -> np.ndarray:
        """latent_biotac (T, L) -> displacement (T, N, 3) m of the BioTac's outer skin."""
        return self._decode_mesh("MVB", latent_biotac)

    def decode_digit(self, latent_digit: np.ndarray) -> np.ndarray:
        """latent_digit (T, L') -> displacement (T, M, 3) m of the DIGIT's gel."""
        return self._decode_mesh("MVD", latent_digit)

    def force(self, latent_biotac: np.ndarray) -> np.ndarray:
        """latent_biotac (T, L) -> force (T, 3) N exerted by the object, sensor frame (the estimate the card names)."""
        return self._blocks(self._force, latent_biotac, (self.sizes["MVB"]["latent"],), "force")

    def signal_distance(self, change: np.ndarray) -> SignalDistance:
        """change (T, 19) counts -> how far each frame lies from the training signals."""
        distances = self._blocks(self._distance, change, (ELECTRODES,), "signal_distance")
        return SignalDistance(*np.ascontiguousarray(distances.T))

    def _encode_signal(self, change: np.ndarray) -> np.ndarray:
        hidden = plain(compress(change), self.tensors["SVB"], "encoder", len(SIGNAL_HIDDEN) + 1)
        return hidden[:, : self.sizes["SVB"]["latent"]]

    def _decode_signal(self, latent: np.ndarray) -> np.ndarray:
        return plain(latent, self.tensors["SVB"], "decoder", len(SIGNAL_HIDDEN) + 1)

    def _distance(self, change: np.ndarray) -> np.ndarray:
        tensors, latent = self.tensors["SVB"], self._encode_signal(change)
        steps = (latent - tensors["distance.mean"]) @ tensors["distance.whitening"]
        left = (self._decode_signal(latent) - compress(change)) / tensors["distance.residual"]
        largest = np.abs(change).max(-1)
        return np.stack([np.sqrt(np.square(steps).sum(-1)), np.sqrt(np.square(left).mean(-1)), largest], -1)

    def _force(self, latent: np.ndarray) -> np.ndarray:
        tensors, sizes = self.tensors["force"], self.sizes["force"]
        if sizes["compliance"]:
            return residual(latent, self.tensors["MVB"], "decoder", self.sizes["MVB"]["blocks"]) @ tensors["compliance"]
        return residual(latent, tensors, "map", sizes["blocks"]) * tensors["scale"]

    def _map(self, net: str, latent: np.ndarray) -> np.ndarray:
        tensors, sizes = self.tensors[net], self.sizes[net]
        return self._blocks(lambda z: residual(z, tensors, "map", sizes["blocks"]), latent, (sizes["inputs"],), net)

    def _encode_mesh(self, net: str, displacement: np.ndarray) -> np.ndarray:
        tensors, sizes = self.tensors[net], self.sizes[net]

        def encode(block: np.ndarray) -> np.ndarray:
            modes = block.reshape(len(block), -1) @ tensors["basis"].T / tensors["scale"]
            return residual(modes, tensors, "encoder", sizes["blocks"])[:, : sizes["latent"]]

        return self._blocks(encode, displacement, (sizes["nodes"], 3), f"{net} encoder")

    def _decode_mesh(self, net: str, latent: np.ndarray) -> np.ndarray:
        tensors, sizes = self.tensors[net], self.sizes[net]

        def decode(block: np.ndarray) -> np.ndarray:
            modes = residual(block, tensors, "decoder", sizes["blocks"]) * tensors["scale"]
            return (modes @ tensors["basis"]).reshape(len(block), -1, 3)

        return self._blocks(decode, latent, (sizes["latent"],), f"{net} decoder")

    def _blocks(self, function: Pass, x: np.ndarray, shape: tuple[int, ...], name: str) -> np.ndarray:
        """Apply a function in padded blocks of `BLOCK` frames; raises TactileError if x is not (T, *shape)."""
        x = np.asarray(x, np.float32)
        if x.shape[1:] != shape:
            expected = "(T, " + ", ".join(map(str, shape)) + ")"
            raise TactileError(f"networks, {name}", f"array of shape {x.shape}", expected, "Give frames first")
        out: np.ndarray | None = None
        for start in range(0, max(len(x), 1), BLOCK):  # an empty recording still tells the shape of its result
            part = x[start : start + BLOCK]
            padded = np.zeros((BLOCK, *shape), np.float32)
            padded[: len(part)] = part
            result = function(padded)[: len(part)]
            if out is None:
                out = np.empty((len(x), *result.shape[1:]), np.float32)
            out[start : start + BLOCK] = result
        return out


def load(folder: str | os.PathLike | None = None) -> Networks:
    """Read and verify a weights folder; None: the weights that ship with the package.

    raises: TactileError naming the file (found and expected sha256) or the tensor (found and expected shape)
    """
    shipped = folder is None
    folder = Path(WEIGHTS_FOLDER if shipped else folder)
    card, digest = read_card(folder)
    if shipped and digest != SHIPPED_CARD_SHA256:
        raise TactileError(folder / CARD_NAME, f"sha256 {digest}", SHIPPED_CARD_SHA256, ADVICE)
    tensors = {}
    for net in NETS:
        entry = _card_entry(card, net, folder / CARD_NAME)
        tensors[net] = read_verified(folder / f"{net}.safetensors", entry["sha256"], tensor_shapes(net, entry["sizes"]))
    _check_chain({net: card["nets"][net]["sizes"] for net in NETS}, folder / CARD_NAME)
    return Networks(tensors, card, digest)


def _card_entry(card: dict, net: str, path: Path) -> dict:
    """The card's entry for one network: its sha256 and sizes."""
    nets = card.get("nets")
    entry = nets.get(net) if isinstance(nets, dict) else None
    sizes = entry.get("sizes") if isinstance(entry, dict) else None
    names = SIZE_NAMES[net]
    whole = isinstance(sizes, dict) and sorted(sizes) == sorted(names)
    whole = whole and all(type(size) is int and 0 <= size <= MAX_SIZE for size in sizes.values())
    if not whole or not isinstance(entry.get("sha256"), str):
        expected = f"sha256 and the sizes {', '.join(names)} as whole numbers"
        raise TactileError(f"{path}, nets.{net}", "an incomplete entry", expected, ADVICE)
    return entry


def _check_chain(sizes: dict[str, dict[str, int]], path: Path) -> None:
    """The networks fit together: the latent one writes is the latent the next one reads."""
    force = "modes" if sizes["force"]["compliance"] else "latent"
    links = [
        ("S2MPN", "inputs", sizes["SVB"]["latent"]),
        ("S2MPN", "outputs", sizes["MVB"]["latent"]),
        ("M2MPN", "inputs", sizes["MVB"]["latent"]),
        ("M2MPN", "outputs", sizes["MVD"]["latent"]),
        ("force", "inputs", sizes["MVB"][force]),
        ("force", "outputs", 3),
    ]
    for net, size, expected in links:
        if sizes[net][size] != expected:
            raise TactileError(f"{path}, nets.{net}", f"{size} {sizes[net][size]}", f"{expected}", ADVICE)
