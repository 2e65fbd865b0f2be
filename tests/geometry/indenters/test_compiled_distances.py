"""Signed distances by compiled loops: those of numpy, to rounding."""

import numpy as np
import pytest

from tactile_core.files import compiled
from tactile_core.geometry.indenters import Box, BumpyCube, Cylinder, Indenter, LyingCylinder, Ring, Sphere

pytest.importorskip("numba", reason="the extra [fast] is not installed")

SHAPES = {
    "ball": Sphere(1.75e-3),
    "cylinder": Cylinder(1.75e-3, 0.4e-3),
    "lying cylinder": LyingCylinder(3.5e-3, 0.5e-3),
    "capsule": LyingCylinder(2e-3, 2e-3),
    "box": Box((14e-3, 6e-3, 9e-3), 0.5e-3),
    "ring": Ring(2.5e-3, 1e-3),
    "bumpy cube": BumpyCube(14e-3, 0.5e-3, 1.5e-3, 1e-3, 4e-3),
}
ROUNDING = 1e-15  # a few times that of numbers about 1; distances, m, are a hundred times smaller


def places(indenter: Indenter) -> np.ndarray:
    """Points (n, 3) m in and round an indenter, on its axes and in its middle, where normals are chosen."""
    lower, upper = indenter.bounds()
    random = np.random.default_rng(0).uniform(-0.5, 1.5, (2000, 3))
    line = np.linspace(lower, upper, 21)
    on_axes = [line * axis for axis in np.eye(3)]
    return np.concatenate([lower + random * (upper - lower), *on_axes, line, [(lower + upper) / 2, np.zeros(3)]])


@pytest.mark.parametrize("name", SHAPES)
def test_distances_and_gradients_are_numpys(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    points, found = places(SHAPES[name]), []
    for way in ("0", "1"):
        monkeypatch.setenv(compiled.SWITCH, way)
        compiled.available.cache_clear()
        found.append(SHAPES[name].distance(points))
        found.append(SHAPES[name].distance(np.asfortranarray(points)))
    compiled.available.cache_clear()
    plain, *others = found
    for other in others:
        for values, expected in zip(other, plain, strict=True):
            np.testing.assert_allclose(values, expected, rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("name", SHAPES)
def test_no_point_has_no_distance(name: str) -> None:
    distance, gradient = SHAPES[name].distance(np.empty((0, 3)))
    assert distance.shape == (0,) and gradient.shape == (0, 3)
