"""Known answers of bonded layers agree with each other where their ranges meet."""

import numpy as np
import pytest
from benchmarks.mechanics.golden import exact_layer

BALL, YOUNGS = 1.0, 1e6


@pytest.mark.parametrize("poisson", [0.3, 0.48, 0.5])
def test_a_deep_layer_is_a_half_space(poisson):
    depth = 1e-4
    contact, found, force = exact_layer(depth, BALL, 1e4 * np.sqrt(BALL * depth), YOUNGS, poisson)
    hertz = 4 / 3 * YOUNGS / (1 - poisson**2) * np.sqrt(BALL) * depth**1.5
    # the layer's first correction is 1.133 sqrt(R d) / h at nu = .5
    assert found == pytest.approx(depth, rel=1e-10)
    assert force == pytest.approx(hertz, rel=1.5e-4)
    assert contact == pytest.approx(np.sqrt(BALL * depth), rel=1.5e-4)


def test_thin_incompressible_layer():
    """F = (2 pi / 3) E R^2 d^3 / h^3, within the tenth that is left at a contact of eleven thicknesses."""
    thickness, depth = 0.01, 36e-4
    contact, _, force = exact_layer(depth, BALL, thickness, YOUNGS, 0.5)
    assert contact / thickness == pytest.approx(11, abs=1)
    assert force == pytest.approx(2 * np.pi / 3 * YOUNGS * BALL**2 * depth**3 / thickness**3, rel=0.13)
