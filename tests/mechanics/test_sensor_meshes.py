"""Sensors for other tools: the touchable side of a volume, and what a solved contact's file holds."""

import base64
import dataclasses
import struct
import xml.etree.ElementTree
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from slab import slab_mesh

from tactile_core import sensors
from tactile_core.errors import TactileError
from tactile_core.mechanics import sensor_meshes
from tactile_core.mechanics.sensor_meshes import (
    outer_surface,
    vtk_order,
    write_cells,
    write_ply,
    write_rest,
    write_solution,
    write_stl,
    write_surface,
    write_vtu,
)
from tactile_core.mechanics.solids import stress
from tactile_core.mechanics.solids.finite_strain import FiniteStrainSolid
from tactile_core.mechanics.solids.hex_mesh import gel_mesh, skin_mesh
from tactile_core.sensors import Material, unrolling


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
    solid = FiniteStrainSolid(gel_mesh(), sensors.describe("digit").material)
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


GEL = sensors.digit_surface()
NUMBERS = {"Float32": "<f4", "Float64": "<f8", "Int64": "<i8", "UInt8": "u1"}


@pytest.fixture(scope="module")
def sheared():
    """A block, and a state of it that is known everywhere: simple shear by 0.3, x moves with y."""
    x = np.linspace(-1, 1, 5) * 1e-3
    mesh, _ = slab_mesh(x, x, x[::-1].copy())
    solid = FiniteStrainSolid(mesh, Material(1e6, 0.45))
    state = solid.rest()
    state.displacement[:, 0] = 0.3 * mesh.nodes[:, 1]
    return solid, state


def arrays(path):
    """(parent tag, name) -> values of a VTU file, by the rules of VTK's XML format."""
    found = {}
    for parent in xml.etree.ElementTree.parse(path).iter():
        for child in parent.findall("DataArray"):
            content = base64.b64decode(child.text)
            assert struct.unpack("<Q", content[:8]) == (len(content) - 8,)
            values = np.frombuffer(content[8:], NUMBERS[child.get("type")])
            width = int(child.get("NumberOfComponents", 1))
            found[parent.tag, child.get("Name")] = values.reshape(-1, width) if width > 1 else values
    return found


def test_a_surface_reads_back_from_ply(tmp_path):
    force = np.random.default_rng(0).standard_normal(GEL.rest.shape)
    write_ply(tmp_path / "a.ply", GEL.rest, GEL.faces, {"force": force, "contact": force[:, 0] > 0})
    read = trimesh.load(tmp_path / "a.ply", process=False)
    np.testing.assert_array_equal(read.faces, GEL.faces)
    np.testing.assert_array_equal(read.vertices.astype(np.float32), GEL.rest.astype(np.float32))
    columns = read.metadata["_ply_raw"]["vertex"]["data"]
    normals = np.column_stack([columns[name].ravel() for name in ("nx", "ny", "nz")])
    np.testing.assert_allclose(normals, unrolling.node_normals(GEL.rest, GEL.faces), atol=1e-6)  # float32
    np.testing.assert_array_equal(columns["force_y"].ravel(), force[:, 1].astype(np.float32))
    np.testing.assert_array_equal(columns["contact"].ravel(), force[:, 0] > 0)


def test_a_surface_reads_back_from_stl(tmp_path):
    write_stl(tmp_path / "a.stl", GEL.rest, GEL.faces)
    read = trimesh.load(tmp_path / "a.stl", process=False)
    np.testing.assert_array_equal(read.triangles.astype(np.float32), GEL.rest[GEL.faces].astype(np.float32))
    np.testing.assert_allclose(read.face_normals[:, 1].mean(), -0.98, atol=0.05)  # the dome looks down


