"""The networks of a translation in numpy, for machines without torch (Blender included).

Every network of `training/modules.py` has its forward pass here, with the same tensor names; float32 throughout.
  SVB  signal autoencoder       MVB  BioTac mesh autoencoder       MVD  DIGIT mesh autoencoder
  S2MPN  signal latent -> posterior over contacts (`Posterior`); with one of these -> BioTac latent
  M2MPN  BioTac latent -> DIGIT latent
  R2MPN  S2MPN for rectified signals: training for unknown units, which these need, would make S2MPN worse
  D2BPN  DIGIT latent -> BioTac latent        B2SPN  BioTac latent -> signal latent
  force  head on the BioTac latent            pressure, error  heads on the signal
  parts  signal -> the signals of two contacts at once; weights may lack it

Results are computed in blocks of `BLOCK` frames, padded with zeros, so that a frame gives the same numbers whatever
other frames are asked for: the matrix products then have the same shape (equal bits with OpenBLAS as measured on most
machines; equal to 1e-5 of the largest number where a BLAS rounds by a row's place in the block, as on some processors
without AVX-512). A single frame is computed alone, in a twentieth of the time, and is as equal."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from ..errors import TactileError
from ..files.shipped import shipped
from ..sensors import SOURCE, electrode_count
from .card import NETS, PARTS, PLACE, SIGNAL_HIDDEN, STATE, card_entry, check_chain, pair_of, tensor_shapes
from .contact_frame import ContactFrame
from .layers import COMPRESSED_LIMIT, SignalDistance, Tensors, compress, expand, in_blocks, plain, residual
from .posterior import FORCE_SCALE, Posterior
from .weights import ADVICE, CARD_NAME, read_card, read_verified

# Of a posterior's components, in units of the state: no place is known to .2 cells, no force to 2 % (assumed).
LEAST_SPREAD = 0.02
SPREAD_LIMITS = -8.0, 2.0  # of the logarithm of what a network adds to it
PRESSURE_SCALE = 300.0  # Pa: the pressure is 300 Pa sinh(head), likewise (assumed)
ERROR_UNIT = 10e-6  # m, of the error head's logarithm
WEIGHTS_FOLDER = shipped("weights")
# The card names the hash of every file of weights; this names the card that ships.
SHIPPED_CARD_SHA256 = "9fa2615fd2ff73ac79a38a53f32e45e1d1af0587d25167aeea3b684e27d7f28c"


class Networks:
    """The trained networks. Arrays are float32, T first; displacements in m, forces in N, changes in counts.

    tensors : arrays by network, then by tensor's name
    card : the model card: sizes, hashes, quantiles, bounds, errors; source, target : the sensors that it names
    electrodes : number of the source's electrodes; shapes below say 19, the BioTac's
    sha256 : hash of the card, which identifies these weights

    K, L, L' are the sizes of the latents of signal, source and target; N, M the nodes of source and target; a state is
    `Posterior`'s. In all methods change is counts less those at rest, and rectified, one bool for all frames or (T,),
    is true if change has lost its signs."""

    def __init__(self, tensors: dict[str, Tensors], card: dict, sha256: str = "") -> None:
        self.card, self.sha256 = card, sha256
        self.source, self.target = pair_of(card, CARD_NAME)
        self.sizes: dict[str, dict[str, int]] = {net: card["nets"][net]["sizes"] for net in tensors}
        self.electrodes = self.sizes["pressure"]["inputs"]
        self.tensors = {
            net: {name: np.ascontiguousarray(array, np.float32) for name, array in own.items()}
            for net, own in tensors.items()
        }
        self.frames = {"MVB": self._frame("MVB", self.source), "MVD": self._frame("MVD", self.target)}

    def _frame(self, net: str, sensor: str) -> ContactFrame:
        sizes = self.sizes[net]
        return ContactFrame(sizes["rows"], sizes["columns"], sizes["half"], self.tensors[net]["turn"], sensor)

    def encode_signal(self, change: np.ndarray, rectified: np.ndarray | bool = False) -> np.ndarray:
        """Return latent_signal (T, K), the mean that SVB infers from change (T, 19) counts, which is below 0 if a film
        thins or, by rectified (T,) bool or one for all, has no sign."""
        return in_blocks(self._encode_signal, *self._signal(change, rectified), "encode_signal")

    def decode_signal(self, latent_signal: np.ndarray) -> np.ndarray:
        """Decode latent_signal (T, K) to change (T, 19) counts: SVB's reconstruction."""
        size = self.sizes["SVB"]["latent"]
        return in_blocks(lambda z: expand(self._decode_signal(z)), latent_signal, (size,), "decode_signal")

    def contact(self, latent_signal: np.ndarray, rectified: np.ndarray | bool = False) -> np.ndarray:
        """Return the likeliest contact's state (T, STATE) by latent_signal (T, K); rectified : (T,) or one bool"""
        return self.posterior(latent_signal, rectified).likely

    def posterior(self, latent_signal: np.ndarray, rectified: np.ndarray | bool = False) -> Posterior:
        """Return the contact's posterior by latent_signal (T, K); rectified : (T,) or one bool"""
        raw = self._either("posterior", latent_signal, rectified)
        count = self.sizes["S2MPN"]["components"]
        weight = raw[:, :count] - raw[:, :count].max(-1, keepdims=True)
        mean, spread = np.moveaxis(raw[:, count:].reshape(len(raw), 2, count, STATE), 1, 0)
        spread = np.float32(LEAST_SPREAD) + np.exp(np.clip(spread, *SPREAD_LIMITS))
        return Posterior(np.exp(weight) / np.exp(weight).sum(-1, keepdims=True), mean, spread)

    def given(self, latent_signal: np.ndarray, state: np.ndarray, rectified: np.ndarray | bool = False) -> np.ndarray:
        """Return the latents (T, L) of the source's mesh, predicted from those of its signals, latent_signal (T, K),
        and the contact's state (T, STATE): place, force, depth. rectified : (T,) bool or one, signals without signs"""
        return self._either("code", np.concatenate([latent_signal, state], -1), rectified)

    def m2m(self, latent_source: np.ndarray) -> np.ndarray:
        """Map latent_source (T, L) to latent_target (T, L')."""
        return self._map_placed("M2MPN", "MVB", latent_source)

    def latents(
        self, latent_signal: np.ndarray, state: np.ndarray, rectified: np.ndarray | bool = False
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return latent_source, latent_target by latent_signal (T, K), state (T, STATE); rectified : (T,) or one
        bool"""
        latent_source = self.given(latent_signal, state, rectified)
        return latent_source, self.to_target(state, latent_source)

    def likely_latents(
        self, latent_signal: np.ndarray, rectified: np.ndarray | bool = False
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return `latents` of the likeliest contact, by latent_signal (T, K); rectified : (T,) or one bool"""
        return self.latents(latent_signal, self.contact(latent_signal, rectified), rectified)

    def to_target(self, state: np.ndarray, latent_source: np.ndarray) -> np.ndarray:
        """Map latent_source (T, L) to latent_target (T, L'), its place replaced by that of state (T, STATE)."""
        latent = self.m2m(latent_source)
        latent[:, :PLACE] = state[:, :PLACE]
        return latent

    def m2m_back(self, latent_target: np.ndarray) -> np.ndarray:
        """Map the DIGIT's latent_target (T, L') to the BioTac's latent_source (T, L)."""
        return self._map_placed("D2BPN", "MVD", latent_target)

    def m2s(self, latent_source: np.ndarray) -> np.ndarray:
        """Map latent_source (T, L) to latent_signal (T, K)."""
        return self._map_placed("B2SPN", "MVB", latent_source)

    def expected_error(self, change: np.ndarray, rectified: np.ndarray | bool = False) -> np.ndarray:
        """Return expected largest node errors (T, 2) m, BioTac and DIGIT, by change (T, 19); rectified : (T,) or one"""
        return in_blocks(self._expected_error, *self._signal(change, rectified), "expected_error")

    def encode_source(self, displacement: np.ndarray) -> np.ndarray:
        """Encode displacement (T, N, 3) m of the source's skin as latent_source (T, L)."""
        return self._encode_mesh("MVB", displacement)

    def encode_target(self, displacement: np.ndarray) -> np.ndarray:
        """Encode displacement (T, M, 3) m of the target's gel as latent_target (T, L')."""
        return self._encode_mesh("MVD", displacement)

    def decode_source(self, latent_source: np.ndarray) -> np.ndarray:
        """Decode latent_source (T, L) to displacement (T, N, 3) m of the source's skin."""
        return self._decode_mesh("MVB", latent_source)

    def decode_target(self, latent_target: np.ndarray) -> np.ndarray:
        """Decode latent_target (T, L') to displacement (T, M, 3) m of the target's gel."""
        return self._decode_mesh("MVD", latent_target)

    def force(self, latent_source: np.ndarray) -> np.ndarray:
        """Return the force (T, 3) N exerted by the object, sensor frame, from latent_source (T, L)."""
        return in_blocks(self._force, latent_source, (self.sizes["MVB"]["latent"],), "force")

    def force_in(self, state: np.ndarray, latent_source: np.ndarray) -> np.ndarray:
        """Return forces (T, 3) N: direction from latent_source (T, L), size from the contacts' state (T, STATE)."""
        estimate = self.force(latent_source)
        length = np.sqrt(np.square(estimate).sum(-1))
        size = np.float32(FORCE_SCALE) * np.sinh(np.clip(state[:, PLACE], 0, COMPRESSED_LIMIT))
        return estimate * (size / np.where(length > 0, length, 1))[:, None]

    def pressure(self, change: np.ndarray, rectified: np.ndarray | bool = False) -> np.ndarray:
        """Return the rise (T,) Pa of the fluid's pressure from change (T, 19) counts, rectified (T,) or one for all.
        For rectified frames it is proportional to the sum of changes: their pattern misleads if gains are unknown, as a
        real finger distributes its changes otherwise than a simulated one."""
        return in_blocks(self._pressure, *self._signal(change, rectified), "pressure")[:, 0]

    def signal_distance(self, change: np.ndarray, rectified: np.ndarray | bool = False) -> SignalDistance:
        """Return each frame's `SignalDistance` from the training, by change (T, 19); rectified : (T,) or one bool"""
        distances = in_blocks(self._distance, *self._signal(change, rectified), "signal_distance")
        return SignalDistance(*np.ascontiguousarray(distances.T))

    def _encode_signal(self, signal: np.ndarray) -> np.ndarray:
        seen = np.concatenate([compress(signal[:, :-1]), signal[:, -1:]], -1)
        hidden = plain(seen, self.tensors["SVB"], "encoder", len(SIGNAL_HIDDEN) + 1)
        return hidden[:, : self.sizes["SVB"]["latent"]]

    def _decode_signal(self, latent: np.ndarray) -> np.ndarray:
        return plain(latent, self.tensors["SVB"], "decoder", len(SIGNAL_HIDDEN) + 1)

    def _distance(self, signal: np.ndarray) -> np.ndarray:
        tensors, latent, change = self.tensors["SVB"], self._encode_signal(signal), signal[:, :-1]
        steps = (latent - tensors["distance.mean"]) @ tensors["distance.whitening"]
        left = (self._decode_signal(latent) - compress(change)) / tensors["distance.residual"]
        largest = np.abs(change).max(-1)
        return np.stack([np.sqrt(np.square(steps).sum(-1)), np.sqrt(np.square(left).mean(-1)), largest], -1)

    def _expected_error(self, signal: np.ndarray) -> np.ndarray:
        latent, change = self._encode_signal(signal), compress(signal[:, :-1])
        rest = self._decode_signal(latent) - change
        features = [np.sqrt(np.square(each).mean(-1, keepdims=True)) for each in (rest, change)]
        seen = np.concatenate([latent, *features, signal[:, -1:]], -1)
        head = residual(seen, self.tensors["error"], "map", self.sizes["error"]["blocks"])
        return np.float32(ERROR_UNIT) * np.exp(np.clip(head, -COMPRESSED_LIMIT, COMPRESSED_LIMIT))

    def _force(self, latent: np.ndarray) -> np.ndarray:
        head = residual(latent, self.tensors["force"], "map", self.sizes["force"]["blocks"])
        return np.float32(FORCE_SCALE) * np.sinh(np.clip(head, -COMPRESSED_LIMIT, COMPRESSED_LIMIT))

    def _pressure(self, signal: np.ndarray) -> np.ndarray:
        change, tensors = signal[:, :-1], self.tensors["pressure"]
        head = residual(compress(change), tensors, "map", self.sizes["pressure"]["blocks"])
        signed = np.float32(PRESSURE_SCALE) * np.sinh(np.clip(head, -COMPRESSED_LIMIT, COMPRESSED_LIMIT))
        rectified = tensors["rectified"] * np.abs(change).sum(-1, keepdims=True)
        return np.where(signal[:, -1:] > 0, rectified, signed)

    def _either(self, part: str, seen: np.ndarray, rectified: np.ndarray | bool) -> np.ndarray:
        """Apply one part of S2MPN, or for rectified frames of R2MPN, to its inputs `seen` (T, inputs).
        part : "posterior" or "code"; rectified : (T,) or one, true if the signs are lost"""
        which = np.broadcast_to(np.asarray(rectified, bool), len(seen))
        if which.all() and len(which):
            return self._map("R2MPN", seen, part)
        found = self._map("S2MPN", seen, part)
        if which.any():
            found[which] = self._map("R2MPN", seen, part)[which]
        return found

    def _map(self, net: str, latent: np.ndarray, part: str) -> np.ndarray:
        tensors, blocks = self.tensors[net], self.sizes[net]["blocks"]
        size = tensors[f"{part}.first.weight"].shape[1]
        return in_blocks(lambda z: residual(z, tensors, part, blocks), latent, (size,), net)

    def _map_placed(self, net: str, vae: str, latent: np.ndarray) -> np.ndarray:
        """Map latent (T, L) by the network `net`, which also reads what is left of the place after rounding to cells.
        vae : the autoencoder of that latent, "MVB" (BioTac) or "MVD" (DIGIT)"""
        tensors, blocks = self.tensors[net], self.sizes[net]["blocks"]
        size = self.sizes[vae]["latent"]
        return in_blocks(lambda z: residual(self._placed(vae, z)[0], tensors, "map", blocks), latent, (size,), net)

    def _placed(self, net: str, latent: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Append to latent (B, L) what is left of its place after rounding to cells; return (B, L + 2) and the cells
        (B, 2). net : the latent's autoencoder"""
        cells, left = self.frames[net].cells(latent[:, :PLACE])
        return np.concatenate([latent, left], -1), cells

    def _encode_mesh(self, net: str, displacement: np.ndarray) -> np.ndarray:
        tensors, sizes, frame = self.tensors[net], self.sizes[net], self.frames[net]

        def encode(block: np.ndarray) -> np.ndarray:
            """Encode block (BLOCK, n, 3) m, u: wide = W u, near = N window(u - W^T wide), scaled, with the place."""
            local = frame.to_local(block)
            place = frame.place(local)
            cells, left = frame.cells(place)
            wide = local.reshape(len(local), -1) @ tensors["wide"].T
            rest = local - (wide @ tensors["wide"]).reshape(local.shape)
            near = frame.windows(rest, cells).reshape(len(local), -1) @ tensors["near"].T
            inputs = np.concatenate([np.concatenate([wide, near], -1) / tensors["scale"], place, left], -1)
            code = residual(inputs, tensors, "encoder", sizes["blocks"])[:, : sizes["latent"] - PLACE]
            return np.concatenate([place, code], -1)

        return in_blocks(encode, displacement, (sizes["nodes"], 3), f"{net} encoder")

    def _decode_mesh(self, net: str, latent: np.ndarray) -> np.ndarray:
        tensors, sizes, frame = self.tensors[net], self.sizes[net], self.frames[net]

        def decode(block: np.ndarray) -> np.ndarray:
            """Decode block (BLOCK, L) of latents to W^T wide + N^T near, the latter in the window around the place."""
            placed, cells = self._placed(net, block)
            modes = residual(placed, tensors, "decoder", sizes["blocks"]) * tensors["scale"]
            wide, near = modes[:, : sizes["wide"]], modes[:, sizes["wide"] :]
            local = (wide @ tensors["wide"]).reshape(len(block), -1, 3)
            windows = (near @ tensors["near"]).reshape(len(block), frame.width, frame.width, 3)
            return frame.to_shared(frame.add(local, windows, cells))

        return in_blocks(decode, latent, (sizes["latent"],), f"{net} decoder")

    def _signal(self, change: np.ndarray, rectified: np.ndarray | bool) -> tuple[np.ndarray, tuple[int]]:
        """Return SVB's input (T, 20), change (T, 19) counts with rectified (T,) or one as last column, and the shape of
        its frame. A change of another shape is returned as it is: `in_blocks` reports it."""
        change = np.asarray(change, np.float32)
        if change.shape[1:] != (self.electrodes,):
            return change, (self.electrodes,)
        mark = np.broadcast_to(np.asarray(rectified, np.float32), len(change))[:, None]
        # A rectified change is read as one that falls, as most do; less its level at rest it may lie below zero.
        change = np.where(mark > 0, -np.abs(change), change)
        return np.concatenate([change, mark], -1), (self.electrodes + 1,)


def shipped_folder(source: str | None = None) -> Path:
    """Return the folder of weights that ship for a sensor's recordings: the BioTac's for None, or if it has none."""
    own = WEIGHTS_FOLDER / (source or SOURCE)
    return own if (own / CARD_NAME).is_file() else WEIGHTS_FOLDER


def load(folder: str | os.PathLike | None = None, source: str | None = None) -> Networks:
    """Read and verify a weights folder; None for the weights that ship for recordings of ``source``. Raises
    TactileError that names the file (found and expected sha256) or the tensor (found and expected shape)."""
    shipped, folder = folder is None, Path(folder or shipped_folder(source))
    card, digest = read_card(folder)
    if shipped and folder == WEIGHTS_FOLDER and digest != SHIPPED_CARD_SHA256:
        raise TactileError(folder / CARD_NAME, f"sha256 {digest}", SHIPPED_CARD_SHA256, ADVICE)
    tensors, electrodes = {}, electrode_count(pair_of(card, folder / CARD_NAME)[0])
    names = [*NETS, *([PARTS] if PARTS in card.get("nets", {}) else [])]
    for net in names:
        entry = card_entry(card, net, folder / CARD_NAME)
        shapes = tensor_shapes(net, entry["sizes"], electrodes)
        tensors[net] = read_verified(folder / f"{net}.safetensors", entry["sha256"], shapes)
    check_chain({net: card["nets"][net]["sizes"] for net in names}, folder / CARD_NAME, electrodes)
    return Networks(tensors, card, digest)
