"""Compiled loops give numpy's heights to a nanometre, and numpy's pictures to the bit."""

import numpy as np

from tactile_core import sensors
from tactile_core.pictures.height_map import folds_counted, gel_mapper
from tactile_core.pictures.renderer import Renderer


def dents(count: int) -> np.ndarray:
    """Smooth displacements (count, n, 3) m at random places: dents that also move sideways."""
    random, rest = np.random.default_rng(5), sensors.digit_surface().rest
    moved = np.zeros((count, *rest.shape))
    for each in moved:
        x, z = random.uniform(-13e-3, -2e-3), random.uniform(-4e-3, 4e-3)
        shape = np.exp(-((rest[:, 0] - x) ** 2 + (rest[:, 2] - z) ** 2) / random.uniform(1e-3, 3e-3) ** 2)
        each[:] = shape[:, None] * random.uniform([-0.2e-3, 0.1e-3, -0.2e-3], [0.2e-3, 0.9e-3, 0.2e-3])
    return moved


def test_heights_and_pictures_are_numpys(compiled_loops):
    renderer, mapper, found = Renderer(preset="fast"), gel_mapper(), {}
    for on in (False, True):
        compiled_loops(on)
        heights = mapper(dents(12))
        found[on] = heights, [renderer(height) for height in heights]
    assert np.abs(found[True][0] - found[False][0]).max() < 1e-9  # m, float32's rounding of a height
    compiled_loops(True)
    for height, picture in zip(*found[False], strict=True):
        np.testing.assert_array_equal(renderer(height), picture)  # light, shadows and levels, to the bit
    assert np.ptp(found[True][1][0].astype(int) - found[True][1][1]) > 20  # grey levels: something is seen


def test_a_gel_that_folds_over_itself_is_counted_as_numpy_counts_it(compiled_loops):
    rest, folding = sensors.digit_surface().rest, np.zeros((1, *sensors.digit_surface().rest.shape))
    folding[0, :, 0] = 1e-3 * np.sin(
        rest[:, 0] / 0.4e-3
    )  # m, pushed along the finger farther than its places lie apart
    found = {}
    for on in (False, True):
        compiled_loops(on)
        with folds_counted() as folds:
            found[on] = gel_mapper()(folding), folds
    assert found[True][1] == found[False][1] and found[True][1][0] > 100
    assert np.isfinite(found[True][0]).all()
