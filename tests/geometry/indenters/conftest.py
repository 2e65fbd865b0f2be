"""Meshes to press with, each written and built once."""

import pytest
import trimesh

from tactile_core.geometry.indenters import MeshIndenter

SPACING = 0.2e-3  # m; twice the default, for speed


@pytest.fixture(autouse=True, scope="session")
def own_cache(tmp_path_factory):
    """Tests leave the user's cache alone."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TACTILE_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="session")
def ball_file(own_cache, tmp_path_factory):
    """A ball of 2.5 mm radius, in mm."""
    path = tmp_path_factory.mktemp("meshes") / "ball.stl"
    trimesh.creation.icosphere(4, 2.5).export(path)
    return path


@pytest.fixture(scope="session")
def ball(ball_file):
    return MeshIndenter.from_file(ball_file, spacing=SPACING)
