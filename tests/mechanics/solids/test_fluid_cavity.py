"""The fluid: exact derivatives of its volume, and a pressure that pushes back."""

import numpy as np
import pytest
from benchmarks.mechanics import fluid


def test_volume_and_derivatives_are_exact():
    mesh, cavity = fluid.hollow()
    assert cavity.volume(mesh.nodes) == pytest.approx(1.5e-3**3, rel=1e-12)  # one cell of the block is missing
    random = np.random.default_rng(0)
    nodes, direction = (random.standard_normal(mesh.nodes.shape) for _ in range(2))
    nodes = mesh.nodes + 1e-4 * nodes
    step = 1e-7
    ahead, behind = nodes + step * direction, nodes - step * direction
    slope = (cavity.volume(ahead) - cavity.volume(behind)) / (2 * step)
    assert slope == pytest.approx(cavity.gradient(nodes) @ direction.ravel(), rel=1e-6)  # the step's square
    numeric = (cavity.gradient(ahead) - cavity.gradient(behind)) / (2 * step)
    rows, columns, blocks = cavity.hessian(nodes)
    exact = np.zeros_like(nodes)
    np.add.at(exact, rows, np.einsum("kij,kj->ki", blocks, direction[columns]))
    exact = exact.ravel()
    np.testing.assert_allclose(numeric, exact, atol=1e-8 * np.abs(exact).max())


def test_a_pressed_full_cavity_has_an_overpressure():
    assert fluid.pressed(full=True)[0].fluid > 0
