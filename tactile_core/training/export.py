"""From a trained model to the weights folder: rounding, hashes, the distance to training signals, the card."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import torch

from .. import __version__
from ..networks import NETS, Networks, compress, load
from ..weights import CARD_FORMAT, CARD_NAME, card_bytes, sha256, to_safetensors, write_bytes
from .data import Contacts
from .report import QUANTILES, Measure, distance_quantiles, error_rows, silence_quantiles, validation_force
from .stages import FORCE_BLOCKS, FORCE_WIDTH, Model

DRAWS = 4  # noisy readings of each training contact for the distance's statistics
COLLAPSED = 1e-3  # share of the largest variance: latents that vary less are unused, their noise is no distance
RESIDUAL_FLOOR = 0.01  # compressed units, 0.15 counts: below the rounding of the readings
RIDGE = tuple(10.0**power for power in range(-8, 1))  # tried on validation, in mean eigenvalues of the Gram matrix
UNITS = {
    "change": "counts, reading minus rest",
    "displacement": "m",
    "force": "N, exerted by the object, sensor frame",
}


def export(model: Model, contacts: Contacts, rest_digit: np.ndarray, seed: int, folder: Path) -> dict:
    """Write one safetensors file a network and the card; returns the card.

    The errors in the card are those of the files: they are computed by `networks.py` from the rounded weights.
    """
    with torch.no_grad():
        for parameter in model.parameters():
            parameter.copy_(parameter.half().float())
    tensors = {net: net_tensors(net, model, contacts) for net in NETS}
    tensors["SVB"] |= signal_statistics(model, contacts, seed)
    sizes = net_sizes(model, contacts)
    choice = choose_force(tensors, sizes, contacts, seed)
    measure = Measure(assemble(tensors, sizes), contacts, rest_digit, seed)
    card = {
        "format": CARD_FORMAT,
        "nets": write_nets(folder, tensors, sizes),
        "units": UNITS,
        "seed": seed,
        "options": contacts.options.settings(),
        "versions": versions(),
        "pairs": pairs_entry(contacts),
        "biotac_nodes_sha256": contacts.pairs.attributes["biotac_nodes_sha256"],
        "digit_nodes_sha256": contacts.pairs.attributes["digit_nodes_sha256"],
        "force": choice,
        "distance": {"levels": list(QUANTILES), **distance_quantiles(measure)},
        "silence": {"levels": list(QUANTILES), **silence_quantiles(measure)},
        "errors": error_rows(measure, model),
    }
    write_bytes(folder / CARD_NAME, card_bytes(card))
    load(folder)  # what was written can be read
    return card


def net_tensors(net: str, model: Model, contacts: Contacts) -> dict[str, np.ndarray]:
    """The tensors of one network under the names of `networks.py`, in float16; scales in float32."""
    state = {name: tensor.numpy().astype(np.float16) for name, tensor in getattr(model, net).state_dict().items()}
    if net == "SVB":
        return state
    if net in ("MVB", "MVD"):
        surface = contacts.biotac if net == "MVB" else contacts.digit
        basis = surface.basis.numpy().astype(np.float16)
        return state | {"basis": basis, "scale": np.array([surface.unit], np.float32)}
    tensors = {f"map.{name}": tensor for name, tensor in state.items()}
    return tensors | ({"scale": np.array([contacts.force_unit], np.float32)} if net == "force" else {})


def net_sizes(model: Model, contacts: Contacts) -> dict[str, dict[str, int]]:
    """The sizes in the card, from which `networks.tensor_shapes` knows every shape."""
    options = contacts.options
    common = {"width": options.width, "blocks": options.blocks}
    signal, biotac, digit = options.latent_signal, options.latent_biotac, options.latent_digit
    return {
        "SVB": {"latent": signal},
        "MVB": {"latent": biotac, "modes": contacts.biotac.modes.shape[1], "nodes": contacts.biotac.nodes, **common},
        "MVD": {"latent": digit, "modes": contacts.digit.modes.shape[1], "nodes": contacts.digit.nodes, **common},
        "S2MPN": {"inputs": signal, "outputs": biotac, **common},
        "M2MPN": {"inputs": biotac, "outputs": digit, **common},
        "force": {"compliance": 0, "inputs": biotac, "outputs": 3, "width": FORCE_WIDTH, "blocks": FORCE_BLOCKS},
    }


def signal_statistics(model: Model, contacts: Contacts, seed: int) -> dict[str, np.ndarray]:
    """What `Networks.signal_distance` needs: mean and whitening of training latents, SVB's residual an electrode."""
    rng = np.random.default_rng([seed, 1])
    rows = np.tile(contacts.with_silence(contacts.split.train), DRAWS)
    left = np.tile(contacts.with_silence(contacts.split.validation), DRAWS)
    with torch.no_grad():
        latent = model.SVB.mean(torch.from_numpy(compress(contacts.read(rows, rng)))).double().numpy()
        signal = torch.from_numpy(compress(contacts.read(left, rng)))
        residual = (model.SVB.decoder(model.SVB.mean(signal)) - signal).double().square().mean(0).sqrt().numpy()
    variances, axes = np.linalg.eigh(np.atleast_2d(np.cov(latent.T)))
    spread = np.sqrt(np.maximum(variances, COLLAPSED * variances.max()))
    tensors = {"mean": latent.mean(0), "whitening": axes / spread, "residual": np.maximum(residual, RESIDUAL_FLOOR)}
    return {f"distance.{name}": array.astype(np.float32) for name, array in tensors.items()}


