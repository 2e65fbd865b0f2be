"""Mesh indenters: the smooth grid against the mesh and the analytic shape, placing, cache."""

import numpy as np
import pytest
import trimesh

from tactile_core.files.array_cache import cache_folder
from tactile_core.geometry.indenters import Box, MeshIndenter, Sphere, mesh_grid, mesh_indenter, pose_on

BALL = Sphere(2.5e-3)
SPACING = 0.2e-3


def near_ball(count=2000):
    """Places within 0.5 mm of the ball's surface."""
    random = np.random.default_rng(0)
    along = random.standard_normal((count, 3))
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    return [0, 0, 2.5e-3] + along * (2.5e-3 + random.uniform(-0.5e-3, 0.5e-3, (count, 1)))


def test_ball_agrees_with_the_sphere(ball):
    points = near_ball()
    (distance, normal), (exact, exact_normal) = ball.distance(points), BALL.distance(points)
    # um: facets of 0.17 mm lie up to 0.17^2 / (6 x 2.5) = 2 um under the sphere, corners on it; the spline adds 2.
    assert np.abs(distance - exact).max() < 5e-6
    assert np.sqrt(np.mean((distance - exact) ** 2)) < 2.5e-6
    # Facets lean by up to 0.17 / 2 / 2.5 rad = 2 degrees, which the spline smooths.
    angle = np.degrees(np.arccos(np.clip((normal * exact_normal).sum(axis=1), -1, 1)))
    assert angle.mean() < 0.5 and angle.max() < 2


def test_error_is_measured(ball):
    rms, largest = ball.error
    assert 0 < rms < 1e-6 and rms < largest < 4e-6  # against the mesh itself, so without the facets


def test_error_is_measured_at_edges_too():
    """Of a box, whose distance is known: also at the places that another face is nearer to."""
    box, asked = trimesh.creation.box((3, 3, 3)), []
    half = box.extents / 2

    def exact(points):
        asked.append(points)
        beyond = np.abs(points * 1e3) - half
        outside = np.linalg.norm(np.maximum(beyond, 0), axis=1)
        return (outside + np.minimum(beyond.max(axis=1), 0)) * 1e-3, points

    near = mesh_grid.NearTriangles(box.triangles, 0.3)
    assert mesh_grid.error_of(box, near, exact).max() < 1e-12  # m: rounding
    inner = np.sort(half - np.abs(asked[0] * 1e3), axis=1)
    assert len(inner) == 500 and (np.ptp(inner[:, :2], axis=1) < 0.1).sum() > 10  # some are as near to another face


def test_normal_and_curvature_belong_to_the_level_surface(ball):
    points = near_ball(300)
    value, slope = ball.grid.value_and_gradient(points)
    distance, normal = ball.distance(points)
    curvature = ball.curvature(points)
    step = 1e-7
    turn = np.empty((300, 3, 3))
    for k, axis in enumerate(np.eye(3) * step):
        ahead, behind = (ball.grid.value_and_gradient(points + s * axis)[0] for s in (1, -1))
        np.testing.assert_allclose((ahead - behind) / (2 * step), slope[:, k], atol=1e-6)
        turn[:, :, k] = (ball.distance(points + axis)[1] - ball.distance(points - axis)[1]) / (2 * step)
    np.testing.assert_array_equal(distance, value)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1, rtol=1e-12)
    np.testing.assert_allclose(normal * np.linalg.norm(slope, axis=1)[:, None], slope, atol=1e-12)
    along = np.eye(3) - normal[:, :, None] * normal[:, None, :]
    # 1/m; the spline's third derivative, some 1e7 / m2, times the step, which may cross a cell's border.
    np.testing.assert_allclose(curvature, along @ turn @ along, atol=2)
    np.testing.assert_allclose(curvature, curvature.swapaxes(1, 2), atol=1e-9)


def test_beyond_the_grid_the_distance_goes_on(ball):
    far = np.array([[9e-3, 0, 2.5e-3], [0, 0, -6e-3], [7e-3, 7e-3, 12e-3], [0.1, 0, 0]])
    distance, normal = ball.distance(far)
    exact, exact_normal = BALL.distance(far)
    assert (distance >= exact - 5e-6).all()  # the way round by the grid's box is no shorter
    assert (distance < 1.5 * exact).all()
    assert ((normal * exact_normal).sum(axis=1) > 0.8).all()
    assert np.isfinite(ball.curvature(far)).all()
    edge = ball.grid.origin[0] + ball.grid.spacing * (ball.grid.coefficients.shape[0] - 2)
    sides = np.array([[edge - 1e-9, 0, 2.5e-3], [edge + 1e-9, 0, 2.5e-3]])
    assert np.ptp(ball.distance(sides)[0]) < 1e-8


