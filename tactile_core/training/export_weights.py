"""Export a trained model to the weights folder: rounded tensors, hashes, statistics of training signals, the card."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import torch

from ..files.version import __version__
from ..sensors import places_of
from ..sensors.descriptor import NODES
from ..sensors.fluid_sensor import FALLS
from ..translation import reference_signals
from ..translation.card import ERROR_FEATURES, NETS, PARTS, PLACE, POSTERIORS, REST, SURFACES
from ..translation.networks import Networks, load
from ..translation.weights import CARD_FORMAT, CARD_NAME, card_bytes, sha256, to_safetensors, write_bytes
from .data import Contacts
from .error_report import QUANTILES, Measure, distance_quantiles, error_rows, fit_error_bounds, silence_quantiles
from .modules import compress
from .options import label
from .stages import FORCE_BLOCKS, FORCE_WIDTH, Model
from .step_errors import PRESSURE_FROM, Bodies
from .surface_codec import SurfaceCodec
from .two_contacts import parts_sizes

DRAWS = 4  # noisy readings of each training contact for the distance's statistics
COLLAPSED = 1e-3  # least variance to divide by, over the largest: latents that vary less are unused
RESIDUAL_FLOOR = 0.01  # compressed units, 0.15 counts: below the rounding of the readings
UNITS = {
    "change": "counts, reading minus rest",
    "displacement": "m",
    "pressure": "Pa, rise of the fluid's",
    "force": "N, exerted by the object, sensor frame",
}


def export(
    model: Model, contacts: Contacts, parts: dict[str, np.ndarray], bodies: Bodies, seed: int, folder: Path
) -> dict:  # fmt: skip
    """Write one safetensors file per network and the card; return the card. The errors in the card are those of the
    files: `networks.py` computes them from the rounded weights.
    parts : tensors of the network that separates two contacts; bodies : the sensors' surfaces; seed : of drawn noise"""
    model.cpu()
    with torch.no_grad():
        for parameter in model.parameters():
            parameter.copy_(parameter.half().float())
    tensors = {net: net_tensors(net, model, contacts) for net in NETS}
    tensors["SVB"] |= signal_statistics(model, contacts, seed)
    tensors["pressure"]["rectified"] = pressure_of_rectified(contacts, seed)
    tensors[PARTS] = parts
    sizes = net_sizes(contacts)
    typical = reference_signals.make(contacts.pairs.signal[contacts.split.train], seed)
    measure = Measure(assemble(tensors, sizes), contacts, bodies, seed)
    silence = silence_quantiles(measure)
    card = {
        "format": CARD_FORMAT,
        "nets": {net: write_net(folder, net, own, sizes[net]) for net, own in tensors.items()},
        "signals": reference_signals.write(folder, typical),
        "polarity": FALLS,
        "units": UNITS,
        "seed": seed,
        "options": contacts.options.settings(),
        "versions": versions(contacts.device),
        "pairs": pairs_entry(contacts),
        **{f"{sensor}{NODES}": contacts.pairs.attributes[f"{sensor}{NODES}"] for sensor in contacts.pairs.pair},
        **_rest_entry(contacts),
        "distance": {"levels": list(QUANTILES), **distance_quantiles(measure)},
        "silence": silence,
        "error_bounds": fit_error_bounds(measure, silence),
        "errors": error_rows(measure, model),
    }
    write_bytes(folder / CARD_NAME, card_bytes(card))
    load(folder)  # what was written can be read
    return card


def _rest_entry(contacts: Contacts) -> dict[str, list[float]]:
    """Return the rest counts from which changes are counted, for a sensor whose own table has none; else nothing."""
    known = places_of(contacts.pairs.pair[0]).rest_counts
    return {} if np.isfinite(known).all() else {REST: [round(float(value), 2) for value in contacts.rest]}


def net_tensors(net: str, model: Model, contacts: Contacts) -> dict[str, np.ndarray]:
    """Return the tensors of network `net` by the names of `networks.py`, float16; scale and turn are float32."""
    state = {name: tensor.numpy().astype(np.float16) for name, tensor in getattr(model, net).state_dict().items()}
    if net == "SVB" or net in POSTERIORS:
        return state
    if net in ("MVB", "MVD"):
        surface = getattr(model, net).surface
        bases = {name: getattr(surface, name).numpy().astype(np.float16) for name in ("wide", "near")}
        return state | bases | {"scale": surface.scale.numpy(), "turn": np.asarray(surface.frame.turn, np.float32)}
    return {f"map.{name}": tensor for name, tensor in state.items()}