def test_the_order_of_nodes_is_that_of_vtk():
    """Edges lie between the corners, and faces and middle among those, that VTK's documentation names."""
    place = np.stack([vtk_order() % 3, vtk_order() // 3 % 3, vtk_order() // 9], -1) / 2
    cube = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    edges = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
    faces = [(0, 3, 7, 4), (1, 2, 6, 5), (0, 1, 5, 4), (3, 2, 6, 7), (0, 1, 2, 3), (4, 5, 6, 7)]
    np.testing.assert_array_equal(place[:8], cube)
    among = [place[list(corners)].mean(0) for corners in (*edges, *faces, range(8))]
    np.testing.assert_array_equal(place[8:], among)


@pytest.mark.parametrize("make", [gel_mesh, skin_mesh])
def test_a_volume_holds_each_cell_with_its_corners_first(make, tmp_path):
    mesh = make()
    write_vtu(tmp_path / "a.vtu", mesh)
    found = arrays(tmp_path / "a.vtu")
    np.testing.assert_array_equal(found["Points", "Points"], mesh.nodes)
    cells = found["Cells", "connectivity"].reshape(-1, 27)
    np.testing.assert_array_equal(np.sort(cells), np.sort(mesh.cells))
    np.testing.assert_array_equal(found["Cells", "offsets"], 27 * np.arange(1, len(cells) + 1))
    assert (found["Cells", "types"] == 29).all()
    np.testing.assert_array_equal(found["PointData", "clamped"], mesh.clamped)
    corners = mesh.nodes[cells[:, :8]]
    x, y, z = (corners[:, ahead].mean(1) - corners[:, behind].mean(1) for ahead, behind in
               (([1, 2, 5, 6], [0, 3, 4, 7]), ([2, 3, 6, 7], [0, 1, 4, 5]), ([4, 5, 6, 7], [0, 1, 2, 3])))  # fmt: skip
    assert (np.einsum("ek,ek->e", np.cross(x, y), z) > 0).all()


def test_a_solution_goes_along(sheared, tmp_path):
    solid, state = sheared
    write_vtu(tmp_path / "a.vtu", solid.mesh, solid, state)
    found = arrays(tmp_path / "a.vtu")
    shear = 1e6 / (2 * 1.45)
    # Cauchy stress of simple shear g: sigma_xy = mu g, sigma_xx - sigma_yy = mu g^2
    np.testing.assert_allclose(found["PointData", "stress"][:, 3], shear * 0.3, rtol=1e-5)
    normal = found["PointData", "stress"][:, 0] - found["PointData", "stress"][:, 1]
    np.testing.assert_allclose(normal, shear * 0.09, rtol=1e-4)
    for tag in ("PointData", "CellData"):
        expected = shear * 0.3 * np.sqrt(3 + 0.09)  # sqrt(3 sigma_xy^2 + (sigma_xx - sigma_yy)^2)
        np.testing.assert_allclose(found[tag, "von_mises"], expected, rtol=1e-5)
    np.testing.assert_array_equal(found["PointData", "displacement"], state.displacement.astype(np.float32))
    np.testing.assert_allclose(found["PointData", "force"], stress.nodal_force(solid, state), rtol=1e-5, atol=1e-9)
    assert found["CellData", "pressure"].max() == 0
    along_z = dataclasses.replace(state, displacement=state.displacement[:, ::-1])
    write_vtu(tmp_path / "z.vtu", solid.mesh, solid, along_z)
    shears = arrays(tmp_path / "z.vtu")["PointData", "stress"][:, 3:]
    np.testing.assert_allclose(shears, np.tile([0, shear * 0.3, 0], (len(shears), 1)), atol=1e-5 * shear)  # xy yz xz


def test_the_same_mesh_gives_the_same_bytes(sheared, tmp_path):
    for name in ("a", "b"):
        write_vtu(tmp_path / f"{name}.vtu", sheared[0].mesh, *sheared)
        write_ply(tmp_path / f"{name}.ply", GEL.rest, GEL.faces)
    for kind in ("vtu", "ply"):
        assert (tmp_path / f"a.{kind}").read_bytes() == (tmp_path / f"b.{kind}").read_bytes()


def test_bad_values_and_places_are_refused_and_nothing_is_left(tmp_path):
    nan = np.full(len(GEL.rest), np.nan)
    with pytest.raises(TactileError, match="temperature holds nan"):
        write_ply(tmp_path / "a.ply", GEL.rest, GEL.faces, {"temperature": nan})
    with pytest.raises(TactileError, match="2867 rows"):
        write_cells(tmp_path / "a.vtu", GEL.rest, GEL.faces, sensor_meshes.TRIANGLE, {"short": np.zeros(3)})
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "file").touch()
    with pytest.raises(TactileError, match="cannot be written"):
        write_stl(tmp_path / "file" / "a.stl", GEL.rest, GEL.faces)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