def test_pose_just_touches(ball):
    pose = pose_on(ball, np.array([1e-3, 2e-3, 3e-3]), np.array([0.0, -0.6, 0.8]), 0.3, 1.0)
    distance, normal = pose.distance(ball, np.array([[1e-3, 2e-3, 3e-3]]))
    assert abs(distance[0]) < 5e-6  # a vertex of the mesh, against its smooth surface
    assert normal[0] @ [0, 0.6, -0.8] > 0.998  # 3.6 degrees: facets lean by 2


@pytest.mark.parametrize(("up", "shift"), [("z", 0), ("x", 1), ("y", 2), ("-z", 0), ("-x", 1), ("-y", 2)])
def test_any_axis_may_point_up(tmp_path, up, shift):
    """A box whose size tells its axes, far from the file's origin, in metres."""
    solid = trimesh.creation.box(np.roll([1e-3, 2e-3, 3e-3], shift))
    solid.apply_translation([5e-3, -3e-3, 2e-3])
    solid.export(tmp_path / "box.ply")
    indenter = MeshIndenter.from_file(tmp_path / "box.ply", scale=1.0, up=up, spacing=0.25e-3)
    lower, upper = indenter.bounds()
    np.testing.assert_allclose(upper - lower, [1e-3, 2e-3, 3e-3], atol=1e-9)
    np.testing.assert_allclose((lower + upper) / 2, [0, 0, 1.5e-3], atol=1e-9)


def test_up_may_point_down():
    """A cone stands on its base, or, upside down, on its tip."""
    for up, sign in (("z", 1), ("-z", -1)):
        turn = mesh_indenter.mesh_file._turn(up)
        assert np.linalg.det(turn) == pytest.approx(1)
        np.testing.assert_array_equal(turn @ [0, 0, 1], [0, 0, sign])


@pytest.mark.parametrize("suffix", ["obj", "off", "ply", "stl"])
def test_every_format_gives_the_same_body(tmp_path, suffix):
    path = tmp_path / f"box.{suffix}"
    trimesh.creation.box((3, 3, 3)).export(path)
    indenter = MeshIndenter.from_file(path, spacing=0.25e-3)
    points = np.random.default_rng(1).uniform(-0.25e-3, 0.25e-3, (200, 3))
    exact, _ = Box((3e-3,) * 3, 2e-6).distance(points)
    # What edges do to a spline fades by 0.27 a node, and they and the creases inside are 4 nodes away.
    np.testing.assert_allclose(indenter.distance(points)[0], exact, atol=1e-6)


def test_hollow_and_separate_bodies_are_fine(tmp_path):
    shell = trimesh.creation.icosphere(2, 2.0)
    cavity = trimesh.creation.icosphere(2, 1.0)
    cavity.invert()
    other = trimesh.creation.icosphere(2, 1.0)
    other.apply_translation([3.5, 0, 0])
    trimesh.util.concatenate([shell, cavity, other]).export(tmp_path / "bodies.stl")
    indenter = MeshIndenter.from_file(tmp_path / "bodies.stl", spacing=0.25e-3)
    distance, _ = indenter.distance(np.array([[0, 0, 2.2e-3], [0, 0, 0.5e-3], [3.5e-3, 0, 2e-3], [0, 0, -0.5e-3]]))
    assert distance[0] > 0.5e-3 and distance[3] > 0.4e-3
    assert distance[1] < -0.3e-3 and distance[2] < -0.3e-3


def test_the_cache_gives_the_same_bytes(ball, ball_file):
    (kept,) = [path for path in cache_folder().glob("indenter-*/hull.npy") if len(np.load(path)) == len(ball.hull)]
    kept = kept.with_name("coefficients.npy")
    changed = kept.stat().st_mtime_ns
    mesh_indenter._load.cache_clear()
    again = MeshIndenter.from_file(ball_file, spacing=SPACING)
    assert kept.stat().st_mtime_ns == changed  # read, not built
    np.testing.assert_array_equal(again.grid.coefficients, ball.grid.coefficients)
    assert again.error == ball.error


def test_settings_and_content_have_their_own_cache(ball, tmp_path):
    before = set(cache_folder().glob("indenter-*"))
    path = tmp_path / "ball.stl"
    for radius, spacing in ((1.0, 0.25e-3), (1.0, 0.3e-3), (1.1, 0.25e-3)):
        trimesh.creation.icosphere(1, radius).export(path)
        MeshIndenter.from_file(path, spacing=spacing)
    assert len(set(cache_folder().glob("indenter-*")) - before) == 3


