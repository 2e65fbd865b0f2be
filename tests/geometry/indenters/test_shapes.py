"""Every shape: exact distance, unit gradient, exact curvature, support, bounds, touching pose; and what is refused."""

import dataclasses

import numpy as np
import pytest

from tactile_core.errors import TactileError
from tactile_core.geometry.indenters import (
    Box,
    BumpyCube,
    Cylinder,
    Edge,
    LyingCylinder,
    Pose,
    Ring,
    Several,
    Sphere,
    pose_on,
)
from tactile_core.geometry.indenters.indenter import forms

LEANING = np.array([[np.cos(0.4), 0, np.sin(0.4)], [0, 1, 0], [-np.sin(0.4), 0, np.cos(0.4)]])
CONVEX = {
    "sphere": Sphere(3.5e-3),
    "flat cylinder": Cylinder(3e-3, 0.5e-3),
    "rounded cylinder": Cylinder(1e-3, 0.9e-3, 4e-3),
    "lying cylinder": LyingCylinder(2e-3, 0.5e-3, 8e-3),
    "capsule": LyingCylinder(3.5e-3, 3.5e-3, 12e-3),
    "box": Box((6e-3, 8e-3, 5e-3), 0.5e-3),
    "sharp edge": Edge(np.pi / 2, 0.5e-3, 10e-3, 5e-3),
    "blunt edge": Edge(2.5, 0.3e-3, 10e-3, 2e-3),
}
RING = Ring(2.75e-3, 0.75e-3)
PARTS = (
    (Sphere(1e-3), Pose(np.array([-3e-3, 0, 0]), np.eye(3))),
    (Box((2e-3, 3e-3, 1e-3), 0.2e-3), Pose(np.array([3e-3, 0, 2e-3]), LEANING)),
)
SHAPES = CONVEX | {"ring": RING, "bumpy cube": BumpyCube(14e-3, 1e-3, 1e-3, 0.5e-3, 3e-3), "several": Several(PARTS)}
every_shape = pytest.mark.parametrize("indenter", SHAPES.values(), ids=SHAPES)
every_convex = pytest.mark.parametrize("indenter", CONVEX.values(), ids=CONVEX)


def around(count=3000):
    return np.random.default_rng(0).uniform(-8e-3, 8e-3, (count, 3))


