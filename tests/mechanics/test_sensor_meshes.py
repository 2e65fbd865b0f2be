"""Sensors for other tools: the touchable side of a volume, and what a solved contact's file holds."""

from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from tactile_core import sensors
from tactile_core.errors import TactileError
from tactile_core.mechanics import sensor_meshes
from tactile_core.mechanics.sensor_meshes import outer_surface, write_rest, write_solution, write_surface
from tactile_core.mechanics.solids import stress
from tactile_core.mechanics.solids.finite_strain import FiniteStrainSolid
from tactile_core.mechanics.solids.hex_mesh import gel_mesh, skin_mesh


@pytest.mark.parametrize(("make", "surface"), [(gel_mesh, sensors.digit_surface), (skin_mesh, sensors.biotac_surface)])
def test_the_touchable_side_is_the_sensors_surface(make, surface):
    mesh, lattice = make(), surface()
    nodes, faces = outer_surface(mesh)
    np.testing.assert_array_equal(nodes, np.sort(mesh.surface))
    ours, theirs = (
        trimesh.Trimesh(mesh.nodes[nodes], faces, process=False),
        trimesh.Trimesh(lattice.rest, lattice.faces),
    )
    assert len(ours.faces) == len(theirs.faces)
    assert ours.area == pytest.approx(theirs.area, rel=1e-3)  # the other diagonal of bent quadrilaterals
    lowest = np.argmin(ours.vertices[:, 1])
    assert ours.vertex_normals[lowest, 1] < -0.99  # outward
    assert ours.is_winding_consistent


@pytest.fixture(scope="module")
def solution():
    """A pressed gel in disguise: a smooth dent under the surface, with the pressure of its volumes."""
    solid = FiniteStrainSolid(gel_mesh(), sensors.DIGIT_GEL)
    state = solid.rest()
    x, y, z = (solid.mesh.nodes * 1e3).T
    height = np.clip((-4.236 - y) / 4, 0, 1)
    state.displacement[:, 1] = 1e-4 * height * np.exp(-((x + 8) ** 2 + z**2) / 8)
    state.pressure += solid.linearise(state).pressure_step(np.zeros_like(state.displacement))
    patch = np.zeros(len(solid.mesh.surface), bool)
    return SimpleNamespace(
        converged=True, volume=(solid, state), displacement=state.displacement[solid.mesh.surface], contact_patch=patch
    )


def test_a_surface_of_a_solved_volume_holds_force_and_stress(solution, tmp_path):
    write_solution(tmp_path / "a.ply", "digit", solution)
    read = trimesh.load(tmp_path / "a.ply", process=False)
    solid, state = solution.volume
    nodes, _ = outer_surface(solid.mesh)
    np.testing.assert_allclose(read.vertices, (solid.mesh.nodes + state.displacement)[nodes], atol=2e-9)  # float32
    columns = read.metadata["_ply_raw"]["vertex"]["data"]
    np.testing.assert_allclose(
        columns["force_y"].ravel(), stress.nodal_force(solid, state)[nodes, 1], rtol=1e-5, atol=1e-9
    )
    at_nodes = stress.von_mises(stress.at_nodes(solid, stress.cauchy(solid, state)))
    np.testing.assert_allclose(columns["von_mises"].ravel(), at_nodes[nodes], rtol=1e-4, atol=1e-3)


def test_each_ending_writes_its_kind(solution, tmp_path):
    surface_only = SimpleNamespace(**vars(solution) | {"volume": None})
    for name, given in (("volume", solution), ("surface", surface_only)):
        for ending in (".ply", ".stl", ".vtu", ".VTU"):
            write_solution(tmp_path / (name + ending), "digit", given)
    counts = {"volume": len(solution.volume[0].mesh.cells), "surface": len(sensors.digit_surface().faces)}
    for name, count in counts.items():
        assert f'NumberOfCells="{count}"'.encode() in (tmp_path / f"{name}.vtu").read_bytes()[:400]
    write_rest(tmp_path / "rest.vtu", "biotac")
    write_surface(tmp_path / "rest.stl", "biotac", np.zeros_like(sensors.biotac_surface().rest), {})
    assert trimesh.load(tmp_path / "rest.stl").is_watertight


def test_another_ending_is_refused(tmp_path, solution):
    for write in (lambda path: write_rest(path, "digit"), lambda path: write_solution(path, "digit", solution)):
        with pytest.raises(TactileError, match=r"'\.obj'; expected \.ply or \.stl or \.vtu"):
            write(tmp_path / "a.obj")
    with pytest.raises(TactileError, match="''"):
        sensor_meshes.check_suffix("contact")
