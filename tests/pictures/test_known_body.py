"""Gel under a known body: between nodes its heights are the body's own."""

import numpy as np
import pytest
import trimesh

from tactile_core.errors import TactileError
from tactile_core.files.threads import in_one_thread
from tactile_core.geometry.indenters import Box, Cylinder, Sphere
from tactile_core.jobs.gel import Gel
from tactile_core.mechanics.fast.active_set import UnsolvedError
from tactile_core.pictures.calibrate.ball_print import print_on
from tactile_core.pictures.height_map import gel_mapper
from tactile_core.pictures.renderer import Renderer


def pressed(indenter, depth, friction=0.5):
    """A gel under a body in the middle, pressed in two steps to a depth m."""
    gel = Gel("digit", indenter, friction=friction)
    for share in (0.5, 1.0):
        gel.press(gel.touching(-0.1e-3, 0.05e-3, depth * share))
    assert not gel.contact.flags
    return gel


def between_nodes(gel):
    """Heights (H, W) m, by the nodes alone and as they are, and the rest's."""
    mapper = gel_mapper()
    with in_one_thread:  # several threads round sums otherwise
        return mapper(gel.contact.displacement), gel.height_map(), mapper.rest


def gaps(gel, heights):
    """Distance (H, W) m of the surface from the body."""
    camera = gel_mapper().camera
    x, z = np.meshgrid(camera.gel_x, camera.gel_z, indexing="ij")
    points = np.stack([x, heights + camera.height_zero_y, z], -1).reshape(-1, 3)
    pose = gel.contact.pose
    return gel.indenter.distance((points - pose[:3, 3]) @ pose[:3, :3])[0].reshape(heights.shape)


@pytest.mark.parametrize("depth", [0.3e-3, 1.2e-3])
def test_a_ball_s_print_comes_nearer_to_the_converged_one(depth):
    """Truth: the axisymmetric solver's print, of nodes .05 mm apart (``make_ball_print.py``)."""
    gel = pressed(Sphere(3e-3), depth)
    by_nodes, heights, rest = between_nodes(gel)
    camera = gel_mapper().camera
    down, right = np.meshgrid(camera.gel_x, camera.gel_z, indexing="ij")
    true = print_on(rest, right, down, (0.05e-3, -0.1e-3, depth, 3e-3))
    near = true - rest > 0.1 * depth

    def errors(found):
        """Height, m, and slope, rms."""
        step = camera.pixel_size[1], camera.pixel_size[0]
        slope = np.hypot(*np.gradient(found - true, *step))
        return np.array([np.sqrt((part[near] ** 2).mean()) for part in (found - true, slope)])

    assert (errors(heights) < errors(by_nodes)).all()
    if depth > 1e-3:  # where nodes slide apart: measured .53 and .47
        assert (errors(heights) < 0.65 * errors(by_nodes)).all()


@pytest.mark.parametrize(
    ("indenter", "depth"),
    [(Sphere(3e-3), 0.3e-3), (Sphere(150e-3), 1e-3), (Box((6e-3,) * 3, 0.1e-3), 0.3e-3),
     (Cylinder(3e-3, 0.1e-3), 1e-3)], ids=repr,
)  # fmt: skip
def test_no_gel_is_inside_the_body_and_what_was_outside_stays(indenter, depth):
    gel = pressed(indenter, depth)
    by_nodes, heights, _ = between_nodes(gel)
    assert gaps(gel, by_nodes).min() < -10e-6  # the check can fail
    assert gaps(gel, heights).min() > -5e-6  # by 5 um at upright walls, which 20 rounds leave
    assert gaps(gel, heights)[heights > by_nodes].max() < 5e-6  # none is raised past the body
    outside = gaps(gel, by_nodes) >= 0
    assert (heights[outside] == by_nodes[outside]).all()
    assert (heights >= by_nodes).all()


def test_grooves_finer_than_nodes_are_seen():
    """Turning marks .25 mm apart on a face: nodes are .35 mm apart, pixels .05."""
    pitch, depth = 0.25e-3, 40e-6
    across = np.linspace(-3e-3, 3e-3, 1 + 8 * 24)
    low, high = np.c_[across, depth * np.sin(np.pi * across / pitch) ** 2], np.c_[across, np.full(len(across), 3e-3)]
    k, n = np.arange(len(across) - 1), len(across)
    triangles = np.r_[np.c_[k, k + 1, n + k], np.c_[k + 1, n + k + 1, n + k]]
    mesh = trimesh.creation.extrude_triangulation(np.r_[low, high], triangles, 6e-3)  # marks along its z
    turn = np.eye(4)
    turn[:3, :3], turn[:3, 3] = [[1, 0, 0], [0, 0, -1], [0, 1, 0]], [0, 3e-3, 0]
    mesh.apply_transform(turn)
    gel = pressed(mesh, 0.3e-3)
    by_nodes, heights, rest = between_nodes(gel)
    camera = gel_mapper().camera
    row = np.abs(camera.gel_x) < 1.5e-3, np.abs(camera.gel_z) < 1.5e-3
    wave = np.exp(2j * np.pi * camera.gel_x[row[0]] / pitch) * np.hanning(row[0].sum())  # without the dome's share

    def marks(found):
        part = (found - rest)[np.ix_(*row)]
        return np.abs(wave @ (part - part.mean(0))).mean()

    assert marks(heights) > 3 * marks(by_nodes)


