"""Our surfaces against the public meshes, and what they promise about themselves."""

import numpy as np
import pytest

from tactile_core import sensors
from tactile_core.sensors import unrolling
from tactile_core.sensors.calibration_file import load_calibration

RMS_LIMIT = 0.05e-3  # m, a target


def read_tet(path):
    """Vertices (n, 3) m and tetrahedra (m, 4) of a .tet file."""
    words = [line.split() for line in path.read_text().splitlines()]
    vertices = [[float(v) for v in w[1:4]] for w in words if w and w[0] == "v"]
    cells = [[int(v) for v in w[1:5]] for w in words if w and w[0] == "t"]
    return np.array(vertices), np.array(cells)


def read_medit(path):
    """Vertices and tetrahedra of a .mesh file (indices from 1)."""
    lines = [line.strip() for line in path.read_text().splitlines()]

    def block(name, width):
        start = lines.index(name)
        rows = lines[start + 2 : start + 2 + int(lines[start + 1])]
        return np.array([[float(v) for v in row.split()[:width]] for row in rows])

    return block("Vertices", 3), block("Tetrahedra", 4).astype(int) - 1


def boundary_nodes(cells):
    faces = np.sort(
        np.concatenate([cells[:, [1, 2, 3]], cells[:, [0, 2, 3]], cells[:, [0, 1, 3]], cells[:, :3]]), axis=1
    )
    unique, count = np.unique(faces, axis=0, return_counts=True)
    return unique[count == 1]


def rms_distance(points, lattice):
    _, _, place = unrolling.closest_on_triangles(lattice, points)
    return np.sqrt(((place - points) ** 2).sum(axis=1).mean())


def test_skin_lies_on_the_public_mesh(outside_data):
    vertices, cells = read_tet(outside_data("biotac_mesh") / "skin.tet")
    nodes = np.unique(boundary_nodes(cells))[::12]  # 273 of 3,272 are enough for an rms
    outer, inner = map(sensors.skin_of("biotac").skin_surface, ("outer", "inner"))
    to_outer, to_inner = (
        np.linalg.norm(unrolling.closest_on_triangles(s, vertices[nodes])[2] - vertices[nodes], axis=1)
        for s in (outer, inner)
    )
    # a node of the public skin belongs to the nearer of its two sides, 1.58 mm apart
    assert np.sqrt((np.minimum(to_outer, to_inner) ** 2).mean()) < RMS_LIMIT
    for side in (to_outer < to_inner, to_outer >= to_inner):
        assert np.sqrt((np.minimum(to_outer, to_inner)[side] ** 2).mean()) < RMS_LIMIT
        assert side.sum() > 75


def test_gel_lies_on_the_public_mesh(outside_data):
    vertices, cells = read_medit(outside_data("digit_mesh") / "digit_gel.mesh")
    nodes = np.unique(boundary_nodes(cells))
    x, y, z = vertices[nodes].T
    inside = sensors.shape_of("digit").outline_distance(x, z)
    top = nodes[(inside > 0.3e-3) & (y < -4.3e-3)]  # the side wall and its rounded edge are no part of the surface
    assert len(top) > 200
    assert rms_distance(vertices[top], sensors.digit_surface()) < RMS_LIMIT


@pytest.mark.parametrize("make", [sensors.biotac_surface, sensors.digit_surface])
def test_surfaces_are_mirror_symmetric_and_face_outward(make):
    lattice = make()
    mirrored = np.round(lattice.rest * [1, 1, -1] * 1e8).astype(int)
    own = np.round(lattice.rest * 1e8).astype(int)
    assert {tuple(p) for p in mirrored.tolist()} == {tuple(p) for p in own.tolist()}
    normals = unrolling.node_normals(lattice.rest, lattice.faces)
    lowest = np.argmin(lattice.rest[:, 1])
    assert normals[lowest, 1] < -0.99
    assert lattice.faces.max() == len(lattice.rest) - 1 and lattice.faces.min() == 0


def test_skin_is_closed_and_as_thick_as_published():
    outer, inner = map(sensors.skin_of("biotac").skin_surface, ("outer", "inner"))
    for lattice in (outer, inner):
        edges = np.sort(
            np.concatenate([lattice.faces[:, [0, 1]], lattice.faces[:, [1, 2]], lattice.faces[:, [2, 0]]]), axis=1
        )
        _, count = np.unique(edges, axis=0, return_counts=True)
        assert (count == 2).all()
    pad = np.abs(unrolling.unrolled_nodes()[:, 1]) < 8e-3
    middle = pad & (np.abs(outer.rest[:, 0] + 8e-3) < 6e-3)
    some = outer.rest[middle][::3]
    thickness = np.linalg.norm(unrolling.closest_on_triangles(inner, some)[2] - some, axis=1)
    assert thickness.min() > 1.50e-3 and thickness.max() < 1.63e-3  # the published range (docs/sources.md, BioTac skin)


@pytest.mark.parametrize("name", ["digit", "gelsight_mini"])
def test_a_gel_s_window_is_an_even_grid_that_holds_the_picture(name):
    window, camera = sensors.sensor_surface(name).window_rest, load_calibration(None, name).camera
    x, z = window[..., 0], window[..., 2]
    assert max(np.ptp(x, axis=1).max(), np.ptp(z, axis=0).max()) < 1e-12
    for nodes, seen in ((x[:, 0], camera.gel_x), (z[0], camera.gel_z)):
        steps = np.diff(nodes)
        assert np.ptp(steps) < 1e-12 and 0 < steps[0] < 0.3501e-3
        assert nodes[0] <= seen.min() and seen.max() <= nodes[-1]


def test_lowest_points_of_both_sensors_coincide():
    lowest = [make().rest[:, 1].min() for make in (sensors.biotac_surface, sensors.digit_surface)]
    assert lowest == pytest.approx([-8.309e-3, -8.301e-3], abs=0.02e-3)  # docs/sources.md; table sampled every 0.6 mm