def compliance(contacts: Contacts) -> np.ndarray:
    """(K, 3) N: force as a linear functional of the BioTac's coefficients, ridge regression on the training contacts.

    Without an offset: no displacement, no force. The regularisation is the best on the validation presses.
    """
    modes, force = contacts.biotac.modes.double().numpy(), contacts.pairs.force.astype(np.float64)
    train, validation = contacts.split.train, contacts.split.validation
    gram, moment = modes[train].T @ modes[train], modes[train].T @ force[train]
    size = np.trace(gram) / len(gram) * np.eye(len(gram))
    fits = [np.linalg.solve(gram + share * size, moment) for share in RIDGE]
    errors = [np.square(modes[validation] @ fit - force[validation]).sum() for fit in fits]
    return fits[int(np.argmin(errors))]


def choose_force(tensors: dict, sizes: dict, contacts: Contacts, seed: int) -> dict[str, object]:
    """Keep the better force estimate on validation presses, from signals as read; puts it into tensors and sizes.

    Returns the card's entry: both errors (N, rms of the vector error), the estimate kept.
    """
    fit = compliance(contacts)
    linear = {"compliance": fit.astype(np.float32)}
    linear_sizes = {"compliance": 1, "inputs": len(fit), "outputs": 3, "width": 0, "blocks": 0}
    choices = {"head": (tensors["force"], sizes["force"]), "compliance": (linear, linear_sizes)}
    errors = {}
    for name, (estimate, estimate_sizes) in choices.items():
        networks = assemble(tensors | {"force": estimate}, sizes | {"force": estimate_sizes})
        errors[name] = validation_force(networks, contacts, seed)
    kept = min(errors, key=lambda name: errors[name])
    tensors["force"], sizes["force"] = choices[kept]
    return {"kept": kept, "validation_rms_N": {name: float(f"{error:.4g}") for name, error in errors.items()}}


def assemble(tensors: dict, sizes: dict) -> Networks:
    """The numpy networks before there is a card."""
    return Networks(tensors, {"nets": {net: {"sizes": sizes[net]} for net in NETS}})


def versions() -> dict[str, str]:
    """What the numbers depend on besides data, seed and options."""
    return {
        "tactile": __version__,
        "torch": torch.__version__,
        "numpy": np.__version__,
        "python": sys.version.split()[0],
    }


def write_nets(folder: Path, tensors: dict, sizes: dict) -> dict[str, dict[str, object]]:
    """Write the files; returns the card's entries: file, sha256, sizes, shapes."""
    entries = {}
    for net in NETS:
        data = to_safetensors(tensors[net])
        write_bytes(folder / f"{net}.safetensors", data)
        shapes = {name: list(array.shape) for name, array in sorted(tensors[net].items())}
        entries[net] = {"file": f"{net}.safetensors", "sha256": sha256(data), "sizes": sizes[net], "shapes": shapes}
    return entries


def pairs_entry(contacts: Contacts) -> dict[str, object]:
    """Where the training data came from, and how it was split."""
    pairs, split = contacts.pairs, contacts.split
    parts = {"train": split.train, "validation": split.validation, "test": split.test}
    return {
        "sha256": pairs.sha256,
        "contacts": {name: len(rows) for name, rows in parts.items()},
        "presses": {name: len(np.unique(pairs.press[rows])) for name, rows in parts.items()},
        **{name: pairs.attributes[name] for name in ("scene", "seed", "version", "indenters")},
    }
