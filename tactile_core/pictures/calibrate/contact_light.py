"""Light that comes through the coating where something bright touches it: what a photograph holds and no gel explains.

A thin coating shows a little of what lies behind it. A ball that light shines through, or a light ball, brightens the
whole contact by the same levels, wherever on the gel it is pressed: on one day's photographs of a real unit by 40, on
another day's by 10. It is no number of the unit, so that it is fitted to each photograph, as drift is.
"""

from __future__ import annotations

import numpy as np

from .ball_pictures import BallPictures

CONTACT_SHARE = 0.8  # radius of the contact over sqrt(2 R depth), by the table of prints
SOFT = 0.25e-3  # m, over which the light falls off at the contact's edge (assumed)
LIKELY = 20.0  # grey levels, how large it is (assumed): holds it near none where few pixels tell


def contact_radius(depth: float, radius: float) -> float:
    """Return the radius, m, of the contact of a ball of a radius pressed so deep, m."""
    return float(min(CONTACT_SHARE * np.sqrt(2 * radius * depth), radius))


def contact_disc(bench: BallPictures, ball: tuple[float, float, float, float]) -> np.ndarray:
    """Return the share (H, W), 0..1, of each pixel that shows the contact of a ball (right, down, depth, radius), m."""
    right, down, depth, radius = ball
    distance = np.hypot(bench.right - right, bench.down - down)
    return 1 / (1 + np.exp((distance - contact_radius(depth, radius)) / SOFT))


def fitted_light(left: np.ndarray, disc: np.ndarray, model_error: float) -> np.ndarray:
    """Fit a disc's (n,) light (3,), grey levels, to the residual ``left`` (n, 3) of a picture, by least squares."""
    return disc @ left / (disc @ disc + (model_error / LIKELY) ** 2)