@pytest.mark.parametrize(("depth", "force"), [(0.1e-3, 1.0), (3e-3, None)], ids=["force", "too deep"])
def test_heights_are_those_where_the_contact_was_solved(depth, force):
    """Not where the pose was asked for: with a force the indenter moves on, and too deep it stays behind."""
    gel = Gel("digit", Sphere(3e-3))
    contact = gel.press(gel.touching(-7e-3, 0.0, depth), force=force)
    assert abs(contact.depth - depth) > 0.2e-3
    inside = gaps(gel, gel.height_map())
    assert inside.min() > -5e-6
    assert (np.abs(inside) < 5e-6).sum() > 500


def test_an_unsolved_step_keeps_its_picture(monkeypatch):
    gel = pressed(Sphere(3e-3), 0.3e-3)
    before = gel.height_map()
    monkeypatch.setattr(Gel, "_solved_at", lambda *_, **__: (_ for _ in ()).throw(UnsolvedError("no")))
    assert "unsolved" in gel.press(gel.touching(1e-3, 0.0, 0.4e-3)).flags
    assert (gel.height_map() == before).all()


def test_a_contact_beside_the_picture_changes_nothing_in_it():
    gel = Gel("digit", Sphere(1e-3))
    gel.press(gel.touching(3e-3, 0.0, 0.2e-3))
    assert gel.contact.patch.any()
    by_nodes, heights, _ = between_nodes(gel)
    assert (heights == by_nodes).all()


def test_a_texture_shows_through_where_the_body_touches_and_turns_with_it():
    """One dark quarter, at own +x and +y: darker in the picture there; the body's reflectance is the calibration's."""
    texture = np.full((60, 60), 255, np.uint8)
    texture[:30, 30:] = 0  # rows from the greatest own y down
    white, marked = (Gel("digit", Box((6e-3,) * 3, 0.1e-3), texture=each) for each in (np.ones((2, 2)), texture))
    camera = gel_mapper().camera
    x, z = np.meshgrid(camera.gel_x + 7e-3, camera.gel_z, indexing="ij")
    for turned in (1, -1):
        pose = white.touching(-7e-3, 0.0, 0.3e-3)
        pose[:3, :2] *= turned  # half a turn about own z
        for gel in (white, marked):
            gel.reset()
            gel.press(pose)
        apart = white.picture().astype(int) - marked.picture()
        own_x, own_y = turned * x, turned * z  # of ``touching``: own y along z
        dark = (own_x > 0.3e-3) & (own_y > 0.3e-3) & (own_x < 2.5e-3) & (own_y < 2.5e-3)
        light = ((own_x < -0.3e-3) | (own_y < -0.3e-3)) & (np.abs(x) < 5e-3)
        assert apart[dark].mean() > 5
        assert (apart[light] == 0).all()
    untouched = Gel("digit", Box((6e-3,) * 3, 0.1e-3), texture=texture)
    assert (untouched.picture() == Gel("digit", Sphere(1e-3)).picture()).all()


@pytest.mark.parametrize(
    ("texture", "words"),
    [(np.ones((4, 4, 3)), "Average"), (np.full((4, 4), 7.0), "Divide"), (np.full((4, 4), np.nan), "nan"),
     (np.full((4, 4), 40000, np.uint16), "white"), (np.ones((1, 4)), "2 x 2"), ([["a"]], "real numbers"),
     ([[1, 0], [1]], "real numbers")],
)  # fmt: skip
def test_what_is_no_texture_is_refused(texture, words):
    with pytest.raises(TactileError, match=words):
        Gel("digit", Sphere(3e-3), texture=texture)


def test_what_is_no_reflectance_is_refused():
    renderer = Renderer(preset="fast")
    for reflectance, words in ((np.ones((2, 2)), "shape"), (np.full(renderer.camera.shape, 2.0), "Divide")):
        with pytest.raises(TactileError, match=words):
            renderer(gel_mapper().rest, reflectance=reflectance)
