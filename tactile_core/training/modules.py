"""The five networks in torch. Tensor names are those of `networks.py`, which holds the same forward passes in numpy."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn

from ..layers import NORM_EPSILON
from ..networks import COUNT_SCALE, ELECTRODES, SIGNAL_HIDDEN


class Plain(nn.ModuleList):
    """Linear layers with ReLU between them."""

    def __init__(self, sizes: tuple[int, ...]) -> None:
        super().__init__(nn.Linear(*pair) for pair in zip(sizes[:-1], sizes[1:], strict=True))

    def forward(self, x: Tensor) -> Tensor:
        """x (B, sizes[0]) -> (B, sizes[-1])."""
        for index, layer in enumerate(self):
            x = layer(torch.relu(x) if index else x)
        return x


class Block(nn.Module):
    """x + down(silu(up(norm(x))))."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.norm = nn.LayerNorm(width, NORM_EPSILON)
        self.up = nn.Linear(width, width)
        self.down = nn.Linear(width, width)

    def forward(self, x: Tensor) -> Tensor:
        """x (B, width) -> (B, width)."""
        return x + self.down(nn.functional.silu(self.up(self.norm(x))))


class Residual(nn.Module):
    """Residual MLP with a linear skip from input to output (networks.md)."""

    def __init__(self, inputs: int, outputs: int, width: int, blocks: int) -> None:
        super().__init__()
        self.first = nn.Linear(inputs, width)
        self.blocks = nn.ModuleList(Block(width) for _ in range(blocks))
        self.norm = nn.LayerNorm(width, NORM_EPSILON)
        self.last = nn.Linear(width, outputs)
        self.skip = nn.Linear(inputs, outputs, bias=False)

    def forward(self, x: Tensor) -> Tensor:
        """x (B, inputs) -> (B, outputs)."""
        hidden = self.first(x)
        for block in self.blocks:
            hidden = block(hidden)
        return self.last(self.norm(hidden)) + self.skip(x)


class Vae(nn.Module):
    """A beta-VAE around any encoder (to mean and logvar) and decoder."""

    def __init__(self, encoder: nn.Module, decoder: nn.Module) -> None:
        super().__init__()
        self.encoder, self.decoder = encoder, decoder

    def posterior(self, x: Tensor) -> tuple[Tensor, Tensor]:
        """x -> mean (B, L) and log variance (B, L) of the latent."""
        mean, logvar = self.encoder(x).chunk(2, -1)
        return mean, logvar.clamp(-12.0, 6.0)  # keeps exp() finite in the first steps; trained values lie well inside

    def mean(self, x: Tensor) -> Tensor:
        """x -> mean of the posterior, which is what inference uses."""
        return self.posterior(x)[0]

    def sample(self, x: Tensor, generator: torch.Generator) -> tuple[Tensor, Tensor]:
        """x -> a latent drawn from the posterior (reparameterised), and its KL divergence from N(0, 1), mean over B.

        Kingma and Welling 2014, appendix B.
        """
        mean, logvar = self.posterior(x)
        noise = torch.randn(mean.shape, generator=generator)
        divergence = 0.5 * (mean**2 + logvar.exp() - 1.0 - logvar).sum(-1).mean()
        return mean + noise * (0.5 * logvar).exp(), divergence


def signal_vae(latent: int) -> Vae:
    """SVB: 19-256-128-64 to the latent, mirrored, on compressed signals (sensors.md, later code of the authors)."""
    encoder = Plain((ELECTRODES, *SIGNAL_HIDDEN, 2 * latent))
    return Vae(encoder, Plain((latent, *SIGNAL_HIDDEN[::-1], ELECTRODES)))


def mesh_vae(modes: int, latent: int, width: int, blocks: int) -> Vae:
    """MVB or MVD on the coefficients of a linear basis."""
    return Vae(Residual(modes, 2 * latent, width, blocks), Residual(latent, modes, width, blocks))


def compress(change: Tensor) -> Tensor:
    """Counts -> the scale the networks see; see `networks.compress`."""
    return torch.asinh(change / COUNT_SCALE)


def initialise(module: nn.Module, generator: torch.Generator) -> None:
    """Draw all weights from the generator: uniform in +-1/sqrt(inputs), torch's own range for Linear.

    The layers that end a branch start at zero, so that a residual MLP starts as its linear skip.
    """
    for name, layer in module.named_modules():
        if isinstance(layer, nn.Linear):
            bound = 1.0 / math.sqrt(layer.in_features)
            for parameter in layer.parameters():
                with torch.no_grad():
                    parameter.uniform_(-bound, bound, generator=generator)
            if name.endswith(("down", "last")):
                nn.init.zeros_(layer.weight)
                nn.init.zeros_(layer.bias)
