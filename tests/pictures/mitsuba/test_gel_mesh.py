"""The mesh that Mitsuba gets: where its vertices are, and what is refused before it crashes."""

import numpy as np
import pytest

from tactile_core.errors import TactileError
from tactile_core.pictures.mitsuba.gel_mesh import MM, GelMesh, check_mesh
from tactile_core.sensors.calibration_file import load_calibration

CAMERA = load_calibration().camera


def test_vertices_stand_where_the_map_has_its_heights():
    mesh = GelMesh(CAMERA)
    assert 19_000 < mesh.count < 21_000
    height = np.random.default_rng(1).uniform(0, 1e-3, CAMERA.shape).astype(np.float32)
    vertices = mesh.vertices(height)
    right, up, above = vertices.T.astype(float) / MM
    column = np.clip(np.rint(right / CAMERA.pixel_size[0] + CAMERA.width / 2 - 0.5), 0, CAMERA.width - 1).astype(int)
    down = -up / mesh.up_scale
    row = np.clip(np.rint(down / CAMERA.pixel_size[1] + CAMERA.height / 2 - 0.5), 0, CAMERA.height - 1).astype(int)
    np.testing.assert_allclose(above, height[row, column], rtol=1e-6)  # float32


def test_faces_look_at_the_camera():
    mesh = GelMesh(CAMERA, spacing=1e-3)
    corners = mesh.vertices(np.zeros(CAMERA.shape))[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (normals[:, 2] > 0).all() and np.allclose(normals[:, :2], 0)


def test_a_finer_mesh_has_every_pixel():
    mesh = GelMesh(CAMERA, spacing=0.0)
    assert mesh.count == (CAMERA.width + 2) * (CAMERA.height + 2)


GOOD = np.zeros((4, 3)), np.array([[0, 1, 2], [0, 2, 3]])


@pytest.mark.parametrize(
    ("vertices", "faces", "words"),
    [
        (GOOD[0][:3], GOOD[1], "shape"),
        (np.where(np.eye(4, 3) > 0, np.nan, 0), GOOD[1], "not finite"),
        (np.where(np.eye(4, 3) > 0, np.inf, 0), GOOD[1], "not finite"),
        (GOOD[0], np.array([[0, 1, 4]]), "vertex 4"),
        (GOOD[0], np.array([[0, -1, 2]]), "vertex -1"),
        (GOOD[0], np.zeros((0, 3), int), "faces"),
        (GOOD[0], np.zeros((2, 4), int), "faces"),
    ],
)
def test_what_would_crash_mitsuba_is_refused(vertices, faces, words):
    check_mesh(*GOOD, 4)
    with pytest.raises(TactileError, match=words):
        check_mesh(vertices, faces, 4)
