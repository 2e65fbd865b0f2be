"""A surface that has let the indenter through between its nodes is not taken for a contact."""

import numpy as np
import pytest

from tactile_core.geometry.indenters import Pose, Sphere
from tactile_core.mechanics.error_estimate import of_finite_strain
from tactile_core.mechanics.penetration import PenetrationError, check_follows, penetration_between

DOWN = Pose(np.zeros(3), np.eye(3))  # moves along -z; a ball's tip stands at the origin


def flat(height: float) -> np.ndarray:
    """Nodes (5, 5, 3) m, 1 mm apart; the middle of four of them lies under the origin."""
    x, y = np.meshgrid(np.arange(5) - 2.5, np.arange(5) - 2.5, indexing="ij")
    return np.stack([1e-3 * x, 1e-3 * y, np.full_like(x, height)], -1)


def test_what_lies_between_the_nodes_is_seen():
    ball = Sphere(0.5e-3)  # 0.7 mm from the nodes beside it
    assert penetration_between("here", flat(0.2e-3), ball, DOWN, 0.6e-3, closed=False) == pytest.approx(
        0.2e-3, rel=1e-9
    )
    assert penetration_between("here", flat(-0.1e-3), ball, DOWN, 0.6e-3, closed=False) == 0.0
    with pytest.raises(PenetrationError, match=r"here: the indenter has sunk 0\.300 mm in between"):
        penetration_between("here", flat(0.3e-3), ball, DOWN, 0.6e-3, closed=False)


def test_nodes_on_the_back_of_the_indenter_are_refused():
    ball, away = Sphere(2e-3), flat(-1e-3)
    beside = np.array([[0.0, 0.0, -1.0], [0.97, 0.0, 0.2425]])
    check_follows("here", away, ball, DOWN, 0.1e-3, beside, closed=False)
    with pytest.raises(PenetrationError, match="some lie on its back"):
        check_follows("here", away, ball, DOWN, 0.1e-3, np.array([[0.0, 0.0, -1.0], [0.0, 0.6, 0.8]]), closed=False)


def test_what_is_hidden_is_stated():
    table = (7.5e-6, 0.006)
    assert of_finite_strain(table, 0.8e-3, 50, 9.0, 50e-6) == table
    shape, force = of_finite_strain(table, 0.8e-3, 50, 9.0, 0.3e-3)
    assert shape == pytest.approx(0.105e-3) and force == pytest.approx(0.375)
