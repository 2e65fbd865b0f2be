"""Points that stand for a light: a sphere as a few point lights."""

from __future__ import annotations

import numpy as np

from ...sensors.camera import Led

_GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))  # of a sunflower's seeds: even over a disc for any number of them
_GOLDEN_RATIO = (np.sqrt(5) - 1) / 2


def light_points(led: Led, count: int) -> np.ndarray:
    """Return points (count, 3) m, image frame, round the light's middle, in the plane that faces the picture's middle.

    A ring with the second moments of an even disc, the best of a few points: radius sqrt(1/2).
    """
    angle = 2 * np.pi * np.arange(count) / count
    return led.position + led.radius * np.sqrt(0.5) * _across(led, np.cos(angle), np.sin(angle))


def sphere_points(led: Led, count: int, turn: float, depth: float) -> np.ndarray:
    """Return the points (count, 3) m, image frame, of a cloud that shines as an evenly bright sphere does.

    They fill the ball with density 1 / sqrt(1 - r^2), which shows an even disc to every side (Abel's transform).
    Where nothing is in the way, such a cloud lights exactly as its middle would: the light of a point falls on a
    surface as the gradient of 1 / distance, to which Newton's shell theorem applies. To the picture's middle they are
    a sunflower. turn, depth : 0..1, where the pattern starts across and along that line
    """
    number = np.arange(count)
    radius = np.sqrt((number + (turn * 7 % 1)) / count)  # the rings move as the pattern turns
    angle = number * _GOLDEN_ANGLE + 2 * np.pi * turn
    along = np.sqrt(1 - radius**2) * np.sin(2 * np.pi * (number * _GOLDEN_RATIO + depth))
    toward = np.asarray(led.position) / np.linalg.norm(led.position)
    seeds = _across(led, radius * np.cos(angle), radius * np.sin(angle)) + np.outer(along, toward)
    return led.position + led.radius * seeds


def _across(led: Led, aside: np.ndarray, upward: np.ndarray) -> np.ndarray:
    """Vectors (n, 3) across the line to the picture's middle: aside is level, upward leans away from the gel."""
    toward = np.asarray(led.position) / np.linalg.norm(led.position)
    side = np.cross(toward, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side)
    return np.outer(aside, side) + np.outer(upward, np.cross(side, toward))
