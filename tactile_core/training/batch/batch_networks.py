"""Changes of a BioTac's electrodes to the displacement of a gel, for any number of frames at once, with gradients."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from ...translation.network_sizes import PLACE
from ...translation.networks import Networks
from ...translation.posterior import LEAST_FORCE
from ..modules import compress
from ..trained_modules import posterior_of, residual_of, signal_vae_of
from .batch_field import BatchField, with_place


class BatchNetworks(nn.Module):
    """The networks that lead from a signal to the gel: see `translation.networks`, whose passes these are."""

    def __init__(self, nets: Networks) -> None:
        super().__init__()
        self.signal, self.across = signal_vae_of(nets), residual_of(nets, "M2MPN")
        self.signed, self.rectified = posterior_of(nets, "S2MPN"), posterior_of(nets, "R2MPN")
        self._skin, self.gel = nets.frames["MVB"], BatchField(nets, "MVD")
        self.requires_grad_(False)

    def latent(self, change: Tensor, rectified: Tensor) -> Tensor:
        """Map changes (B, e) counts, rectified or not (B,), to latent_signal (B, K)."""
        signed = torch.where(rectified[:, None], -change.abs(), change)
        return self.signal.mean(compress(torch.cat([signed, rectified[:, None].to(change)], -1)))

    def state(self, latent: Tensor, rectified: Tensor) -> Tensor:
        """Map latent_signal (B, K) to the state (B, STATE) of the most plausible contact of each frame alone."""
        return self._either(rectified, self.signed.contact(latent), self.rectified.contact(latent))

    def displacement(self, latent: Tensor, rectified: Tensor, state: Tensor) -> Tensor:
        """Map latent_signal (B, K) and states (B, STATE) to the gel's displacement (B, n, 3) m; none without contact.

        A state's place moves the dent by whole cells, which have no gradient, and by what they leave, which has.
        """
        skin = self._either(rectified, self.signed.given(latent, state), self.rectified.given(latent, state))
        across = self.across(with_place(self._skin, skin)[0])
        gel = self.gel(torch.cat([state[:, :PLACE], across[:, PLACE:]], -1))
        return gel * (state[:, PLACE, None, None] >= LEAST_FORCE)

    @staticmethod
    def _either(rectified: Tensor, with_sign: Tensor, without: Tensor) -> Tensor:
        return torch.where(rectified[:, None], without, with_sign)
