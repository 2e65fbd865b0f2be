"""Traction of translated gels: as large as the force that is told beside it, and what is said of it."""

import numpy as np
import pytest

from tactile_core.geometry.indenters import Sphere
from tactile_core.jobs.solved_gel import describe_miss, gel_traction
from tactile_core.mechanics.node_areas import node_areas
from tactile_core.mechanics.placement import Placement
from tactile_core.mechanics.solve import solve


def test_a_traction_adds_up_to_the_force_s_size_along_the_gel_s_own_shear():
    pressed = solve("digit", Sphere(3.5e-3), Placement(-8e-3, 0.0, 0.3, 0.5), depth=0.6e-3)
    size = np.linalg.norm(pressed.force)
    arrays = {
        "displacement_digit": np.stack([pressed.displacement] * 3).astype(np.float32),
        "contact_center": np.array([[-8e-3, 0], [-8e-3, 0], [np.nan, np.nan]], np.float32),
        "force": np.array([[0, 0, size], [0, 2 * size, 0], [0, size, 0]], np.float32),  # of the finger's own frame
    }
    found = gel_traction(arrays)
    sums = np.einsum("tnk,n->tk", found["traction_digit"], node_areas("digit"))
    np.testing.assert_allclose(sums, found["traction_force"], atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(sums, axis=1), [size, 2 * size, 0], rtol=1e-5)
    # 1.7 % in nine of ten true dents of nine indenters
    np.testing.assert_allclose(sums[0], pressed.force, atol=0.03 * size)
    assert not found["traction_digit"][2].any()


@pytest.mark.parametrize(
    ("total", "solved", "words"),
    [
        ([[0, 0, 0], [0, 0, 0]], False, "2 of 2 frames with a force show no patch that is pressed"),
        ([[0, 1, 0], [3, 0, 0]], False, "as large as the networks'"),
        ([[0, 1.1, 0], [3.3, 0, 0]], True, "within 10.0% in half of the frames"),
    ],
)
def test_what_a_traction_misses_is_said(total, solved, words):
    force = np.array([[0, 0, 1.0], [0, 3.0, 0]])
    assert words in describe_miss(np.array(total, float), force, solved)
    assert "no frame is in contact" in describe_miss(np.array(total, float), 0 * force, solved)
