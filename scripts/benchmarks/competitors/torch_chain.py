"""The shipped networks in torch, from changes to both displacements: what torch makes of the same arithmetic."""

from __future__ import annotations

import numpy as np
import torch

from tactile_core.training.batch.batch_field import BatchField, with_place
from tactile_core.training.modules import compress
from tactile_core.training.trained_modules import posterior_of, residual_of, signal_vae_of
from tactile_core.translation.network_sizes import PLACE
from tactile_core.translation.networks import Networks


class TorchChain:
    """Changes (B, 19) counts -> displacements (B, N, 3), (B, M, 3) m."""

    def __init__(self, nets: Networks) -> None:
        self.latent = nets.sizes["SVB"]["latent"]
        self.encoder = signal_vae_of(nets).encoder
        self.s2m, self.m2m = posterior_of(nets, "S2MPN"), residual_of(nets, "M2MPN")
        self.skin, self.gel = BatchField(nets, "MVB"), BatchField(nets, "MVD")
        self.frame = nets.frames["MVB"]

    @torch.inference_mode()
    def __call__(self, change: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        signal = torch.cat([torch.from_numpy(change), torch.zeros(len(change), 1)], -1)
        latent = self.encoder(compress(signal))[:, : self.latent]
        state = self.s2m.contact(latent)
        biotac = self.s2m.given(latent, state)
        digit = torch.cat([state[:, :PLACE], self.m2m(with_place(self.frame, biotac)[0])[:, PLACE:]], -1)
        return self.skin(biotac).numpy(), self.gel(digit).numpy()
