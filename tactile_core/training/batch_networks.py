"""Changes of a BioTac's electrodes to the displacement of a gel, for any number of frames at once, with gradients."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from ..translation.network_sizes import PLACE
from ..translation.networks import Networks
from ..translation.posterior import LEAST_FORCE
from .modules import compress
from .surface_codec import cells_of
from .trained_modules import keep, posterior_of, residual_of, signal_vae_of


class BatchNetworks(nn.Module):
    """The networks that lead from a signal to the gel: see `translation.networks`, whose passes these are."""

    def __init__(self, nets: Networks) -> None:
        super().__init__()
        self.signal, self.across, self.decoder = (
            signal_vae_of(nets), residual_of(nets, "M2MPN"), residual_of(nets, "MVD", "decoder")
        )  # fmt: skip
        self.signed, self.rectified = posterior_of(nets, "S2MPN"), posterior_of(nets, "R2MPN")
        self._skin, self._gel = nets.frames["MVB"], nets.frames["MVD"]
        cosine, sine = (part(torch.from_numpy(self._gel.turn.copy())).numpy() for part in (torch.cos, torch.sin))
        keep(self, cosine=cosine, sine=sine, **{name: nets.tensors["MVD"][name] for name in ("wide", "near", "scale")})
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
        placed = torch.cat([skin, cells_of(self._skin, skin[:, :PLACE])[1]], -1)
        gel = torch.cat([state[:, :PLACE], self.across(placed)[:, PLACE:]], -1)
        touched = state[:, PLACE, None, None] >= LEAST_FORCE
        return self._field(gel) * touched

    def _field(self, latent: Tensor) -> Tensor:
        """Decode latent_digit (B, L) to displacement (B, n, 3) m in the shared frame."""
        cell, left = cells_of(self._gel, latent[:, :PLACE])
        modes = self.decoder(torch.cat([latent, left], -1)) * self.scale
        wide = len(self.wide)
        local = (modes[:, :wide] @ self.wide).view(len(latent), -1, 3)
        grid = self._gel.rows * self._gel.columns
        near = self._on_lattice(modes[:, wide:] @ self.near, cell)
        along, inward, around = torch.cat([local[:, :grid] + near, local[:, grid:]], 1).unbind(-1)
        shared = along, self.cosine * inward + self.sine * around, self.cosine * around - self.sine * inward
        return torch.stack(shared, -1)

    def _on_lattice(self, windows: Tensor, cell: Tensor) -> Tensor:
        """Lay windows (B, 3 w^2) round cells (B, 2) on the lattice (B, rows columns, 3); 0 outside of them."""
        frame, half = self._gel, self._gel.half
        rows, columns = frame.rows + 2 * half, frame.columns + 2 * half  # with a rim that windows may reach over
        across = torch.arange(frame.width, device=cell.device)
        place = (cell[:, :1, None] + across[:, None]) * columns + cell[:, 1:, None] + across
        wider = windows.new_zeros(len(windows), rows * columns, 3)
        index = place.flatten(1)[..., None].expand(-1, -1, 3)
        wider = wider.scatter(1, index, windows.view(len(windows), -1, 3))
        inside = wider.view(-1, rows, columns, 3)[:, half : half + frame.rows, half : half + frame.columns]
        return inside.flatten(1, 2)

    @staticmethod
    def _either(rectified: Tensor, with_sign: Tensor, without: Tensor) -> Tensor:
        return torch.where(rectified[:, None], without, with_sign)
