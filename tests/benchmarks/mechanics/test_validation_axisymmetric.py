"""The axisymmetric solid: derivatives that belong together, and the answer of the solid in space."""

import numpy as np
import pytest
from benchmarks.mechanics import golden
from benchmarks.mechanics.axisymmetric import AxisymmetricSolid, disc, graded, pressed
from benchmarks.mechanics.golden import GOLDEN_FORCE, quarter_disc

from tactile_core.geometry.indenters import Sphere, pose_on
from tactile_core.mechanics.finite_strain.newton import FiniteStrainContact
from tactile_core.mechanics.solids.finite_strain import FiniteStrainSolid, NeoHookean
from tactile_core.sensors import Material

RUBBER = Material(1e6, 0.49)


@pytest.fixture(scope="module")
def solid():
    return AxisymmetricSolid(disc(np.linspace(0, 2e-3, 5), np.linspace(0, 1e-3, 5)), NeoHookean.from_material(RUBBER))


def test_newton_step_is_second_order(solid):
    random = np.random.default_rng(0)
    state, loose = solid.rest(), ~solid.mesh.fixed.reshape(-1, 3)
    state.displacement = loose * 2e-5 * random.standard_normal(loose.shape)
    direction = loose * random.standard_normal(loose.shape)
    state.pressure += solid.linearise(state).pressure_step(np.zeros_like(direction))
    lines = solid.linearise(state)
    left = []
    for size in (1e-7, 1e-8):
        after = state.copy()
        after.displacement += size * direction
        after.pressure += lines.pressure_step(size * direction)
        predicted = lines.internal_force() + lines.matrix() @ (size * direction).ravel()
        left.append(np.abs(solid.linearise(after).internal_force(condensed=False) - predicted).max())
    assert np.log10(left[0] / left[1]) > 1.9


def test_squeezed_rod_has_the_analytic_stress(solid):
    """Stretches (s, s, t) everywhere: the axial force over the area at rest is the first Piola-Kirchhoff stress."""
    s, t = 1.2, 0.8
    state = solid.rest()
    state.displacement = solid.mesh.nodes * [s - 1, t - 1, 0]
    state.pressure += solid.linearise(state).pressure_step(np.zeros_like(state.displacement))
    force = solid.linearise(state).internal_force().reshape(-1, 3)
    j, law = s * s * t, solid.law
    stress = law.shear * j ** (-2 / 3) * (t - (2 * s * s + t * t) / 3 / t) + law.bulk * (j - 1) * j / t
    area = np.pi * 4e-6
    assert force[solid.mesh.surface, 1].sum() == pytest.approx(-stress * area, rel=1e-12)


def test_grading_keeps_its_even_part_and_its_end():
    places = graded(1.0, 0.1, 5.0, 1.2)
    steps = np.diff(places)
    assert len(places) % 2 == 1 and places[0] == 0 and places[-1] == pytest.approx(5.0, rel=1e-12)
    np.testing.assert_allclose(steps[:10], 0.1, rtol=1e-9)
    assert (steps[11:] / steps[10:-1] == pytest.approx(1.2, rel=1e-9)) and steps[10] < 0.15


def test_same_force_as_the_quarter_disc_in_space():
    """Meshes of one spacing agree to what is left of it."""
    radius, thickness, depth = 6e-3, 2e-3, 0.4e-3
    ball, rows = Sphere(4e-3), np.array([0, 0.3, 0.6, 0.8, 1])
    mesh, fixed = quarter_disc(radius, thickness, 2.4e-3, (8, 4), rows)
    near = mesh.surface[np.hypot(*mesh.nodes[mesh.surface][:, [0, 2]].T) < 2.4e-3]
    pose = pose_on(ball, np.array([0, -thickness, 0]), np.array([0, -1.0, 0]))
    solid = FiniteStrainContact(FiniteStrainSolid(mesh, RUBBER), near, ball, pose, fixed=fixed)
    flat = pressed(disc(graded(2.4e-3, 0.3e-3, radius, 1.3), rows * thickness), RUBBER, ball, 2.4e-3)
    forces = [part * contact.press(depth, step=0.2e-3).force[1] for part, contact in ((4, solid), (1, flat))]
    # 2 %: the edge of the patch falls between nodes 0.3 mm apart, in different places
    assert forces[0] == pytest.approx(forces[1], rel=0.02)


def test_golden_forces_within_half_a_percent_to_60_percent_depth():
    contact = golden.disc(0.1e-3)
    for touch in golden.path(contact):
        assert touch.force[1] == pytest.approx(GOLDEN_FORCE[touch.depth], rel=0.005)
        assert (touch.outer.pressing > 0).all()
    assert contact.solid.deformation(touch.state.displacement)[1].min() > 0.8  # cells keep their shape
