"""The stages of a training, in order: what each one trains and the loss it lowers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from .data import Batch, Contacts
from .modules import Residual, compress, initialise, mesh_vae, signal_vae
from .options import Options

FORCE_WIDTH, FORCE_BLOCKS = 64, 1  # a small head: three numbers out of a latent


class Model(nn.Module):
    """The five networks, the force head, and the direct network that the chain is compared with (not shipped)."""

    def __init__(self, options: Options, modes_biotac: int, modes_digit: int, generator: torch.Generator) -> None:
        super().__init__()
        width, blocks = options.width, options.blocks
        self.SVB = signal_vae(options.latent_signal)
        self.MVB = mesh_vae(modes_biotac, options.latent_biotac, width, blocks)
        self.MVD = mesh_vae(modes_digit, options.latent_digit, width, blocks)
        self.S2MPN = Residual(options.latent_signal, options.latent_biotac, width, blocks)
        self.M2MPN = Residual(options.latent_biotac, options.latent_digit, width, blocks)
        self.force = Residual(options.latent_biotac, 3, FORCE_WIDTH, FORCE_BLOCKS)
        self.direct = Residual(19, modes_digit, width, blocks)
        initialise(self, generator)

    def latents(self, change: Tensor) -> tuple[Tensor, Tensor]:
        """change (B, 19) counts -> latent_biotac, latent_digit along the chain."""
        biotac = self.S2MPN(self.SVB.mean(compress(change)))
        return biotac, self.M2MPN(biotac)


Loss = Callable[[Model, Contacts, Batch, Options, torch.Generator], Tensor]


@dataclass(frozen=True)
class Stage:
    """One stage: the networks it changes and its loss; `rate` multiplies the learning rate."""

    name: str
    nets: tuple[str, ...]
    loss: Loss
    rate: float = 1.0


def svb_loss(model: Model, contacts: Contacts, batch: Batch, options: Options, generator: torch.Generator) -> Tensor:
    """Reconstruction of the signal as read, over its mean square, and KL."""
    signal = compress(batch.change)
    latent, divergence = model.SVB.sample(signal, generator)
    error = (model.SVB.decoder(latent) - signal).square().mean()
    return error / signal.square().mean() + options.beta * divergence


def mvb_loss(model: Model, contacts: Contacts, batch: Batch, options: Options, generator: torch.Generator) -> Tensor:
    """Reconstruction of the BioTac's displacement, and KL."""
    latent, divergence = model.MVB.sample(batch.biotac, generator)
    return contacts.biotac.loss(model.MVB.decoder(latent), batch.rows, batch.part) + options.beta * divergence


def mvd_loss(model: Model, contacts: Contacts, batch: Batch, options: Options, generator: torch.Generator) -> Tensor:
    """Reconstruction of the DIGIT's displacement, and KL."""
    latent, divergence = model.MVD.sample(batch.digit, generator)
    return contacts.digit.loss(model.MVD.decoder(latent), batch.rows, batch.part) + options.beta * divergence


def s2mpn_loss(model: Model, contacts: Contacts, batch: Batch, options: Options, generator: torch.Generator) -> Tensor:
    """Latent of the signal -> latent of the BioTac, both means of frozen autoencoders."""
    with torch.no_grad():
        signal, target = model.SVB.mean(compress(batch.change)), model.MVB.mean(batch.biotac)
    return (model.S2MPN(signal) - target).square().mean() / target.square().mean()


def m2mpn_loss(model: Model, contacts: Contacts, batch: Batch, options: Options, generator: torch.Generator) -> Tensor:
    """Latent of the BioTac -> latent of the DIGIT, both means of frozen autoencoders."""
    with torch.no_grad():
        biotac, target = model.MVB.mean(batch.biotac), model.MVD.mean(batch.digit)
    return (model.M2MPN(biotac) - target).square().mean() / target.square().mean()


def chain_loss(model: Model, contacts: Contacts, batch: Batch, options: Options, generator: torch.Generator) -> Tensor:
    """Everything together: a frozen chain is 23-26 % worse than signal -> DIGIT directly (networks.md).

    The autoencoders' own losses stay in at a quarter, so that latents keep their meaning and meshes can be encoded.
    """
    biotac, digit = model.latents(batch.change)
    across = model.M2MPN(model.MVB.mean(batch.biotac))
    given = (model, contacts, batch, options, generator)
    return (
        contacts.biotac.loss(model.MVB.decoder(biotac), batch.rows, batch.part)
        + contacts.digit.loss(model.MVD.decoder(digit), batch.rows, batch.part)
        + 0.5 * contacts.digit.loss(model.MVD.decoder(across), batch.rows, batch.part)
        + 0.25 * (svb_loss(*given) + mvb_loss(*given) + mvd_loss(*given))
    )


def force_loss(model: Model, contacts: Contacts, batch: Batch, options: Options, generator: torch.Generator) -> Tensor:
    """Force from the BioTac's latent, be it encoded from a mesh or translated from a signal."""
    with torch.no_grad():
        latent = torch.cat([model.MVB.mean(batch.biotac), model.latents(batch.change)[0]])
    true = batch.force.repeat(2, 1) / contacts.force_unit
    return (model.force(latent) - true).square().sum(-1).mean()


def direct_loss(model: Model, contacts: Contacts, batch: Batch, options: Options, generator: torch.Generator) -> Tensor:
    """Signal -> DIGIT in one network, the bar the chain must reach."""
    return contacts.digit.loss(model.direct(compress(batch.change)), batch.rows, batch.part)


STAGES = (
    Stage("SVB", ("SVB",), svb_loss),
    Stage("MVB", ("MVB",), mvb_loss),
    Stage("MVD", ("MVD",), mvd_loss),
    Stage("S2MPN", ("S2MPN",), s2mpn_loss),
    Stage("M2MPN", ("M2MPN",), m2mpn_loss),
    Stage("chain", ("SVB", "MVB", "MVD", "S2MPN", "M2MPN"), chain_loss, rate=0.5),
    Stage("force", ("force",), force_loss),
    Stage("direct", ("direct",), direct_loss),
)
