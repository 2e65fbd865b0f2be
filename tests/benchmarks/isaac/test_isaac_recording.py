"""A scene's motion on a user's mesh: what is in the file, and that a frame that fails spoils no other."""

import h5py
import numpy as np
import pytest
from ball_scene import ball_scene
from benchmarks.isaac import isaac_recording
from benchmarks.isaac.isaac_recording import simulate_isaac_like

from tactile_core import sensors
from tactile_core.errors import TactileError
from tactile_core.sensors import biotac


@pytest.fixture(scope="module")
def skin_text():
    """The pad's half of our own skin, coarse, cut into tetrahedra: its sides lie free, its rims are held."""
    outer, inner = (biotac.skin_grid(layer)[1:-1:3, 8:57:3] for layer in ("outer", "inner"))
    grid = np.stack([inner, outer], 2)
    ids = np.arange(grid[..., 0].size).reshape(grid.shape[:3])
    a, b = slice(None, -1), slice(1, None)
    path = [[(a, a), (b, a), (b, b)], [(a, a), (a, b), (b, b)]]
    cells = []
    for first, second, third in path:  # each prism in three tetrahedra
        low, high = ([ids[(*place, layer)].ravel() for place in (first, second, third)] for layer in (0, 1))
        cells += [np.stack(four, -1) for four in
                  ((*low, high[2]), (low[0], low[1], high[1], high[2]), (low[0], *high))]  # fmt: skip
    lines = [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in grid.reshape(-1, 3)]
    return "\n".join(lines + ["t " + " ".join(map(str, cell)) for cell in np.concatenate(cells)])


@pytest.fixture
def files(tmp_path, skin_text, monkeypatch):
    """Scene and mesh; the mesh is held at its rims, for half a skin hardly meets the core."""
    (tmp_path / "skin.tet").write_text(skin_text)

    def rims(sensor, mesh):
        angle = np.arctan2(mesh.nodes[:, 2], biotac.AXIS_Y - mesh.nodes[:, 1])
        return np.abs(angle) > 0.99 * np.abs(angle).max()

    monkeypatch.setattr(isaac_recording, "attached_to", rims)

    def write(force=0.2):
        rolls = (0.0, -8.0, 0.0, 0.0), (0.1, -8.0, 0.0, 0.2), (0.2, -8.0, 1.0, force), (0.3, -8.0, 1.0, 0.1)
        (tmp_path / "scene.toml").write_text(ball_scene(*rolls, radius_mm=7.0))
        return tmp_path / "scene.toml", tmp_path / "skin.tet", tmp_path / "out.h5"

    return write


def test_the_file_holds_the_motion(files):
    seen = []
    scene, tet, out = files()
    assert simulate_isaac_like(scene, tet, out, progress=lambda done, total: seen.append((done, total))) == 0
    assert seen == [(1, 4), (2, 4), (3, 4), (4, 4)]
    with h5py.File(out) as file:
        assert file.attrs["format"] == "tactile-isaac-like-1" and file.attrs["simulated"]
        assert (file.attrs["youngs"], file.attrs["poisson"]) == (1.552e6, 0.316)
        assert file["converged"][:].all()
        np.testing.assert_allclose(file["time"], [0, 0.1, 0.2, 0.3])
        pushed = np.linalg.norm(file["force"], axis=1)
        np.testing.assert_allclose(pushed, [0, 0.2, 0.2, 0.1], rtol=0.02)  # of which the axial part is asked for
        depth = file["depth"][:]
        assert depth[0] == 0 < depth[3] < depth[2]
        moved = np.linalg.norm(file["displacement"], axis=-1).max(1)
        assert moved[0] == 0 and (moved[1:] > 0.5 * depth[1:]).all()
        assert not file["contact"][0].any() and file["contact"][1:].any(1).all()
        assert not file["displacement"][:][:, file["attached"][:]].any()
        middle = [file["nodes"][:][patch].mean(0) for patch in file["contact"][1:3]]
        assert middle[1][2] > middle[0][2]  # it rolled toward +z


def test_a_frame_that_fails_is_marked_and_the_next_goes_on(files):
    scene, tet, out = files(force=500.0)
    assert simulate_isaac_like(scene, tet, out) == 1
    with h5py.File(out) as file:
        assert file["converged"][:].tolist() == [True, True, False, True]
        assert np.linalg.norm(file["force"][3]) == pytest.approx(0.1, rel=0.02)


def test_what_cannot_be_simulated_is_refused(files, tmp_path):
    scene, tet, out = files()
    with pytest.raises(TactileError, match="cannot be read"):
        simulate_isaac_like(scene, tmp_path / "absent.tet", out)
    text = scene.read_text()
    scene.write_text(text.replace("z_mm = 1.0", "z_mm = 10.0"))
    with pytest.raises(TactileError, match="places on the DIGIT's gel"):
        simulate_isaac_like(scene, tet, out)
    scene.write_text(text[: text.index("[recording]")])
    with pytest.raises(TactileError, match="missing"):
        simulate_isaac_like(scene, tet, out)
    assert not out.exists()
    out.write_text("mine")
    scene.write_text(text)
    with pytest.raises(TactileError, match="exists already"):
        simulate_isaac_like(scene, tet, out)


def test_the_skin_of_the_tests_is_our_own(skin_text):
    places = np.array([[float(v) for v in line.split()[1:]] for line in skin_text.split("\n") if line[0] == "v"])
    assert places[:, 1].min() == pytest.approx(sensors.biotac_surface().rest[:, 1].min(), abs=0.1e-3)
