"""The finite-strain solid and its contact: linear elasticity at rest, the golden forces. The oracle checks the rest."""

import numpy as np
import pytest
from benchmarks.mechanics.golden import GOLDEN_BALL, GOLDEN_FORCE, GOLDEN_RADIUS, GOLDEN_THICKNESS, quarter_disc
from slab import assemble, slab_mesh

from tactile_core.geometry.indenters import Sphere, pose_on
from tactile_core.mechanics.finite_strain.newton import FiniteStrainContact
from tactile_core.mechanics.solids.finite_strain import FiniteStrainSolid
from tactile_core.sensors import Material

RUBBER = Material(1e6, 0.49)


@pytest.fixture(scope="module")
def block():
    x = np.linspace(-1, 1, 5) * 1e-3
    mesh, _ = slab_mesh(x, x, x[::-1].copy())
    return FiniteStrainSolid(mesh, RUBBER)


def test_tangent_at_rest_is_linear_elasticity(block):
    tangent, linear = block.linearise(block.rest()).matrix(), assemble(block.mesh, RUBBER)
    assert abs(tangent - linear).max() < 1e-12 * abs(linear).max()  # round-off


@pytest.fixture(scope="module")
def layer():
    """The disc of the golden numbers, a quarter of it, nodes every 0.44 mm: coarse, so that the test stays short."""
    layers = np.array([0, 0.25, 0.5, 0.7, 0.85, 0.925, 1])
    mesh, fixed = quarter_disc(GOLDEN_RADIUS, GOLDEN_THICKNESS, 4.4e-3, (10, 4), layers)
    ball = Sphere(GOLDEN_BALL)
    pose = pose_on(ball, np.array([0, -GOLDEN_THICKNESS, 0]), np.array([0, -1.0, 0]))
    near = np.hypot(*mesh.nodes[mesh.surface][:, [0, 2]].T) < 4.2e-3
    return FiniteStrainContact(FiniteStrainSolid(mesh, RUBBER), mesh.surface[near], ball, pose, fixed=fixed)


def test_golden_forces_to_half_the_thickness_and_work_equals_energy(layer):
    touch, forces, depths = None, [0.0], [0.0]
    for depth in (0.2e-3, 0.4e-3, 0.6e-3, 0.8e-3, 1.0e-3, 1.2e-3, 1.4e-3):
        touch = layer.press(depth, touch, step=0.2e-3)
        forces.append(4 * touch.force[1])
        depths.append(depth)
        if depth in GOLDEN_FORCE and depth > 0.5e-3:
            # 3 %: nodes 0.44 mm apart under patches of 1.4 to 2.2 mm; with 0.35 mm it is 1.5, 0.1 and 0.3 %
            assert forces[-1] == pytest.approx(GOLDEN_FORCE[depth], rel=0.03)
    assert (touch.outer.pressing > 0).all()
    # without friction the indenter's work is the stored energy; the trapezoid rule on seven steps is 1 % high
    work = (np.convolve(forces, [0.5, 0.5], "valid") * np.diff(depths)).sum()
    assert 4 * layer.solid.energy(touch.state) == pytest.approx(work, rel=0.02)
