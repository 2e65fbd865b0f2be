"""A mesh's displacement from its latent, for any number of frames at once, with gradients."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from ...translation.contact_frame import ContactFrame
from ...translation.network_sizes import PLACE
from ...translation.networks import Networks
from ..surface_codec import cells_of
from ..trained_modules import keep, residual_of


class BatchField(nn.Module):
    """The decoder of a mesh, with the frame that moves. net : "MVB", the skin, or "MVD", the gel."""

    def __init__(self, nets: Networks, net: str) -> None:
        super().__init__()
        self.decoder, self._frame = residual_of(nets, net, "decoder"), nets.frames[net]
        turn = torch.from_numpy(self._frame.turn.copy())
        keep(
            self, cosine=torch.cos(turn).numpy(), sine=torch.sin(turn).numpy(),
            **{name: nets.tensors[net][name] for name in ("wide", "near", "scale")},
        )  # fmt: skip
        self.requires_grad_(False)

    def forward(self, latent: Tensor) -> Tensor:
        """Decode latents (B, L) to displacement (B, n, 3) m in the shared frame."""
        placed, cell = with_place(self._frame, latent)
        modes = self.decoder(placed) * self.scale
        wide = len(self.wide)
        local = (modes[:, :wide] @ self.wide).view(len(latent), -1, 3)
        grid = self._frame.rows * self._frame.columns
        local[:, :grid] += self._on_lattice(modes[:, wide:] @ self.near, cell)
        along, inward, around = local.unbind(-1)
        shared = along, self.cosine * inward + self.sine * around, self.cosine * around - self.sine * inward
        return torch.stack(shared, -1)

    def _on_lattice(self, windows: Tensor, cell: Tensor) -> Tensor:
        """Lay windows (B, 3 w^2) round cells (B, 2) on the lattice (B, rows columns, 3); 0 outside of them."""
        frame, half = self._frame, self._frame.half
        rows, columns = frame.rows + 2 * half, frame.columns + 2 * half  # with a rim that windows may reach over
        across = torch.arange(frame.width, device=cell.device)
        place = (cell[:, :1, None] + across[:, None]) * columns + cell[:, 1:, None] + across
        wider = windows.new_zeros(len(windows), rows * columns, 3)
        index = place.flatten(1)[..., None].expand(-1, -1, 3)
        wider = wider.scatter(1, index, windows.view(len(windows), -1, 3))
        inside = wider.view(-1, rows, columns, 3)[:, half : half + frame.rows, half : half + frame.columns]
        return inside.flatten(1, 2)


def with_place(frame: ContactFrame, latent: Tensor) -> tuple[Tensor, Tensor]:
    """Return latents (B, L) with what whole cells leave of their place, (B, L + 2), and the cells (B, 2)."""
    cell, left = cells_of(frame, latent[:, :PLACE])
    return torch.cat([latent, left], -1), cell
