"""Draw the bodies of presses at random, beyond the indenters that a scene lists. Sizes are log-uniform: a small ball is
as likely as a large one. Ranges are assumed, from bodies that a fingertip feels as points to those it feels as planes.
"""

from __future__ import annotations

import numpy as np

from ..geometry.indenters import Box, Cylinder, Edge, Indenter, LyingCylinder, Pose, Ring, Several, Sphere

NAME = "random body"  # in the list of a file's indenters
_MM = 1e-3


def random_body(random: np.random.Generator) -> Indenter:
    """Draw a ball, block, wedge, standing or lying cylinder, ring, or group of two or three balls; all but balls are
    turned at random about the axis along which bodies are pressed."""
    shape = _SHAPES[random.choice(len(_SHAPES), p=_SHARES)]
    return shape(random) if shape in (_ball, _balls) else _turned(random, shape(random))


def _between(random: np.random.Generator, least: float, most: float) -> float:
    """Draw a length, m, between least and most, both mm, uniform in its logarithm."""
    return float(np.exp(random.uniform(np.log(least), np.log(most)))) * _MM


def _ball(random: np.random.Generator) -> Indenter:
    return Sphere(_between(random, 1, 40))


def _block(random: np.random.Generator) -> Indenter:
    """Draw a bar, a brick or a plate."""
    sizes = _between(random, 2, 60), _between(random, 2, 60), _between(random, 10, 20)
    return Box(sizes, min(_between(random, 0.2, 2), 0.45 * min(sizes)))


def _wedge(random: np.random.Generator) -> Indenter:
    return Edge(np.radians(random.uniform(40, 150)), _between(random, 0.2, 2), _between(random, 6, 60))


def _standing(random: np.random.Generator) -> Indenter:
    radius = _between(random, 1, 20)
    return Cylinder(radius, min(_between(random, 0.2, 1), 0.45 * radius), 10e-3)


def _lying(random: np.random.Generator) -> Indenter:
    radius, length = _between(random, 1, 40), _between(random, 4, 60)
    return LyingCylinder(radius, 0.45 * min(radius, length / 2, 1e-3), length)


def _ring(random: np.random.Generator) -> Indenter:
    tube = _between(random, 0.4, 2)
    return Ring(tube + _between(random, 1, 8), tube)


def _balls(random: np.random.Generator) -> Indenter:
    """Draw two or three balls whose lowest points lie in one plane: a rough or a double contact."""
    parts = []
    for _ in range(random.integers(2, 4)):
        apex = np.array([*random.uniform(-4, 4, 2), 0.0]) * _MM
        parts.append((Sphere(_between(random, 1, 5)), Pose(apex, np.eye(3))))
    return Several(tuple(parts))


def _turned(random: np.random.Generator, body: Indenter) -> Indenter:
    angle = random.uniform(0, np.pi)
    c, s = np.cos(angle), np.sin(angle)
    return Several(((body, Pose(np.zeros(3), np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]]))),))


_SHAPES = (_ball, _block, _wedge, _standing, _lying, _ring, _balls)
_SHARES = (0.15, 0.35, 0.08, 0.1, 0.17, 0.05, 0.1)
