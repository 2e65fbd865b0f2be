"""The networks together, and the stages in which they are trained.
The loss of a stage takes the model, all contacts, a batch of them, options, and the generator that posteriors are
sampled with; it returns the number (a tensor of no axes) that training minimises."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn

from ..translation.card import ERROR_FEATURES, PLACE, SURFACES
from ..translation.networks import ERROR_UNIT, PRESSURE_SCALE
from ..translation.posterior import FORCE_SCALE
from .data import Batch, Contacts
from .modules import ContactPosterior, MeshVae, Residual, compress, initialise, signal_vae
from .options import Options

FORCE_WIDTH, FORCE_BLOCKS = 64, 1  # small heads: three numbers out of a latent, one or two out of a signal
FORCE_FLOOR = 0.1  # N, added to the force that an error is divided by, so that light touches do not dominate (assumed)
ERROR_FLOOR = 0.1e-6  # m, a step of the stored displacements: no error is known better
LEAST_SIZE = 1e-2  # least mean square of latents to divide by: silent samples alone have 0
CELL_WEIGHT = 4.0  # weight of the place's error against the code's, in the latents' own scales (assumed)


class Model(nn.Module):
    """All networks that ship, and the direct network with which the chain of them is compared (not shipped)."""

    def __init__(self, options: Options, contacts: Contacts, generator: torch.Generator) -> None:
        super().__init__()
        width, blocks = options.width, options.blocks
        signal, biotac, digit = options.latent_signal, options.latent_biotac, options.latent_digit
        self.SVB = signal_vae(signal, contacts.electrodes)
        self.MVB = MeshVae(contacts.biotac, biotac, width, blocks)
        self.MVD = MeshVae(contacts.digit, digit, width, blocks)
        self.S2MPN = ContactPosterior(signal, biotac, width, blocks, options.components)
        self.R2MPN = ContactPosterior(signal, biotac, width, blocks, options.components)
        self.M2MPN = Residual(biotac + PLACE, digit, width, blocks)
        self.force = Residual(biotac, 3, FORCE_WIDTH, FORCE_BLOCKS)
        self.pressure = Residual(contacts.electrodes, 1, FORCE_WIDTH, FORCE_BLOCKS)
        self.error = Residual(signal + ERROR_FEATURES, len(SURFACES), FORCE_WIDTH, FORCE_BLOCKS)
        self.D2BPN = Residual(digit + PLACE, biotac, width, blocks)
        self.B2SPN = Residual(biotac + PLACE, signal, width, blocks)
        self.direct = Residual(contacts.electrodes + 1, digit, width, blocks)
        self.direct_decoder = MeshVae(contacts.digit, digit, width, blocks)
        initialise(self, generator)

    def from_signal(self, signal: Tensor) -> tuple[Tensor, Tensor]:
        """Map signal (B, e + 1), counts and 1 if rectified, to the likeliest contact's latent_source, latent_target."""
        latent, rectified = self.SVB.mean(compress(signal)), signal[:, -1:] > 0
        state = torch.where(rectified, self.R2MPN.contact(latent), self.S2MPN.contact(latent))
        biotac, _ = self.given(signal, state)
        return biotac, self.to_target(state, biotac)

    def given(self, signal: Tensor, state: Tensor) -> tuple[Tensor, Tensor]:
        """Map signal (B, e + 1) and a contact's state (B, STATE) to latent_source and the state's -log density (B,)."""
        latent, rectified = self.SVB.mean(compress(signal)), signal[:, -1:] > 0
        biotac = torch.where(rectified, self.R2MPN.given(latent, state), self.S2MPN.given(latent, state))
        surprises = (net.surprise(latent, state) for net in (self.R2MPN, self.S2MPN))
        return biotac, torch.where(rectified[:, 0], *surprises)

    def across(self, latent_source: Tensor) -> Tensor:
        """Map latent_source (B, L) to latent_target (B, L'), by M2MPN alone."""
        return self.M2MPN(self.MVB.placed(latent_source))

    def to_target(self, state: Tensor, latent_source: Tensor) -> Tensor:
        """Map latent_source (B, L) to latent_target (B, L') at the place of the contact's state (B, STATE)."""
        return torch.cat([state[:, :PLACE], self.across(latent_source)[:, PLACE:]], -1)

    def back(self, latent_target: Tensor) -> Tensor:
        """Map latent_target (B, L') to latent_source (B, L)."""
        return self.D2BPN(self.MVD.placed(latent_target))

    def to_signal(self, latent_source: Tensor) -> Tensor:
        """Map latent_source (B, L) to changes (B, e) on the networks' scale, arcsinh(counts / 15)."""
        return self.SVB.decoder(self.B2SPN(self.MVB.placed(latent_source)))

    def expected_error(self, signal: Tensor) -> Tensor:
        """Map signal (B, e + 1) to log(largest node error / ERROR_UNIT), (B, 2), on BioTac and DIGIT."""
        seen = compress(signal)
        latent = self.SVB.mean(seen)
        change = seen[:, :-1]
        left = (self.SVB.decoder(latent) - change).square().mean(-1, keepdim=True).sqrt()
        size = change.square().mean(-1, keepdim=True).sqrt()
        return self.error(torch.cat([latent, left, size, seen[:, -1:]], -1))

    def directly(self, signal: Tensor) -> Tensor:
        """Map signal (B, e + 1), see `from_signal`, to the latent (B, L') that `direct_decoder` decodes to the gel."""
        return self.direct(compress(signal))


