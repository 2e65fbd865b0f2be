"""Dense elimination against a sparse solve of the whole solid."""

import numpy as np
import pytest
import scipy.sparse.linalg
from slab import assemble, slab_mesh

from tactile_core.mechanics.fast.compliance import Compliance, Solid, assembled, condensed
from tactile_core.mechanics.fast.compliance_rows import ComplianceBlock, ComplianceRows, surface_motion
from tactile_core.mechanics.fast.condense import condense, mirror_nodes
from tactile_core.sensors import Material

MATERIAL = Material(1e6, 0.48)


@pytest.fixture(scope="module")
def block():
    x = np.linspace(-2e-3, 3e-3, 7)
    z = np.linspace(-2e-3, 2e-3, 7)  # three cells across: the middle ones are their own images
    mesh, lattice = slab_mesh(x, z, np.linspace(0, -1e-3, 5))
    free = np.repeat(~mesh.clamped, 3)
    solve = scipy.sparse.linalg.factorized(assemble(mesh, MATERIAL)[free][:, free].tocsc())

    def answer(load):
        full = np.zeros(len(free))
        full[free] = solve(load[free])
        return full

    return mesh, lattice, answer


def test_every_force_has_the_answer_of_the_solid(block):
    """Also where the matrix holds only the mirror image's answer."""
    mesh, lattice, answer = block
    touchable = np.flatnonzero(lattice.rest[:, 0] > -1.5e-3)
    solid = Solid("slab", lattice, touchable, mesh, MATERIAL)
    compliance = Compliance("slab", lattice, touchable, **dict(assembled(solid, *condensed(solid))))
    none, every = np.empty(0, int), np.arange(len(touchable))
    matrix = ComplianceBlock(compliance, every, none, ComplianceRows(compliance, every)).matrix
    surface = (3 * mesh.surface[:, None] + np.arange(3)).ravel()
    for node, at in enumerate(touchable):
        force = np.eye(3)[node % 3]
        load = np.zeros((len(mesh.nodes), 3))
        load[mesh.surface[at]] = force
        exact = answer(load.ravel())[surface]
        error = 2e-7 * np.abs(matrix).max()  # single precision
        moved = surface_motion(compliance, np.array([node]), force[None], none, np.empty(0))
        np.testing.assert_allclose(moved.ravel(), exact, atol=error)
        np.testing.assert_allclose(matrix[3 * node + node % 3], exact.reshape(-1, 3)[touchable].ravel(), atol=error)


def test_loads_inside_the_solid(block):
    mesh, lattice, answer = block
    loads = np.random.default_rng(0).normal(size=(3 * len(mesh.nodes), 3)) * np.repeat(~mesh.clamped, 3)[:, None]
    keep = mesh.surface[lattice.rest[:, 2] >= 0]
    held = keep, np.arange(len(keep)), scipy.sparse.csc_array(loads)
    halves = [condense(mesh, MATERIAL, *held, parity) for parity in (1, -1)]
    whole = np.column_stack([answer(load) for load in loads.T])
    dofs = (3 * keep[:, None] + np.arange(3)).ravel()
    scale = np.abs(whole).max()
    np.testing.assert_allclose(sum(half.under_loads for half in halves), whole[dofs], atol=1e-10 * scale)
    work = loads.T @ whole
    np.testing.assert_allclose(sum(half.among for half in halves), work, atol=1e-9 * np.abs(work).max())


def test_a_lopsided_solid_is_refused():
    with pytest.raises(ValueError, match="mirror"):
        mirror_nodes(np.array([[0, 0, 1e-3], [0, 0, -1.1e-3]]))
