"""The networks of a weights folder as torch's modules."""

from __future__ import annotations

import numpy as np
import torch
from torch import nn

from ..translation.networks import Networks
from .modules import ContactPosterior, Residual, Vae, signal_vae


def posterior_of(nets: Networks, net: str) -> ContactPosterior:
    """Return S2MPN or R2MPN."""
    sizes = nets.sizes[net]
    module = ContactPosterior(*(sizes[name] for name in ("inputs", "outputs", "width", "blocks", "components")))
    return _filled(module, nets.tensors[net])


def residual_of(nets: Networks, net: str, part: str = "map") -> Residual:
    """Return the residual network that is a part of one: the map of M2MPN, the decoder of MVD."""
    tensors = {name: array for name, array in nets.tensors[net].items() if name.startswith(f"{part}.")}
    (outputs, inputs), (width, _) = (tensors[f"{part}.{name}.weight"].shape for name in ("skip", "first"))
    module = Residual(inputs, outputs, width, nets.sizes[net]["blocks"])
    return _filled(module, {name.removeprefix(f"{part}."): array for name, array in tensors.items()})


def signal_vae_of(nets: Networks) -> Vae:
    """Return SVB."""
    tensors = {name: array for name, array in nets.tensors["SVB"].items() if not name.startswith("distance.")}
    return _filled(signal_vae(nets.sizes["SVB"]["latent"], nets.electrodes), tensors)


def _filled(module: nn.Module, tensors: dict[str, np.ndarray]) -> nn.Module:
    module.load_state_dict({name: torch.from_numpy(array.copy()) for name, array in tensors.items()})
    return module


def keep(module: nn.Module, **arrays: np.ndarray) -> None:
    """Give a module arrays as tensors that move with it from device to device."""
    for name, array in arrays.items():
        module.register_buffer(name, torch.from_numpy(np.array(array)), persistent=False)