def test_public_meshes_build(outside_data):
    """A 7 mm ball on a shaft, in metres, its tip toward +y, made by others."""
    path = outside_data("biotac_mesh") / "indenters" / "sphere_7mm.obj"
    indenter = MeshIndenter.from_file(path, scale=1.0, up="-y", spacing=0.3e-3)
    points = np.random.default_rng(5).uniform(-1.5e-3, 1.5e-3, (200, 3)) * [1, 1, 0.3]
    exact, _ = Sphere(3.5e-3).distance(points)
    assert np.abs(indenter.distance(points)[0] - exact).max() < 40e-6  # its facets of 0.8 mm lie 24 um under the ball


def stem_file(folder, width=16.0, height=20.0, cells=40):
    """A square stem, mm, as of FOTS's set, whose lower face has waves of 0.5 mm."""
    x = np.linspace(-width / 2, width / 2, cells + 1)
    low = np.array([(a, b, 0.25 * np.sin(2 * a) * np.cos(2 * b)) for a in x for b in x])
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    right, up = cells + 1, 1
    faces = np.concatenate([
        np.stack([corner, corner + up, corner + right], axis=1),
        np.stack([corner + right, corner + up, corner + right + up], axis=1),
    ])  # fmt: skip
    rim = trimesh.Trimesh(low, faces, process=False)
    edges = rim.edges[trimesh.grouping.group_rows(rim.edges_sorted, require_count=1)]
    top = low * [1, 1, 0] + [0, 0, height]
    n = len(low)
    sides = [(np.c_[edges[:, 1], edges[:, 0], edges[:, 0] + n]), (np.c_[edges[:, 1], edges[:, 0] + n, edges[:, 1] + n])]
    body = trimesh.Trimesh(np.concatenate([low, top]), np.concatenate([faces, faces[:, ::-1] + n, *sides]))
    assert body.is_volume
    body.export(folder / "stem.stl")
    return folder / "stem.stl"


def test_a_large_stem_has_a_fine_tip_and_a_coarse_rest(tmp_path, monkeypatch):
    monkeypatch.setattr(mesh_grid, "MAX_NODES", 300_000)  # a stem of 16 x 16 x 20 mm exceeds the true one at 0.1 mm
    path = stem_file(tmp_path)
    made = MeshIndenter.from_file(path, spacing=0.3e-3)
    assert made.grid.fine.spacing == 0.3e-3 and made.grid.coarse.spacing >= 1.2e-3
    assert made.error[0] < 60e-6  # m: edges are rounded over a spacing of 0.3 mm, near the tip alone
    middle = np.array([*(made.hull.min(axis=0) + made.hull.max(axis=0))[:2] / 2, 0])  # the lowest flat is beside it
    points = middle + np.random.default_rng(0).uniform([-7e-3, -7e-3, 3e-3], [7e-3, 7e-3, 9e-3], (200, 3))
    value = made.distance(points)[0]
    to_side = np.abs(points - middle)[:, :2].max(axis=1) - 8e-3
    assert (value < 0).all()
    near = to_side > -1.5e-3  # deeper, grids four times coarser are interpolated
    np.testing.assert_allclose(value[near], to_side[near], atol=60e-6)
    step, axis = 1e-6, np.eye(3)
    ahead = [made.grid.value_and_gradient(points + step * each)[0] for each in axis]
    back = [made.grid.value_and_gradient(points - step * each)[0] for each in axis]
    slope = made.grid.value_and_gradient(points)[1]
    np.testing.assert_allclose((np.array(ahead) - back).T / (2 * step), slope, atol=1e-3)
    ahead = [made.grid.value_and_gradient(points + step * each)[1] for each in axis]
    back = [made.grid.value_and_gradient(points - step * each)[1] for each in axis]
    bend = made.grid.gradient_and_hessian(points)[1]
    np.testing.assert_allclose(np.moveaxis(np.array(ahead) - back, 0, 1) / (2 * step), bend, atol=1, rtol=1e-2)
    again = MeshIndenter.from_file(path, spacing=0.3e-3)  # from the cache
    np.testing.assert_array_equal(again.distance(points)[0], value)


@pytest.mark.parametrize("gap", [2e-6, 2e-5])
def test_gaps_of_rounding_are_welded(gap, tmp_path):
    """Each triangle has corners of its own, mm apart by what numbers of four bytes or six digits leave."""
    ball = trimesh.creation.icosphere(3, 2.5)
    corners = ball.triangles.reshape(-1, 3) + np.random.default_rng(0).uniform(
        -gap / 2, gap / 2, (3 * len(ball.faces), 3)
    )
    loose = trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=False)
    loose.export(tmp_path / "ball.off", digits=12)
    made = MeshIndenter.from_file(tmp_path / "ball.off", spacing=0.3e-3)
    value = made.distance(np.array([[0.0, 0, 0], [2e-3, 0, 2.5e-3]]))[0]
    np.testing.assert_allclose(value, [0, -0.5e-3], atol=60e-6)
