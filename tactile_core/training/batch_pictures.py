"""Signals to gels to pictures for thousands of frames at once, on a processor or a GPU, with gradients.

batch = BatchPictures(load_translator())
pictures = batch(*batch.changes(signals))    # (B, 320, 240, 3), 0 to 1

The passes are those of `translation.networks`, `pictures.height_map` and `pictures.shading`, whose numbers they read;
each frame is estimated alone, as by `Answer(frames_apart=True)`: tracking a contact through time goes frame by frame.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch
from torch import Tensor, nn

from ..errors import TactileError
from ..pictures.background import raised_light
from ..pictures.coating_spread import CoatingSpread
from ..pictures.height_map import gel_mapper
from ..pictures.shading import Shader, check_reach
from ..recordings import Signals
from ..sensors.calibration import LARGEST_LEVEL, Calibration
from ..translation.translator import Translator
from .batch.batch_heights import BatchHeights
from .batch.batch_light import BatchLamp, BatchSurface
from .batch.batch_networks import BatchNetworks
from .batch.batch_view import BatchView
from .device import device_of
from .trained_modules import keep

BLOCKS = {"cpu": 4, "cuda": 256}  # frames at once: what a processor's cache holds, and 5 GB (assumed)


class BatchPictures(nn.Module):
    """Networks, height map and fast picture in torch.

    translator : of ``load_translator``, whose networks these are; their target is the calibration's sensor
    calibration : of the camera and lights; None for the one that ships
    device : "auto", "cpu" or "cuda"
    Raises TactileError for a device that is not there, a calibration of another gel and of one with dots.
    """

    def __init__(self, translator: Translator, calibration: Calibration | None = None, device: str = "cpu") -> None:
        super().__init__()
        self._translator, self._shader = translator, Shader(calibration)
        camera, unit = self._shader.camera, self._shader.calibration
        if camera.sensor != translator.target:
            raise TactileError("batch, calibration", f"of a {camera.sensor}", f"one of a {translator.target}")
        if unit.markers is not None:
            raise TactileError("batch, markers", "a gel with dots", "one without", "Render those frame by frame")
        mapper, shader = gel_mapper(camera), self._shader
        self.networks, self.heights, self.view = (
            BatchNetworks(translator.nets),
            BatchHeights(mapper),
            BatchView(shader.view),
        )
        self.lamps = nn.ModuleList(BatchLamp(lamp) for lamp in shader.lamps.lamps)
        keep(
            self, right=shader.view.right, down=shader.view.down, facing=unit.facing.astype(np.float32)[:, None, None],
            raised=raised_light(unit, np.ones((1, 1), np.float32)), rest_radiance=shader.rest_radiance,
            background=shader.background, response=shader.response,
            sunk=np.float32(1 - unit.dome_scale) * mapper.rest,
        )  # fmt: skip
        self.spread = BatchSpread(shader.spread)
        self.to(device_of(device))

    def changes(self, signals: Signals) -> tuple[Tensor, Tensor]:
        """Return changes (B, e) counts, and the frames (B,) whose signs are lost, on the device.

        Raises TactileError for signals of another sensor.
        """
        change, rectified = self._translator.changes(signals)
        device = self.right.device
        return torch.from_numpy(change).to(device, self.right.dtype), torch.from_numpy(rectified).to(device)

    def state(self, change: Tensor, rectified: Tensor) -> Tensor:
        """Map changes (B, e) counts to the states (B, STATE) of the most plausible contacts: see `Posterior`."""
        return self.networks.state(self.networks.latent(change, rectified), rectified)

    def displacement(self, change: Tensor, rectified: Tensor, state: Tensor | None = None) -> Tensor:
        """Map changes (B, e) counts, rectified (B,) bool, to the gel's displacement (B, n, 3) m.

        state : (B, STATE) of the contacts; None for the most plausible ones
        """
        latent = self.networks.latent(change, rectified)
        state = self.networks.state(latent, rectified) if state is None else state
        return self.networks.displacement(latent, rectified, state)

    def pictures(self, displacement: Tensor) -> Tensor:
        """Return the pictures (B, H, W, 3), 0 to 1 and not rounded to levels, of displacements (B, n, 3) m.

        Raises TactileError for a gel that reaches an LED.
        """
        return self._in_blocks(self._drawn, displacement)

    def forward(self, change: Tensor, rectified: Tensor, state: Tensor | None = None) -> Tensor:
        """Map changes (B, e) counts to pictures (B, H, W, 3): `displacement`, then `pictures`, a block at a time."""
        given = [change, rectified] if state is None else [change, rectified, state]
        return self._in_blocks(lambda *block: self._drawn(self.displacement(*block)), *given)

    def _in_blocks(self, draw: Callable[..., Tensor], *given: Tensor) -> Tensor:
        """Pictures of frames (B, ...) drawn a block at a time; without gradients only their own memory grows."""
        blocks = zip(*(each.split(BLOCKS[each.device.type]) for each in given), strict=True)
        if torch.is_grad_enabled():
            return torch.cat([draw(*block) for block in blocks])
        pictures = self.background.new_empty(len(given[0]), *self.background.shape)
        for place, block in zip(pictures.split(BLOCKS[pictures.device.type]), blocks, strict=True):
            place.copy_(draw(*block))
        return pictures

    def _drawn(self, displacement: Tensor) -> Tensor:
        heights = self.heights(displacement) - self.sunk
        check_reach(heights.detach().amax(0).cpu().numpy(), self._shader.calibration, "height map")
        seen = self.view(heights)
        surface = BatchSurface.from_seen(seen, self._shader.view, self.right, self.down)
        radiance = torch.stack([lamp(surface, self.right, self.down) for lamp in self.lamps], 1)
        radiance = self.spread(radiance * self.facing + self.raised * seen[:, None])
        change = torch.einsum("clhw,blhw->bhwc", self.response, radiance - self.rest_radiance)
        return (self.background + change).clamp(0, LARGEST_LEVEL) / LARGEST_LEVEL


class BatchSpread(nn.Module):
    """`CoatingSpread` in torch."""

    def __init__(self, spread: CoatingSpread) -> None:
        super().__init__()
        self._none = spread.none
        if not spread.none:
            (self._down, down), (self._right, right) = spread.down, spread.right
            keep(self, down=down, right=right)

    def forward(self, pictures: Tensor) -> Tensor:
        """Smooth pictures (..., H, W)."""
        if self._none:
            return pictures
        sums = _summed(_summed(pictures, self._right).mT, self._down).mT
        return self.down @ (sums @ self.right.mT)


def _summed(pictures: Tensor, step: int) -> Tensor:
    """Sums (..., ceil(W / step)) of every ``step`` numbers of (..., W)."""
    return nn.functional.pad(pictures, (0, -pictures.shape[-1] % step)).unflatten(-1, (-1, step)).sum(-1)
