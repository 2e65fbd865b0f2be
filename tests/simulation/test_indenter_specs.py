"""Every kind of indenter that a scene can name, in metres; mesh files stay in the scene's folder."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from tactile_core.errors import TactileError
from tactile_core.geometry.indenters import (
    Box,
    BumpyCube,
    Cylinder,
    Edge,
    LyingCylinder,
    MeshIndenter,
    Ring,
    Several,
    Sphere,
)
from tactile_core.simulation.scene import load_scene

HEAD = 'format = "tactile-scene-1"\nname = "n"\ndescription = "d"\n'
TRAINING = Path(__file__).parents[2] / "scenes" / "training" / "scene.toml"


def write(folder, indenters):
    path = folder / "scene.toml"
    path.write_text(HEAD + indenters, encoding="utf-8")
    return path


def build(folder, indenters):
    return [spec.build() for spec in load_scene(write(folder, indenters))[0].indenters]


def test_the_nine_of_the_training_set():
    assert [spec.build() for spec in load_scene(TRAINING.parent)[0].indenters] == [
        Sphere(1.75e-3), Sphere(3.5e-3), Sphere(7e-3), Cylinder(1.75e-3, 0.4e-3), Cylinder(3.5e-3, 0.5e-3),
        LyingCylinder(3.5e-3, 0.5e-3, 20e-3), Box((14e-3, 14e-3, 14e-3), 0.5e-3), Ring(2.5e-3, 1e-3),
        BumpyCube(14e-3, 0.5e-3, 1.5e-3, 1e-3, 4e-3),
    ]  # fmt: skip


def test_edge_and_every_optional_size(tmp_path):
    text = """
[[indenters]]
kind = "edge"
name = "a"
angle_deg = 90
radius_mm = 0.4
length_mm = 12
height_mm = 6

[[indenters]]
kind = "cylinder"
name = "b"
radius_mm = 2
edge_mm = 0.25
length_mm = 4

[[indenters]]
kind = "lying_cylinder"
name = "c"
radius_mm = 2
edge_mm = 2
length_mm = 8
"""
    edge, upright, lying = build(tmp_path, text)
    assert isinstance(edge, Edge)
    np.testing.assert_allclose(
        [edge.angle, edge.radius, edge.length, edge.height], [np.pi / 2, 0.4e-3, 12e-3, 6e-3], rtol=1e-12
    )
    assert upright == Cylinder(2e-3, 0.25e-3, 4e-3)
    assert lying == LyingCylinder(2e-3, 2e-3, 8e-3)


SEVERAL = """
[[indenters]]
kind = "several"
name = "two"
parts = [
    { body = { kind = "sphere", name = "ball", radius_mm = 1 }, x_mm = -3 },
    { body = { kind = "box", name = "bar", sizes_mm = [1, 4, 1], edge_mm = 0.1 }, x_mm = 3, z_mm = 0.5, turn_deg = 90 },
]
"""


def test_several_bodies_stand_where_they_are_put(tmp_path):
    (group,) = build(tmp_path, SEVERAL)
    assert isinstance(group, Several)
    # mm: below the ball, below the bar, and beyond the bar's end, which has turned from y to x.
    places = np.array([[-3, 0, -1], [3, 0, -1], [5.5, 0, 1], [3, 1.0, 1]]) * 1e-3
    np.testing.assert_allclose(group.distance(places)[0], [1e-3, 1.5e-3, 0.5e-3, 0.5e-3], atol=1e-12)


def mesh_scene(folder, name, kind="mesh", more=""):
    return write(folder, f'[[indenters]]\nkind = "{kind}"\nname = "m"\nfile = "{name}"\nspacing_mm = 0.4\n{more}')


@pytest.fixture
def ball(tmp_path, monkeypatch):
    """A scene's folder with parts/ball.stl, and the same file outside of it."""
    monkeypatch.setenv("TACTILE_CACHE", str(tmp_path / "cache"))
    (tmp_path / "scene" / "parts").mkdir(parents=True)
    for place in (tmp_path, tmp_path / "scene" / "parts"):
        trimesh.creation.icosphere(2, 0.1).export(place / "ball.stl")
    return tmp_path / "scene"


@pytest.mark.parametrize("name", ["parts/ball.stl", "./parts/ball.stl", r"parts\\ball.stl"])
def test_mesh_of_the_scene(ball, name):
    scene, _ = load_scene(mesh_scene(ball, name, more='unit_mm = 10\nup = "-y"\n'))
    indenter = scene.indenters[0].build()
    assert isinstance(indenter, MeshIndenter)
    assert indenter.bounds()[1][2] == pytest.approx(2e-3, rel=0.01)


def test_mesh_in_a_group(ball):
    body = '{ kind = "mesh", name = "m", file = "parts/ball.stl", unit_mm = 10, spacing_mm = 0.4 }'
    text = f'[[indenters]]\nkind = "several"\nname = "two"\nparts = [ {{ body = {body}, x_mm = 2 }} ]\n'
    (group,) = build(ball, text)
    assert group.bounds()[1][0] == pytest.approx(3e-3, rel=0.01)


@pytest.mark.parametrize(
    "name",
    [
        "../ball.stl",
        "parts/../../ball.stl",
        "/etc/hostname",
        "C:ball.stl",
        r"C:\\ball.stl",
        r"..\\ball.stl",
        "a\\u0000b",
    ],
)
def test_mesh_outside_of_the_scene_is_refused(ball, name):
    with pytest.raises(TactileError, match="a name without"):
        load_scene(mesh_scene(ball, name))


def test_links_lead_nowhere_else_and_a_missing_file_is_named(ball):
    (ball / "link.stl").symlink_to(ball.parent / "ball.stl")
    (ball / "folder").symlink_to(ball.parent)
    (ball / "circle.stl").symlink_to("circle.stl")
    out, none = "a link out", "indenter 'm', file: 'none.stl' is not there"
    for name, said in (("link.stl", out), ("folder/ball.stl", out), ("circle.stl", "circle.stl"), ("none.stl", none)):
        with pytest.raises(TactileError, match=said):
            load_scene(mesh_scene(ball, name))
    (ball / "within.stl").symlink_to("parts/ball.stl")
    load_scene(mesh_scene(ball, "within.stl"))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("sizes_mm = [14.0, 14.0, 14.0]", "sizes_mm = [14.0, 14.0]", "sizes_mm"),
        ("sizes_mm = [14.0, 14.0, 14.0]", "sizes_mm = [14.0, 14.0, -14.0]", "sizes_mm"),
        ("tube_mm = 1.0", "", "tube_mm"),
        ("spacing_mm = 4.0", "spacing = 4.0", "spacing"),
        ("radius_mm = 7.0\n", "radius_mm = nan\n", "radius_mm|nan or infinite"),
        ("z_mm = 0.5", "z_mm = -0.5", "z_mm"),
        ("z_mm = 0.5", "z_mm = inf", "infinite"),
        ("turn_deg = 90", "tilt_deg = 90", "tilt_deg"),
        ("x_mm = -3", "x_mm = -3, z_mm = 0.7", r"lowest reaches z = 0\.5 mm"),
        ('kind = "sphere"', 'kind = "several"', "several"),
    ],
)
def test_bad_sizes_and_groups_are_refused(tmp_path, old, new, said):
    text = next(text for text in (HEAD + SEVERAL, TRAINING.read_text(encoding="utf-8")) if old in text)
    (tmp_path / "scene.toml").write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(TactileError, match=said):
        [spec.build() for spec in load_scene(tmp_path)[0].indenters]