def directions(count=300):
    vectors = np.random.default_rng(1).standard_normal((count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def differences(function, points, step):
    return np.stack([(function(points + step * e) - function(points - step * e)) / (2 * step) for e in np.eye(3)], -1)


@every_shape
def test_gradient_is_that_of_the_distance(indenter):
    points = around()
    distance, gradient = indenter.distance(points)
    np.testing.assert_allclose(np.linalg.norm(gradient, axis=1), 1, rtol=1e-9)
    numeric = differences(lambda p: indenter.distance(p)[0], points, 1e-8)
    # 1e-4: rounding of 1e-18 m over the step, and the step times curvatures of some 1e3 / m.
    wrong = np.abs(numeric - gradient).max(axis=1) > 1e-4
    assert wrong.mean() < 0.002  # within a step of a crease, where the nearest face or part changes
    assert (distance > 0).any() and (distance < 0).any()


@every_shape
def test_distance_changes_no_faster_than_the_place(indenter):
    """So it never jumps, also inside and between parts."""
    points, moves = around(), 50e-6 * directions(3000)
    change = indenter.distance(points + moves)[0] - indenter.distance(points)[0]
    assert np.abs(change).max() <= 50e-6 * (1 + 1e-9)


@every_shape
def test_curvature_is_that_of_the_gradient(indenter):
    points = around()
    curvature = indenter.curvature(points)
    largest = np.abs(curvature).max(axis=(1, 2))
    np.testing.assert_allclose(curvature, curvature.swapaxes(1, 2), atol=1e-12 * largest.max())
    numeric = differences(lambda p: indenter.distance(p)[1], points, 1e-7)
    # Differences are good to (step x curvature)^2, 1e-6 at a radius of 0.1 mm.
    wrong = np.abs(numeric - curvature).max(axis=(1, 2)) > 1e-3 * np.maximum(largest, 1)
    assert wrong.mean() < 0.002
    assert largest.max() > 100  # something is curved


@every_shape
def test_pose_turns_distance_and_curvature_alike(indenter):
    pose = pose_on(indenter, np.array([1e-3, -2e-3, 0]), np.array([0.6, 0.0, 0.8]), 0.2, 1.0)
    points = pose.apex + around(200)
    numeric = differences(lambda p: pose.distance(indenter, p)[1], points, 1e-7)
    wrong = np.abs(numeric - pose.curvature(indenter, points)).max(axis=(1, 2)) > 1.0  # 1/m
    assert wrong.mean() < 0.02


@every_convex
def test_distance_is_exact_outside(indenter):
    """A point at distance d along the normal of a surface point has distance d."""
    along = directions()
    surface = np.array([indenter.support(d) for d in along])
    distance, gradient = indenter.distance(surface + 2e-3 * along)
    np.testing.assert_allclose(distance, 2e-3, atol=1e-12)
    np.testing.assert_allclose(gradient, along, atol=1e-9)
    np.testing.assert_allclose(indenter.distance(surface)[0], 0, atol=1e-12)


def hull(indenter):
    """A convex shape as a fine mesh, mm."""
    import trimesh

    return trimesh.convex.convex_hull(np.array([indenter.support(d) for d in directions(4000)]) * 1e3)


@pytest.mark.parametrize("name", ["lying cylinder", "box", "sharp edge", "ring"])
def test_distance_agrees_with_a_fine_mesh(name):
    import trimesh

    indenter = SHAPES[name]
    mesh = hull(indenter) if name != "ring" else trimesh.creation.torus(2.75, 0.75, 128, 64)
    if name == "ring":
        mesh.apply_translation([0, 0, 0.75])
    low, high = mesh.bounds
    points = np.random.default_rng(2).uniform(low - 1, high + 1, (400, 3))
    exact = -trimesh.proximity.signed_distance(mesh, points)  # positive inside, there
    error = indenter.distance(points * 1e-3)[0] * 1e3 - exact
    # um: chords of the meshes lie inside of a round shape by up to radius x angle^2 / 8, and outside round the hole.
    assert np.abs(error * 1e3).max() < 15


@every_shape
def test_nothing_reaches_beyond_the_support(indenter):
    points = around(20000)
    body = points[indenter.distance(points)[0] <= 0]
    assert len(body) > 30
    for direction in directions(40):
        reach = indenter.support(direction) @ direction
        assert (body @ direction).max() <= reach + 1e-12
    lower, upper = indenter.bounds()
    assert (body >= lower - 1e-12).all() and (body <= upper + 1e-12).all()
    assert lower[2] == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("name", ["ring", "bumpy cube", "several"])
def test_support_of_hollow_shapes_lies_on_them(name):
    surface = np.array([SHAPES[name].support(d) for d in directions()])
    np.testing.assert_allclose(SHAPES[name].distance(surface)[0], 0, atol=1e-12)


@pytest.mark.parametrize("name", sorted(SHAPES.keys() - {"several"}))
def test_flats_and_circles_are_met_in_their_middle(name):
    np.testing.assert_allclose(SHAPES[name].support(np.array([0.0, 0.0, -1.0])), 0, atol=1e-12)


@every_shape
@pytest.mark.parametrize("tilt", [0.0, 0.3])
def test_pose_just_touches(indenter, tilt):
    outward = np.array([0.2, -1.0, 0.3]) / np.linalg.norm([0.2, -1.0, 0.3])
    point = np.array([-5e-3, -7e-3, 1e-3])
    pose = pose_on(indenter, point, outward, tilt, 2.0)
    np.testing.assert_allclose(pose.axes.T @ pose.axes, np.eye(3), atol=1e-12)
    assert np.linalg.det(pose.axes) == pytest.approx(1)
    assert np.arccos(np.clip(-pose.direction @ outward, -1, 1)) == pytest.approx(tilt, abs=1e-7)
    plane = point + np.random.default_rng(2).uniform(-5e-3, 5e-3, (2000, 3)) @ (np.eye(3) - np.outer(outward, outward))
    assert pose.distance(indenter, plane)[0].min() > -1e-9
    if tilt or indenter is not RING:  # a flat ring touches round the point
        assert pose.distance(indenter, point[None])[0][0] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("name", ["flat cylinder", "lying cylinder", "box", "bumpy cube"])
def test_below_a_face_the_nearest_face_is_the_touching_one(name):
    """Contact solvers begin with nodes up to 2 mm inside: near the middle they must be sent back down."""
    x, y = np.random.default_rng(3).uniform(-0.3e-3, 0.3e-3, (2, 200))
    points = np.column_stack([x, y, np.linspace(0.6e-3, 1.4e-3, 200)])
    distance, gradient = SHAPES[name].distance(points)
    assert (distance < 0).all()
    assert (gradient[:, 2] < -0.5).all()


def test_middles_of_bodies_have_finite_answers():
    centres = np.array([[0, 0, 3.5e-3], [0, 0, 5e-3], [0, 0, 2e-3], [0, 0, 2.5e-3], [2.75e-3, 0, 0.75e-3], [0, 0, 0]])
    for indenter in SHAPES.values():
        distance, gradient = indenter.distance(centres)
        assert np.isfinite(distance).all() and np.isfinite(indenter.curvature(centres)).all()
        np.testing.assert_allclose(np.linalg.norm(gradient, axis=1), 1, rtol=1e-9)


def test_no_points_are_no_trouble():
    for indenter in SHAPES.values():
        distance, gradient = indenter.distance(np.empty((0, 3)))
        assert distance.shape == (0,) and gradient.shape == (0, 3)
        assert indenter.curvature(np.empty((0, 3))).shape == (0, 3, 3)


def test_a_group_is_the_nearest_of_its_parts():
    points = around()
    each = np.array([pose.distance(part, points)[0] for part, pose in PARTS])
    np.testing.assert_array_equal(SHAPES["several"].distance(points)[0], each.min(axis=0))


def test_five_bumps_stand_out_of_the_cube():
    cube = SHAPES["bumpy cube"]
    tips = np.array([[0, 0], [3e-3, 3e-3], [3e-3, -3e-3], [-3e-3, 3e-3], [-3e-3, -3e-3]])
    np.testing.assert_allclose(cube.distance(np.column_stack([tips, np.zeros(5)]))[0], 0, atol=1e-12)
    between = np.array([[1.5e-3, 1.5e-3, 0.5e-3], [5e-3, 0, 0.5e-3]])
    np.testing.assert_allclose(cube.distance(between)[0], 0, atol=1e-12)
    np.testing.assert_allclose(cube.bounds()[1], [7e-3, 7e-3, 14.5e-3], atol=1e-12)


def test_distance_behind_a_bump_is_that_of_its_surface():
    """Against the nearest of many points on the cap and on the face around it."""
    import scipy.spatial

    cube = BumpyCube(14e-3, 1e-3, 1e-3, 0.5e-3, 3e-3)
    along = directions(60000)
    cap = along[along[:, 2] < -0.5] * 1e-3 + [0, 0, 1e-3]
    x, y = np.meshgrid(*[np.arange(-2e-3, 2e-3, 20e-6)] * 2)
    face = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 0.5e-3)])
    face = face[np.hypot(face[:, 0], face[:, 1]) > np.sqrt(0.75) * 1e-3]
    points = np.random.default_rng(4).uniform([-1e-3, -1e-3, 0.2e-3], [1e-3, 1e-3, 1.5e-3], (2000, 3))
    distance, _ = cube.distance(points)
    nearest, _ = scipy.spatial.cKDTree(np.concatenate([cap, face])).query(points)
    # Random samples leave holes of 45 um, so at 200 um the nearest one is too far by at most 45^2 / (2 x 200) = 5 um.
    deep = distance < -0.2e-3
    assert deep.sum() > 500
    np.testing.assert_allclose(nearest[deep], -distance[deep], atol=5e-6)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Sphere(0.0), "sphere, radius"),
        (lambda: Sphere(float("nan")), "sphere, radius"),
        (lambda: Sphere(3.5), "Check the unit"),
        (lambda: Cylinder(3e-3, 3e-3), "cylinder, edge"),
        (lambda: Cylinder(3e-3, -1e-3), "cylinder, edge"),
        (lambda: Cylinder(3e-3, 1e-3, 2e-3), "half the length"),
        (lambda: LyingCylinder(3e-3, 3.1e-3), "lying cylinder, edge"),
        (lambda: LyingCylinder(3e-3, 3e-3, 6e-3), "half the length"),
        (lambda: LyingCylinder(3e-3, 1e-3, float("inf")), "lying cylinder, length"),
        (lambda: Box((5e-3, 5e-3, 1e-3), 0.5e-3), "half of the smallest"),
        (lambda: Box((5e-3, 5e-3, -1e-3), 0.5e-3), "size z"),
        (lambda: Ring(1e-3, 1e-3), "ring, tube"),
        (lambda: Ring(1e-3, 0.0), "ring, tube"),
        (lambda: Edge(0.1, 0.5e-3), "10 to 170 degrees"),
        (lambda: Edge(float("nan"), 0.5e-3), "10 to 170 degrees"),
        (lambda: Edge(1.5, 0.5e-3, height=1e-3), "edge, radius"),
        (lambda: BumpyCube(14e-3, 1e-3, 1e-3, 1.1e-3, 3e-3), "parts of balls"),
        (lambda: BumpyCube(14e-3, 1e-3, 1e-3, 0.5e-3, 5.1e-3), "bumps reach"),
        (lambda: BumpyCube(14e-3, 7e-3, 1e-3, 0.5e-3, 3e-3), "bumpy cube"),
        (lambda: BumpyCube(14e-3, 1e-3, 1e-3, 1e-3, 1e-3), "overlap"),
        (lambda: Several(()), "one indenter or more"),
        (lambda: Several(((Sphere(1e-3), Pose(np.array([0, 0, 1e-3]), np.eye(3))),)), "z = 1 mm"),
        (lambda: Several(((Sphere(1e-3), Pose(np.zeros(3), 2 * np.eye(3))),)), "unit axes"),
        (lambda: Pose(np.array([0, np.nan, 0]), np.eye(3)), "pose.*finite"),
        (lambda: pose_on(RING, np.zeros(3), np.array([0.0, 0.0, 1.0]), np.nan), "pose.*finite"),
    ],
)
def test_impossible_indenters_are_refused(make, said):
    with pytest.raises(TactileError, match=said):
        make()


def points_of(support):
    """In place of a hull: the body's farthest points, and no triangles."""
    return np.array([support(direction) for direction in directions()]), np.empty((0, 3), int)


@every_shape
def test_a_preview_lies_on_the_body_and_touches_the_plane(indenter):
    nodes, faces = indenter.preview(points_of)
    assert indenter.distance(nodes)[0].max() < 1e-9
    assert nodes[:, 2].min() > -1e-12
    assert not len(faces) or (faces.min() == 0 and faces.max() == len(nodes) - 1)


def test_every_form_is_found_in_its_shapes_file_and_names_its_sizes():
    found = forms()
    assert set(found) == {"box", "bumpy_cube", "cylinder", "edge", "lying_cylinder", "ring", "sphere"}
    for form in found.values():
        arguments = {field.name for field in dataclasses.fields(form.shape)}
        assert set(form.sizes) == arguments, form.kind
        given = [size.default is None for size in form.sizes.values()]
        assert given == sorted(given, reverse=True), f"{form.kind}: those without a default come first"