Loss = Callable[[Model, Contacts, Batch, Options, torch.Generator], Tensor]


@dataclass(frozen=True)
class Stage:
    """A stage of the training. nets : names of the networks that it changes, or of parts of them (``S2MPN.code``)
    loss : the function whose result it minimises"""

    name: str
    nets: tuple[str, ...]
    loss: Loss


def svb_loss(model: Model, contacts: Contacts, batch: Batch, options: Options, generator: torch.Generator) -> Tensor:
    """Return the mean square error of the noisy signal's reconstruction over that signal's, plus beta times KL."""
    signal = compress(batch.signal)
    latent, divergence = model.SVB.sample(signal, generator)
    change = signal[:, :-1]
    error = (model.SVB.decoder(latent) - change).square().mean()
    return error / change.square().mean() + options.beta * divergence


def mvb_loss(model: Model, contacts: Contacts, batch: Batch, options: Options, generator: torch.Generator) -> Tensor:
    """Return the BioTac's reconstruction error, `SurfaceCodec.loss`, plus beta times the KL divergence."""
    latent, divergence = model.MVB.sample(batch.biotac, generator)
    return model.MVB.loss(latent, batch.rows) + options.beta * divergence


def mvd_loss(model: Model, contacts: Contacts, batch: Batch, options: Options, generator: torch.Generator) -> Tensor:
    """Return the DIGIT's reconstruction error, `SurfaceCodec.loss`, plus beta times the KL divergence."""
    latent, divergence = model.MVD.sample(batch.digit, generator)
    return model.MVD.loss(latent, batch.rows) + options.beta * divergence


def s2mpn_loss(model: Model, contacts: Contacts, batch: Batch, options: Options, generator: torch.Generator) -> Tensor:
    """Return the sum of the true contact's negative log likelihood, nats, `latent_loss` of the BioTac's latent, and
    `svb_loss`. (By likelihood a contact is not estimated fainter than its signal makes it.) SVB trains along, to keep
    what separates contacts."""
    with torch.no_grad():
        target = model.MVB.mean(batch.biotac)
    found, surprise = model.given(batch.signal, batch.state)
    return surprise.mean() + latent_loss(found, target) + svb_loss(model, contacts, batch, options, generator)


def m2mpn_loss(model: Model, contacts: Contacts, batch: Batch, options: Options, generator: torch.Generator) -> Tensor:
    """Return `latent_loss` of the map from the BioTac's latent to the DIGIT's, both means of frozen autoencoders."""
    with torch.no_grad():
        biotac, target = model.MVB.mean(batch.biotac), model.MVD.mean(batch.digit)
    return latent_loss(model.across(biotac), target)


def latent_loss(found: Tensor, target: Tensor) -> Tensor:
    """Return the weighted mean of two errors of latents found against target (B, L): of their places, weight
    CELL_WEIGHT, and of the shape's code, weight 1. Each is the mean square error over the target's mean square."""
    error, size = (found - target).square(), target.square()
    place, code = (
        error[:, part].mean() / size[:, part].mean().clamp(min=LEAST_SIZE)
        for part in (slice(PLACE), slice(PLACE, None))
    )
    return (code + CELL_WEIGHT * place) / (1 + CELL_WEIGHT)


def chain_loss(model: Model, contacts: Contacts, batch: Batch, options: Options, generator: torch.Generator) -> Tensor:
    """Return the loss of the whole chain, trained together: a frozen one is 23-26 % worse than signal -> DIGIT directly
    (docs/sources.md, Networks).

    Shapes are compared at the contact's true place, and places separately: a dent beside its place would otherwise be
    made fainter to reduce the error. The gel's place is the state's, trained by its likelihood before and fixed here.
    The autoencoders' own losses count half, so that latents keep their meaning and meshes can be encoded."""
    biotac, _ = model.given(batch.signal, batch.state)
    digit, across = model.to_target(batch.state, biotac), model.across(model.MVB.mean(batch.biotac))
    given = (model, contacts, batch, options, generator)
    return (
        model.MVB.shape_loss(biotac, batch.rows)
        + model.MVD.shape_loss(digit, batch.rows)
        + model.MVD.shape_loss(across, batch.rows)
        + options.astray * (model.MVB.astray(biotac, batch.rows) + model.MVD.astray(across, batch.rows))
        + 0.5 * (mvb_loss(*given) + mvd_loss(*given))
    )


