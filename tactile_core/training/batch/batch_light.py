"""The light of one LED on many gels at once, with gradients: `pictures.lamp_light` in torch."""

from __future__ import annotations

from dataclasses import dataclass

from torch import Tensor, nn

from ...pictures.lamp_light import TANGENT_MARGIN, Lamp
from ...pictures.perspective import Perspective
from .batch_shadows import BatchShadows
from .batch_view import slopes


@dataclass(frozen=True)
class BatchSurface:
    """`lamp_light.SeenSurface` of frames at once, (B, H, W), and what every LED's cosine is made of.

    slope_right, slope_down : of the seen heights; near : 1 - height over the camera's; own : m, the cosine's share that
    no LED changes; square : m2, of the distance from the origin
    """

    height: Tensor
    slope_right: Tensor
    slope_down: Tensor
    near: Tensor
    tilt: Tensor
    own: Tensor
    normal: Tensor
    square: Tensor

    @classmethod
    def from_seen(cls, seen: Tensor, view: Perspective, right: Tensor, down: Tensor) -> BatchSurface:
        """Make it of seen heights (B, H, W) m; right (1, W), down (H, 1) m, of the pixels."""
        slope_right, slope_down = slopes(seen, view.camera)
        inverse = float(view.inverse)
        near = 1 - seen * inverse
        outward = right * slope_right + down * slope_down
        tilt = near - outward * inverse
        return cls(
            seen, slope_right, slope_down, near, tilt, outward * near - tilt * seen,
            (slope_right**2 + slope_down**2 + tilt**2).sqrt(), near**2 * (right**2 + down**2) + seen**2,
        )  # fmt: skip

    def part(self, which: Tensor, box: tuple[slice, slice]) -> BatchSurface:
        """Return a box of pixels of some frames (B,) bool."""
        return BatchSurface(*(each[:, *box][which] for each in vars(self).values()))


class BatchLamp(nn.Module):
    """`Lamps.light` of one LED for frames at once."""

    def __init__(self, lamp: Lamp) -> None:
        super().__init__()
        self._position, self._strength = lamp.position.tolist(), float(lamp.strength)
        self._tangent, self._radius = float(lamp.tangent), lamp.led.radius
        self.shadows = BatchShadows(lamp.caster)

    def forward(self, surface: BatchSurface, right: Tensor, down: Tensor) -> Tensor:
        """Return the radiance (B, H, W) of surfaces, relative to a coating that faces the LED in the middle."""
        x, y, up = self._position
        distance = ((right * x + down * y) * surface.near + up * surface.height) * -2 + surface.square + self._strength
        facing = up * surface.tilt - x * surface.slope_right - y * surface.slope_down + surface.own
        lit = facing.clamp(min=0)
        edge = facing.detach() < self._tangent * surface.normal.detach()
        which = edge.flatten(1).any(1)
        if which.any():
            mapped = (surface.height / surface.near)[which]
            sight, box = self.shadows.sight(mapped, edge[which], TANGENT_MARGIN)
            lit[:, *box][which] = self._shadowed(
                sight, surface.part(which, box), facing[:, *box][which], distance[:, *box][which]
            )
        return lit / (distance * distance.sqrt() * surface.normal) * self._strength

    def _shadowed(self, sight: Tensor, surface: BatchSurface, facing: Tensor, square: Tensor) -> Tensor:
        """See `Lamp._shadowed`."""
        share, moment = self.shadows.disc_share(sight)
        above = self._position[2] - surface.height
        moment = moment * (surface.tilt * square - above * facing)
        moment = moment * (self._radius / ((square - above**2) * square).sqrt())
        return (share * facing + moment).clamp(min=0)