def net_sizes(contacts: Contacts) -> dict[str, dict[str, int]]:
    """Return the card's sizes by network and name, from which `card.tensor_shapes` derives every shape."""
    options = contacts.options
    head = {"width": FORCE_WIDTH, "blocks": FORCE_BLOCKS}
    common = {"width": options.width, "blocks": options.blocks}
    signal, biotac, digit = options.latent_signal, options.latent_biotac, options.latent_digit
    return {
        "SVB": {"latent": signal},
        "MVB": {"latent": biotac, **surface_sizes(contacts.biotac), **common},
        "MVD": {"latent": digit, **surface_sizes(contacts.digit), **common},
        "S2MPN": {"inputs": signal, "outputs": biotac, "components": options.components, **common},
        "R2MPN": {"inputs": signal, "outputs": biotac, "components": options.components, **common},
        "M2MPN": {"inputs": biotac + PLACE, "outputs": digit, **common},
        "D2BPN": {"inputs": digit + PLACE, "outputs": biotac, **common},
        "B2SPN": {"inputs": biotac + PLACE, "outputs": signal, **common},
        "force": {"inputs": biotac, "outputs": 3, **head},
        "pressure": {"inputs": contacts.electrodes, "outputs": 1, **head},
        "error": {"inputs": signal + ERROR_FEATURES, "outputs": len(SURFACES), **head},
        PARTS: parts_sizes(contacts.electrodes),
    }


def surface_sizes(surface: SurfaceCodec) -> dict[str, int]:
    """Return a surface's sizes for the card: rows, columns, half, nodes, and numbers of wide and near basis fields."""
    frame, wide, near = surface.frame, len(surface.wide), len(surface.near)
    lattice = {"rows": frame.rows, "columns": frame.columns, "half": frame.half, "nodes": surface.data.shape[1]}
    return {**lattice, "wide": wide, "near": near}


def signal_statistics(model: Model, contacts: Contacts, seed: int) -> dict[str, np.ndarray]:
    """Return the tensors of `Networks.signal_distance`, named "distance.mean" and so on: mean (K,) and whitening (K, K)
    of training latents, residual (e,), SVB's rms error in validation. seed : number that seeds noise"""
    rng = np.random.default_rng([seed, 1])
    rows = np.tile(contacts.with_silence(contacts.split.train), DRAWS)
    left = np.tile(contacts.with_silence(contacts.split.validation), DRAWS)
    shares = contacts.options.rectified, contacts.options.unit
    with torch.no_grad():
        latent = model.SVB.mean(compress(torch.from_numpy(contacts.read(rows, rng, *shares)))).double().numpy()
        signal = compress(torch.from_numpy(contacts.read(left, rng, *shares)))
        error = model.SVB.decoder(model.SVB.mean(signal)) - signal[:, :-1]
        residual = error.double().square().mean(0).sqrt().numpy()
    variances, axes = np.linalg.eigh(np.atleast_2d(np.cov(latent.T)))
    spread = np.sqrt(np.maximum(variances, COLLAPSED * variances.max()))
    tensors = {"mean": latent.mean(0), "whitening": axes / spread, "residual": np.maximum(residual, RESIDUAL_FLOOR)}
    return {f"distance.{name}": array.astype(np.float32) for name, array in tensors.items()}


def pressure_of_rectified(contacts: Contacts, seed: int) -> np.ndarray:
    """Return the fluid's pressure, (1,) Pa, per count of the sum of rectified changes: the median over training
    contacts above PRESSURE_FROM. On sample 7 of the slides (docs/sources.md) this law of one number does better than
    networks, large and small (docs/train.md). seed : number that seeds noise"""
    rows = contacts.split.train
    rows = rows[contacts.pairs.pressure[rows] > PRESSURE_FROM]
    signal = contacts.read(rows, np.random.default_rng([seed, 7]), rectified=1.0)
    total = np.abs(signal[:, :-1]).sum(1, dtype=np.float64)
    ratio = contacts.pairs.pressure[rows] / np.maximum(total, 1.0)
    return np.array([np.median(ratio) if len(rows) else 0.0], np.float32)


def assemble(tensors: dict, sizes: dict) -> Networks:
    """Return the numpy networks of tensors, by network and name, and sizes, by network; no card is needed."""
    return Networks(tensors, {"nets": {net: {"sizes": sizes[net]} for net in tensors}})


def versions(device: torch.device) -> dict[str, str]:
    """Return what the numbers depend on: device, and versions of tactile, torch, numpy, python."""
    return {
        "device": label(device),
        "tactile": __version__,
        "torch": torch.__version__,
        "numpy": np.__version__,
        "python": sys.version.split()[0],
    }


def write_net(folder: Path, net: str, tensors: dict[str, np.ndarray], sizes: dict[str, int]) -> dict[str, object]:
    """Write the file of network `net`; return the card's entry: file, sha256, sizes, shapes.
    tensors : by their names in `networks.py`; sizes : numbers from `net_sizes`"""
    data = to_safetensors(tensors)
    write_bytes(folder / f"{net}.safetensors", data)
    shapes = {name: list(array.shape) for name, array in sorted(tensors.items())}
    return {"file": f"{net}.safetensors", "sha256": sha256(data), "sizes": sizes, "shapes": shapes}


def pairs_entry(contacts: Contacts) -> dict[str, object]:
    """Return the card's entry on the training data: origin, largest pressure, contacts and presses in each part."""
    pairs, split = contacts.pairs, contacts.split
    return {
        "sha256": pairs.sha256,
        "contacts": {name: len(rows) for name, rows in vars(split).items()},
        "presses": {name: len(np.unique(pairs.press[rows])) for name, rows in vars(split).items()},
        "largest_pressure_Pa": float(f"{pairs.pressure[split.train].max():.6g}"),
        **{name: pairs.attributes[name] for name in ("scene", "seed", "version", "indenters", "electrodes")},
    }