def force_loss(model: Model, contacts: Contacts, batch: Batch, options: Options, generator: torch.Generator) -> Tensor:
    """Return the mean relative error of forces by latents of the BioTac: of true meshes, and of signals with
    contacts."""
    with torch.no_grad():
        latent = torch.cat([model.MVB.mean(batch.biotac), model.given(batch.signal, batch.state)[0]])
    true = batch.force.repeat(2, 1)
    error = FORCE_SCALE * torch.sinh(model.force(latent).clamp(-8.0, 8.0)) - true
    return (length(error) / (length(true) + FORCE_FLOOR)).mean()


def pressure_loss(
    model: Model, contacts: Contacts, batch: Batch, options: Options, generator: torch.Generator
) -> Tensor:
    """Return the mean square error of asinh(the fluid's pressure / PRESSURE_SCALE), from noisy signals, not rectified.
    (Relative errors instead biased uncertain pressures low: estimates for slides were a sixth lower still.)"""
    signed = batch.signal[:, -1:] == 0
    error = model.pressure(compress(batch.signal)[:, :-1]) - torch.asinh(batch.pressure / PRESSURE_SCALE)
    return (signed * error.square()).sum() / signed.sum().clamp(min=1)


def length(vectors: Tensor) -> Tensor:
    """Return the length (B,) of vectors (B, 3); at zero it has a gradient."""
    return (vectors.square().sum(-1) + 1e-12).sqrt()


def error_loss(model: Model, contacts: Contacts, batch: Batch, options: Options, generator: torch.Generator) -> Tensor:
    """Return the mean absolute error of ``Model.expected_error``'s logarithms; by it the network learns the median."""
    with torch.no_grad():
        biotac, digit = model.from_signal(batch.signal)
        answers = (model.MVB, biotac), (model.MVD, digit)
        true = torch.stack([largest_error(vae, latent, batch.rows) for vae, latent in answers], -1)
    return (model.expected_error(batch.signal) - (true / ERROR_UNIT).log()).abs().mean()


def largest_error(vae: MeshVae, latent: Tensor, rows: np.ndarray) -> Tensor:
    """Return the largest node error (B,) m, at least ERROR_FLOOR, of displacements decoded from latent (B, L), against
    the true ones of contacts ``rows`` (B,). vae : of the surface"""
    error = vae.field(latent) - vae.surface.true(rows)
    return error.square().sum(-1).amax(-1).sqrt().clamp(min=ERROR_FLOOR).to(latent.device)


def back_loss(model: Model, contacts: Contacts, batch: Batch, options: Options, generator: torch.Generator) -> Tensor:
    """Return the loss of the reverse direction: DIGIT mesh to BioTac mesh, and BioTac mesh to the noisy signal."""
    with torch.no_grad():
        biotac, digit = model.MVB.mean(batch.biotac), model.MVD.mean(batch.digit)
    signed = batch.signal[:, -1:] == 0
    change = compress(batch.signal)[:, :-1]
    error = ((model.to_signal(biotac) - change).square() * signed).mean()
    found = model.back(digit)
    return (
        model.MVB.shape_loss(found, batch.rows)
        + options.astray * model.MVB.astray(found, batch.rows)
        + error / (change.square() * signed).mean()
    )


def direct_loss(model: Model, contacts: Contacts, batch: Batch, options: Options, generator: torch.Generator) -> Tensor:
    """Return the loss of the one network from signal to DIGIT, which the chain must beat."""
    found, decoder = model.directly(batch.signal), model.direct_decoder
    return decoder.loss(found, batch.rows) + options.astray * decoder.astray(found, batch.signed)


STAGES = (
    Stage("SVB", ("SVB",), svb_loss),
    Stage("MVB", ("MVB",), mvb_loss),
    Stage("MVD", ("MVD",), mvd_loss),
    Stage("S2MPN", ("SVB", "S2MPN", "R2MPN"), s2mpn_loss),
    Stage("M2MPN", ("M2MPN",), m2mpn_loss),
    Stage("chain", ("MVB", "MVD", "S2MPN.code", "R2MPN.code", "M2MPN"), chain_loss),
    Stage("force", ("force",), force_loss),
    Stage("pressure", ("pressure",), pressure_loss),
    Stage("error", ("error",), error_loss),
    Stage("back", ("D2BPN", "B2SPN"), back_loss),
    Stage("direct", ("direct", "direct_decoder"), direct_loss),
)
