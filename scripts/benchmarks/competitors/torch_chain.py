"""The shipped networks in torch, from changes to both displacements: what torch makes of the same arithmetic."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from tactile_core.training.modules import compress
from tactile_core.training.trained_modules import posterior_of, residual_of, signal_vae_of
from tactile_core.translation.contact_frame import PLACE_UNIT
from tactile_core.translation.network_sizes import PLACE
from tactile_core.translation.networks import Networks


class TorchChain:
    """Changes (B, 19) counts -> displacements (B, N, 3), (B, M, 3) m."""

    def __init__(self, nets: Networks) -> None:
        self.latent = nets.sizes["SVB"]["latent"]
        self.encoder = signal_vae_of(nets).encoder
        self.s2m, self.m2m = posterior_of(nets, "S2MPN"), residual_of(nets, "M2MPN")
        self.skin, self.gel = _Decoder(nets, "MVB"), _Decoder(nets, "MVD")

    @torch.inference_mode()
    def __call__(self, change: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        signal = torch.cat([torch.from_numpy(change), torch.zeros(len(change), 1)], -1)
        latent = self.encoder(compress(signal))[:, : self.latent]
        state = self.s2m.contact(latent)
        biotac = self.s2m.given(latent, state)
        digit = torch.cat([state[:, :PLACE], self.m2m(self.skin.placed(biotac)[0])[:, PLACE:]], -1)
        return self.skin(biotac).numpy(), self.gel(digit).numpy()


class _Decoder:
    """A mesh's decoder with the frame that moves."""

    def __init__(self, nets: Networks, net: str) -> None:
        tensors, self.frame = nets.tensors[net], nets.frames[net]
        self.net = residual_of(nets, net, "decoder")
        self.scale, self.wide, self.near = (torch.tensor(tensors[name]) for name in ("scale", "wide", "near"))
        self.cosine, self.sine = (torch.from_numpy(each) for each in self.frame._cosine_sine)
        self.middle = torch.tensor([self.frame.rows - 1, self.frame.columns - 1]) / 2

    def placed(self, latent: Tensor) -> tuple[Tensor, Tensor]:
        """The latent with what the whole cell leaves of its place, and the cells (B, 2)."""
        at = latent[:, :PLACE] * PLACE_UNIT + self.middle
        cell = torch.minimum(at.clamp(min=0), 2 * self.middle).round()
        return torch.cat([latent, (at - cell).clamp(-1, 1)], -1), cell.long()

    def __call__(self, latent: Tensor) -> Tensor:
        seen, cells = self.placed(latent)
        modes, frame, count = self.net(seen) * self.scale, self.frame, len(latent)
        wide = len(self.wide)
        local = (modes[:, :wide] @ self.wide).reshape(count, -1, 3)
        windows = (modes[:, wide:] @ self.near).reshape(count, frame.width, frame.width, 3)
        ring = 2 * frame.half  # a margin round the lattice, so that every window lies inside
        grid = torch.zeros(count, frame.rows + ring, frame.columns + ring, 3)
        across = torch.arange(frame.width)
        row, column = (cells[:, axis, None] + across for axis in (0, 1))
        grid[torch.arange(count)[:, None, None], row[:, :, None], column[:, None, :]] = windows
        inside = grid[:, frame.half : -frame.half, frame.half : -frame.half]
        local[:, : frame.rows * frame.columns] += inside.reshape(count, -1, 3)
        along, inward, around = local.unbind(-1)
        turned = self.cosine * inward + self.sine * around, self.cosine * around - self.sine * inward
        return torch.stack([along, *turned], -1)
