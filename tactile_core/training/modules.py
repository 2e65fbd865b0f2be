"""The networks in torch. Tensor names are those of `networks.py`, which holds the same forward passes in numpy."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import torch
from torch import Tensor, nn

from ..translation.card import PLACE, SIGNAL_HIDDEN, STATE
from ..translation.layers import COUNT_SCALE, NORM_EPSILON
from ..translation.networks import LEAST_SPREAD, SPREAD_LIMITS
from ..translation.posterior import LEAST_TOUCH, MEAN_SHIFTS
from .surface_codec import SurfaceCodec


class Plain(nn.ModuleList):
    """Linear layers with ReLU between them; sizes : number of inputs, then of each layer's outputs"""

    def __init__(self, sizes: tuple[int, ...]) -> None:
        super().__init__(nn.Linear(*pair) for pair in zip(sizes[:-1], sizes[1:], strict=True))

    def forward(self, x: Tensor) -> Tensor:
        """Map x (B, sizes[0]) to (B, sizes[-1])."""
        for index, layer in enumerate(self):
            x = layer(torch.relu(x) if index else x)
        return x


class Block(nn.Module):
    """Residual block: x + down(silu(up(norm(x))))."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.norm = nn.LayerNorm(width, NORM_EPSILON)
        self.up = nn.Linear(width, width)
        self.down = nn.Linear(width, width)

    def forward(self, x: Tensor) -> Tensor:
        """Map x (B, width) to (B, width)."""
        return x + self.down(nn.functional.silu(self.up(self.norm(x))))


class Residual(nn.Module):
    """Residual MLP of `blocks` blocks of a width, with a linear skip from input to output (docs/sources.md)."""

    def __init__(self, inputs: int, outputs: int, width: int, blocks: int) -> None:
        super().__init__()
        self.first = nn.Linear(inputs, width)
        self.blocks = nn.ModuleList(Block(width) for _ in range(blocks))
        self.norm = nn.LayerNorm(width, NORM_EPSILON)
        self.last = nn.Linear(width, outputs)
        self.skip = nn.Linear(inputs, outputs, bias=False)

    def forward(self, x: Tensor) -> Tensor:
        """Map x (B, inputs) to (B, outputs)."""
        hidden = self.first(x)
        for block in self.blocks:
            hidden = block(hidden)
        return self.last(self.norm(hidden)) + self.skip(x)


class ContactPosterior(nn.Module):
    """S2MPN or R2MPN: the posterior of a contact given a signal's latent, and the BioTac's latent given both: a mixture
    of C Gaussians (`components`) over the contact's state (mixture density network, Bishop 1994), and a network from
    signal and state to the latent of the BioTac's dent. So shapes are never averaged over places and depths."""

    def __init__(self, inputs: int, outputs: int, width: int, blocks: int, components: int) -> None:
        super().__init__()
        self.posterior = Residual(inputs, components * (1 + 2 * STATE), width, blocks)
        self.code = Residual(inputs + STATE, outputs, width, blocks)
        self.components = components

    def mixture(self, latent: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Map the signal's latent (B, K) to the logarithm of the weights (B, C), means and spreads (B, C, STATE)."""
        raw = self.posterior(latent)
        weight, rest = raw[:, : self.components], raw[:, self.components :].view(len(raw), 2, self.components, STATE)
        return weight.log_softmax(-1), rest[:, 0], LEAST_SPREAD + rest[:, 1].clamp(*SPREAD_LIMITS).exp()

    def surprise(self, latent: Tensor, state: Tensor) -> Tensor:
        """Return -log density (B,), nats, but for a constant, of state (B, STATE) in the mixture by latent (B, K)."""
        weight, mean, spread = self.mixture(latent)
        away = (state[:, None] - mean) / spread
        density = -0.5 * away.square().sum(-1) - spread.log().sum(-1)
        return -(weight + density).logsumexp(-1)

    def given(self, latent: Tensor, state: Tensor) -> Tensor:
        """Map the signal's latent (B, K) and a state (B, STATE) to latent_biotac (B, L)."""
        return self.code(torch.cat([latent, state], -1))

    def contact(self, latent: Tensor) -> Tensor:
        """Map the signal's latent (B, K) to the state (B, STATE) of the likeliest contact: see `Posterior.likely`."""
        weight, mean, spread = self.mixture(latent)
        state = mean[torch.arange(len(mean)), weight.argmax(-1)]
        place, spread = mean[..., :PLACE], spread[..., :PLACE]
        other = (mean[..., PLACE] >= LEAST_TOUCH) != (state[:, None, PLACE] >= LEAST_TOUCH)
        known = (weight - spread.log().sum(-1)).masked_fill(other, -math.inf)
        for _ in range(MEAN_SHIFTS):
            share = (known - 0.5 * ((state[:, None, :PLACE] - place) / spread).square().sum(-1)).softmax(-1)
            state = (share[..., None] * mean).sum(1)
        return state


class Vae(nn.Module):
    """A beta-VAE around any encoder (to mean and logvar) and decoder."""

    def __init__(self, encoder: nn.Module, decoder: nn.Module) -> None:
        super().__init__()
        self.encoder, self.decoder = encoder, decoder

    def posterior(self, x: Tensor) -> tuple[Tensor, Tensor]:
        """Map x (B, inputs) to mean (B, L) and log variance (B, L) of the latent."""
        mean, logvar = self.encoder(x).chunk(2, -1)
        return mean, logvar.clamp(-12.0, 6.0)  # keeps exp() finite in the first steps; trained values lie well inside

    def mean(self, x: Tensor) -> Tensor:
        """Map x (B, inputs) to the mean (B, L) of the posterior, which is used at inference."""
        return self.posterior(x)[0]

    def sample(self, x: Tensor, generator: torch.Generator) -> tuple[Tensor, Tensor]:
        """Draw a latent (B, L) from the posterior of x (B, inputs), reparameterised; also return the KL divergence from
        N(0, 1), mean over B (Kingma and Welling 2014, appendix B)."""
        mean, logvar = self.posterior(x)
        noise = torch.randn(mean.shape, generator=generator).to(mean.device)  # the same numbers on any device
        divergence = 0.5 * (mean**2 + logvar.exp() - 1.0 - logvar).sum(-1).mean()
        return mean + noise * (0.5 * logvar).exp(), divergence


class MeshVae(Vae):
    """MVB or MVD: a latent is the place of the dent and a code of its shape in the frame that moves with it.

    The place is measured on the mesh, not learned. The decoder, and networks that start from a latent, also read what
    is left of the place after rounding to cells (`placed`), which a shape on a lattice depends on.
    surface : the `SurfaceCodec` that converts places to cells and coefficients to fields"""

    def __init__(self, surface: SurfaceCodec, latent: int, width: int, blocks: int) -> None:
        modes = surface.modes.shape[1]
        encoder = Residual(modes + 2 * PLACE, 2 * (latent - PLACE), width, blocks)
        super().__init__(encoder, Residual(latent + PLACE, modes, width, blocks))
        self.surface, self.modes = surface, modes

    def mean(self, x: Tensor) -> Tensor:
        """Map the encoder's input x (B, K + 4) to the latent (B, L)."""
        return torch.cat([x[:, self.modes : self.modes + PLACE], super().mean(x)], -1)

    def sample(self, x: Tensor, generator: torch.Generator) -> tuple[Tensor, Tensor]:
        """Draw a latent (B, L) of x (B, K + 4), no noise on its place; also return the KL divergence of
        `Vae.sample`."""
        code, divergence = super().sample(x, generator)
        return torch.cat([x[:, self.modes : self.modes + PLACE], code], -1), divergence

    def placed(self, latent: Tensor) -> Tensor:
        """Append to a latent (B, L) what is left of its place after rounding to whole cells; return (B, L + 2)."""
        return torch.cat([latent, self.surface.cells(latent[:, :PLACE])[1]], -1)

    def loss(self, latent: Tensor, rows: np.ndarray) -> Tensor:
        """Return `SurfaceCodec.loss` of the decoded latent (B, L) against the contacts of rows (B,)."""
        cell, left = self.surface.cells(latent[:, :PLACE])
        return self.surface.loss(self.decoder(torch.cat([latent, left], -1)), cell, rows)

    def shape_loss(self, latent: Tensor, rows: np.ndarray) -> Tensor:
        """Return `loss` of latent (B, L) with its place replaced by the true one of the contacts ``rows`` (B,)."""
        return self.loss(torch.cat([self.surface.true_place(rows).to(latent.device), latent[:, PLACE:]], -1), rows)

    def astray(self, latent: Tensor, rows: np.ndarray) -> Tensor:
        """Return the mean distance, cells, of the places that latent (B, L) begins with from those of rows (B,)."""
        return self.surface.astray(latent[:, :PLACE], rows)

    def field(self, latent: Tensor) -> Tensor:
        """Decode a latent (B, L) to displacement (B, n, 3) m in the nodes' own frames; carries no gradient."""
        cell, left = self.surface.cells(latent[:, :PLACE])
        with torch.no_grad():
            return self.surface.field(self.decoder(torch.cat([latent, left], -1)), cell)


def signal_vae(latent: int, electrodes: int) -> Vae:
    """Return SVB, with the layers of ACROSS (a paper: docs/sources.md, Networks): electrodes + 1 inputs, 256, 128, 64,
    the latent, and back, on compressed signals. The last input says whether the signals are rectified."""
    encoder = Plain((electrodes + 1, *SIGNAL_HIDDEN, 2 * latent))
    return Vae(encoder, Plain((latent, *SIGNAL_HIDDEN[::-1], electrodes)))


def compress(signal: Tensor) -> Tensor:
    """Convert signal (B, e + 1), changes in counts and 1 if rectified, to SVB's input: arcsinh(counts / 15), and 1."""
    return torch.cat([torch.asinh(signal[:, :-1] / COUNT_SCALE), signal[:, -1:]], -1)


def initialise(module: nn.Module, generator: torch.Generator) -> None:
    """Draw all weights from the generator: uniform in +-1/sqrt(inputs), torch's own range for Linear. Layers that end a
    branch become zero, so that a residual MLP starts as its linear skip."""
    for name, layer in module.named_modules():
        if isinstance(layer, nn.Linear):
            bound = 1.0 / math.sqrt(layer.in_features)
            for parameter in layer.parameters():
                with torch.no_grad():
                    parameter.uniform_(-bound, bound, generator=generator)
            if name.endswith(("down", "last")):
                nn.init.zeros_(layer.weight)
                nn.init.zeros_(layer.bias)


WARM_UP = 0.02  # share of a training over which the learning rate rises (assumed)


def take_step(optimiser: torch.optim.Optimizer, loss: Callable[[], Tensor], share: float, rate: float) -> float:
    """Take a step of training by ``loss()``, gradients clipped to a norm of 1; return the loss. share : of the training
    that this step completes; the learning rate rises to ``rate`` at first, then falls as a cosine"""
    for group in optimiser.param_groups:
        group["lr"] = rate * min(1.0, share / WARM_UP) * 0.5 * (1.0 + math.cos(math.pi * share))
    optimiser.zero_grad()
    value = loss()
    value.backward()
    nn.utils.clip_grad_norm_([each for group in optimiser.param_groups for each in group["params"]], 1.0)
    optimiser.step()
    return float(value.detach())
