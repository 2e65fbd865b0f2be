"""Contacts are the same whether numba compiles their loops or not."""

import numpy as np
import pytest

from tactile_core.files import compiled
from tactile_core.geometry.indenters import Box, LyingCylinder, Ring, Sphere
from tactile_core.mechanics.placement import Placement
from tactile_core.mechanics.solve import Step, solve_path

SHAPES = {
    "ball": Sphere(1.5e-3),
    "box": Box((2e-3, 2e-3, 2e-3), 0.3e-3),
    "side": LyingCylinder(1e-3, 0.5e-3, 3e-3),
    "ring": Ring(1.5e-3, 0.5e-3),
}
# arcsinh, cosine and sine of numpy and of the C library differ in their last bits. Before version 2 numpy multiplies a
# single float32 by a Python float in float64, numba in float32, as a matrix is stored: 6e-8 an operation.
ROUNDING = 1e-10 if np.lib.NumpyVersion(np.__version__) >= "2.0.0" else 1e-6
PATH = [Step(depth=0.1e-3), Step(depth=0.1e-3, slide=(0.1e-3, 0.0)), Step(force=0.05)]


@pytest.mark.parametrize("friction", [0.0, 0.78])
@pytest.mark.parametrize("sensor", ["digit", "biotac"])
@pytest.mark.parametrize("name", SHAPES)
def test_contacts_do_not_depend_on_what_is_installed(name, sensor, friction, compiled_loops):
    place, found = Placement(-6e-3, 1e-3, 0.1, 1.0), []
    for on in (True, False):
        compiled_loops(on)
        assert compiled.available() == on
        found.append(list(solve_path(sensor, SHAPES[name], place, PATH, friction=friction)))
    for fast, plain in zip(*found, strict=True):
        assert fast.converged and fast.iterations == plain.iterations
        np.testing.assert_array_equal(fast.contact_patch, plain.contact_patch)
        for one, other in ((fast.displacement, plain.displacement), (fast.force, plain.force)):
            np.testing.assert_allclose(one, other, rtol=0, atol=ROUNDING * np.abs(other).max())
