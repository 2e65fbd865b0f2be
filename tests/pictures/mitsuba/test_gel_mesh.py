"""The mesh that Mitsuba gets: where its vertices are, and what is refused before it crashes."""

import numpy as np
import pytest

from tactile_core.errors import TactileError
from tactile_core.pictures.mitsuba.gel_mesh import MM, GelMesh
from tactile_core.sensors.calibration_file import load_calibration

CAMERA = load_calibration().camera


def test_vertices_stand_where_the_map_has_its_heights():
    mesh = GelMesh(CAMERA)
    height = np.random.default_rng(1).uniform(0, 1e-3, CAMERA.shape).astype(np.float32)
    vertices = mesh.vertices(height)
    assert 19_000 < len(vertices) < 21_000
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
    assert len(mesh.vertices(np.zeros(CAMERA.shape))) == (CAMERA.width + 2) * (CAMERA.height + 2)


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_heights_that_would_crash_mitsuba_are_refused(wrong):
    heights = np.zeros(CAMERA.shape)
    heights[5, 7] = wrong
    with pytest.raises(TactileError, match="not finite"):
        GelMesh(CAMERA).vertices(heights)
