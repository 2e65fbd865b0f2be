"""The fluid: exact derivatives of its volume, and a volume that stays."""

import numpy as np
import pytest

from tactile_core.geometry.indenters import Sphere, pose_on
from tactile_core.mechanics.finite_strain.newton import FiniteStrainContact
from tactile_core.mechanics.solids.finite_strain import FiniteStrainSolid
from tactile_core.mechanics.solids.fluid_cavity import FluidCavity
from tactile_core.mechanics.solids.hex_mesh import HexMesh, hex_cells
from tactile_core.sensors import Material

INNER, OUTER, COLUMNS, STATIONS = 4e-3, 5.5e-3, 12, 9


def bubble() -> tuple[HexMesh, np.ndarray]:
    """A hollow ball of rubber, clamped on its upper inner half, and the inner faces seen from outside the fluid."""
    polar = np.linspace(0, np.pi, STATIONS)[1:-1]
    azimuth = np.arange(COLUMNS) * 2 * np.pi / COLUMNS
    direction = np.stack(
        np.broadcast_arrays(
            np.cos(polar)[:, None], np.sin(polar)[:, None] * np.sin(azimuth), np.sin(polar)[:, None] * np.cos(azimuth)
        ),
        -1,
    )
    radius = np.linspace(INNER, OUTER, 3)
    ring = direction[..., None, :] * radius[:, None]
    poles = np.concatenate([radius[:, None] * [1.0, 0, 0], radius[:, None] * [-1.0, 0, 0]])
    nodes = np.concatenate([ring.reshape(-1, 3), poles])
    ids = np.arange(ring[..., 0].size).reshape(ring.shape[:-1])
    ends = [np.broadcast_to(ids.size + 3 * k + np.arange(3), (1, COLUMNS, 3)) for k in (0, 1)]
    closed = np.concatenate([ends[0], ids, ends[1]])
    closed = np.concatenate([closed, closed[:, :1]], axis=1)
    inner = closed[..., 0]
    faces = np.stack([
        inner[i : i + 3, j : j + 3].ravel() for i in range(0, STATIONS - 1, 2) for j in range(0, COLUMNS, 2)
    ])  # fmt: skip
    if FluidCavity(faces, len(nodes)).volume(nodes) < 0:
        faces = faces.reshape(-1, 3, 3).swapaxes(1, 2).reshape(-1, 9)
    clamped = (np.linalg.norm(nodes, axis=1) < INNER * 1.001) & (nodes[:, 1] > 0.3 * INNER)
    touchable = np.concatenate([ids[..., -1].ravel(), ids.size + np.array([2, 5])])
    cells = hex_cells(closed)
    mesh = HexMesh(nodes, cells, clamped, touchable, np.empty(0, int))
    try:
        FiniteStrainSolid(mesh, Material(1e6, 0.48))
    except ValueError:
        mesh = HexMesh(nodes, cells.reshape(-1, 3, 3, 3)[:, ::-1].reshape(-1, 27), clamped, touchable, np.empty(0, int))
    return mesh, faces


@pytest.fixture(scope="module")
def ball():
    return bubble()


def test_volume_and_derivatives_are_exact(ball):
    mesh, faces = ball
    cavity = FluidCavity(faces, len(mesh.nodes))
    # a polyhedron of 12 x 8 facets in a sphere
    assert 0.85 < cavity.volume(mesh.nodes) / (4 / 3 * np.pi * INNER**3) < 1
    direction = np.random.default_rng(0).standard_normal(mesh.nodes.shape)
    step = 1e-7
    ahead, behind = mesh.nodes + step * direction, mesh.nodes - step * direction
    slope = (cavity.volume(ahead) - cavity.volume(behind)) / (2 * step)
    assert slope == pytest.approx(cavity.gradient(mesh.nodes) @ direction.ravel(), rel=1e-8)
    numeric = (cavity.gradient(ahead) - cavity.gradient(behind)) / (2 * step)
    rows, columns, blocks = cavity.hessian(mesh.nodes)
    exact = np.zeros_like(mesh.nodes)
    np.add.at(exact, rows, np.einsum("kij,kj->ki", blocks, direction[columns]))
    exact = exact.ravel()
    np.testing.assert_allclose(numeric, exact, atol=1e-8 * np.abs(exact).max())


def test_fluid_keeps_its_volume_and_pushes_back(ball):
    mesh, faces = ball
    solid, cavity = FiniteStrainSolid(mesh, Material(1e6, 0.48)), FluidCavity(faces, len(mesh.nodes))
    indenter = Sphere(3e-3)
    pose = pose_on(indenter, np.array([0, -OUTER, 0]), np.array([0, -1.0, 0]))
    full, empty = (
        FiniteStrainContact(solid, mesh.surface, indenter, pose, cavity=fluid).press(0.4e-3, step=0.2e-3)
        for fluid in (cavity, None)
    )
    at_rest = cavity.volume(mesh.nodes)
    assert cavity.volume(mesh.nodes + full.state.displacement) == pytest.approx(at_rest, rel=1e-12)
    assert cavity.volume(mesh.nodes + empty.state.displacement) < at_rest * (1 - 1e-4)
    assert full.fluid > 0 and full.force[1] > 1.05 * empty.force[1]


def test_pre_inflation_raises_the_pressure(ball):
    mesh, faces = ball
    solid, cavity = FiniteStrainSolid(mesh, Material(1e6, 0.48)), FluidCavity(faces, len(mesh.nodes))
    indenter = Sphere(3e-3)
    pose = pose_on(indenter, np.array([0, -OUTER - 1e-3, 0]), np.array([0, -1.0, 0]))
    more = 0.01 * cavity.volume(mesh.nodes)
    touch = FiniteStrainContact(solid, mesh.surface, indenter, pose, cavity=cavity, pre_inflation=more).press(0.1e-3)
    assert touch.fluid > 0 and len(touch.outer.nodes) == 0
    grown = cavity.volume(mesh.nodes + touch.state.displacement)
    assert grown == pytest.approx(cavity.volume(mesh.nodes) + more, rel=1e-12)
