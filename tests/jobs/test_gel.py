"""A fingertip in a simulator's loop: forces, tractions, pictures, memory, and what it makes of bad input."""

import copy
import threading

import numpy as np
import pytest
import trimesh

from tactile_core import sensors
from tactile_core.errors import TactileError
from tactile_core.geometry.indenters import Box, Sphere
from tactile_core.jobs import gel as gel_module
from tactile_core.jobs.gel import Gel
from tactile_core.jobs.gel_contact import FLAGS, GelContact
from tactile_core.mechanics.fast.active_set import UnsolvedError
from tactile_core.mechanics.fast.press import CorrectedPress
from tactile_core.mechanics.placement import Placement
from tactile_core.mechanics.solve import solve

BALL = Sphere(3e-3)
REST = sensors.digit_surface().rest
TOP = float(REST[np.argmin(REST[:, 1]), 0])  # m, where the dome is level


def shifted(pose: np.ndarray, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> np.ndarray:
    moved = pose.copy()
    moved[:3, 3] += [x, y, z]
    return moved


def turned(pose: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """The pose of a body whose own axes are turned, about its origin."""
    moved = pose.copy()
    moved[:3, :3] = pose[:3, :3] @ turn
    return moved


def path(gel: Gel) -> list[np.ndarray]:
    """Pressed 0.5 mm in, then slid 0.5 mm along the finger."""
    start = gel.touching(-8e-3, 0.0)
    return [shifted(start, y=0.1e-3 * k) for k in range(6)] + [
        shifted(start, x=0.1e-3 * k, y=0.5e-3) for k in range(1, 6)
    ]


def same(one: GelContact, other: GelContact) -> bool:
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in ("force", "displacement", "patch"))


def test_a_press_is_what_the_solver_finds():
    gel = Gel("digit", BALL)
    found = gel.press(gel.touching(TOP, 0.0, 0.4e-3))
    expected = solve("digit", BALL, Placement(TOP, 0.0), depth=0.4e-3)
    # The motion is along +y here and along the dome's normal there: the same to the lattice's slope at its top.
    np.testing.assert_allclose(found.force[1], expected.force[1], rtol=2e-3)
    assert np.abs(found.displacement - expected.displacement).max() < 1e-6
    assert found.depth == pytest.approx(0.4e-3, abs=1e-8)
    assert found.flags == ("began inside",)


@pytest.mark.parametrize("sensor", ["digit", "biotac", "coarse_mini"])
@pytest.mark.parametrize("indenter", [BALL, Box((5e-3, 4e-3, 3e-3), 0.5e-3)], ids=["ball", "box"])
def test_tractions_add_up_to_the_force(sensor, indenter, coarse_mini):
    gel = Gel(sensor, indenter)
    for contact in gel.follow(path(gel)[1:]):
        total = (contact.traction * gel.areas[:, None]).sum(axis=0)
        np.testing.assert_allclose(total, contact.force, atol=0.01 * np.linalg.norm(contact.force))
        assert contact.patch.any() and (np.abs(contact.traction[~contact.patch]) == 0).all()
        assert contact.flags == ()


def test_areas_are_those_of_the_surface():
    surface = sensors.digit_surface()
    flat = trimesh.Trimesh(surface.rest, surface.faces, process=False).area
    assert Gel("digit", BALL).areas.sum() == pytest.approx(flat, rel=3e-3)  # triangles cut off the rim


def test_traction_under_a_ball_is_hertz_pressure():
    """At less than a tenth of the thickness it is nearly Hertz's: p0 sqrt(1 - r^2 / a^2), F = 2/3 pi a^2 p0."""
    gel = Gel("digit", BALL, friction=0.0)
    contact = gel.press(gel.touching(TOP, 0.0, 0.3e-3))
    rest = gel.surface.rest
    share = contact.traction[:, 1] * gel.areas / contact.force[1]
    from_middle = np.hypot(rest[:, 0] - TOP, rest[:, 2])
    radius = np.sqrt(2.5 * share @ from_middle**2)
    peak = 1.5 * contact.force[1] / (np.pi * radius**2)
    inner = from_middle < 0.7 * radius
    expected = peak * np.sqrt(1 - (from_middle[inner] / radius) ** 2)
    assert inner.sum() > 6
    # A node's share of the force jumps where the patch's rim cuts through its face; divided by the areas of triangles
    # in place of the faces' it is 1.9 times off.
    assert np.abs(contact.traction[inner, 1] - expected).max() < 0.2 * peak


def test_a_force_is_reached_along_the_motion():
    gel = Gel("digit", BALL)
    pose = gel.touching(-8e-3, 1e-3)
    for force in (0.5, 1.5, 0.2):
        contact = gel.press(pose, force=force)
        assert contact.force[1] == pytest.approx(force, rel=2e-3)  # a fiftieth of the fast tier's error, twice
        assert contact.flags == ()
    assert contact.pose[1, 3] > pose[1, 3]
    assert not gel.press(pose, force=0).patch.any()


def test_poses_are_matrices_or_positions_with_quaternions():
    gel, other = Gel("digit", BALL), Gel("digit", BALL)
    pose = gel.touching(-8e-3, 0.0, 0.2e-3)
    quaternion = np.array([np.cos(np.pi / 4), np.sin(np.pi / 4), 0, 0])  # own z to -y
    assert same(gel.press(pose), other.press((pose[:3, 3], quaternion))) or np.allclose(
        gel.contact.displacement, other.contact.displacement, atol=1e-12
    )


def test_a_trimesh_of_any_attitude_presses_along_y():
    """A ball is a ball however it is turned; its grid's error is far below that of a node's spacing."""
    mesh = trimesh.creation.icosphere(4, 3e-3)  # m, its own origin in its middle
    gel, exact = Gel("digit", mesh), Gel("digit", BALL)
    middle = exact.touching(-8e-3, 0.0, 0.4e-3)
    expected = exact.press(middle)
    turn = trimesh.transformations.rotation_matrix(1.1, [1.0, 2.0, 3.0])[:3, :3]
    for attitude in (np.eye(3), turn):
        gel.reset()
        found = gel.press(turned(shifted(middle, y=-3e-3), attitude))
        np.testing.assert_allclose(found.force, expected.force, atol=0.02 * np.linalg.norm(expected.force))
        assert np.abs(found.displacement - expected.displacement).max() < 8e-6  # icosphere and grid: 5 um


def test_friction_remembers_the_path_and_reset_forgets_it():
    gel = Gel("digit", BALL)
    *_, slid = gel.follow(path(gel))
    assert slid.force[0] > 0.05
    gel.reset()
    straight = gel.press(path(gel)[-1])
    assert abs(straight.force[0]) < 0.2 * slid.force[0]
    smooth = Gel("digit", BALL, friction=0.0)
    *_, slid_without = smooth.follow(path(smooth))
    assert abs(slid_without.force[0]) < 0.2 * slid.force[0]


@pytest.mark.parametrize("sensor", ["digit", "biotac"])
def test_the_same_poses_give_the_same_bytes_also_in_threads(sensor):
    gel = Gel(sensor, BALL)
    poses = path(gel)
    first = list(gel.follow(poses))
    found = [[], []]

    def run(into):
        into += list(Gel(sensor, BALL).follow(poses))

    threads = [threading.Thread(target=run, args=(each,)) for each in found]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for run_ in found:
        assert all(same(one, other) for one, other in zip(first, run_, strict=True))


def test_a_picture_shows_the_contact():
    gel = Gel("digit", BALL)
    rest = gel.picture()
    gel.press(gel.touching(-8e-3, 0.0, 0.5e-3))
    pressed = gel.picture()
    assert pressed.shape == rest.shape == (320, 240, 3)
    assert np.abs(pressed.astype(int) - rest).max() > 40
    assert gel.height_map().max() > 0.2e-3
    with pytest.raises(TactileError, match="no picture can be drawn"):
        Gel("biotac", BALL).picture()


@pytest.mark.parametrize(
    ("pose", "words"),
    [
        (np.full((4, 4), np.nan), "finite"),
        (np.diag([2.0, 2, 2, 1]), "scale"),
        (np.diag([1.0, -1, 1, 1]), "mirror"),
        (np.eye(4).T + np.eye(4)[:, ::-1] * 0.1, "last row"),
        (np.eye(3), "4 x 4"),
        ((np.zeros(3), np.zeros(4)), "unit quaternion"),
        ((np.zeros(2), np.array([1.0, 0, 0, 0])), "shape"),
        ((np.array([0, 0, 5.0]), np.array([1.0, 0, 0, 0])), "millimetres"),
        ("home", "numbers"),
    ],
)
def test_what_is_no_pose_is_refused_and_the_loop_goes_on(pose, words):
    gel = Gel("digit", BALL)
    before = gel.press(gel.touching(-8e-3, 0.0, 0.02e-3))
    with pytest.raises(TactileError, match=words):
        gel.press(pose)
    assert gel.contact is before
    assert gel.press(gel.touching(-8e-3, 0.0, 0.04e-3)).flags == ()


@pytest.mark.parametrize("force", [np.nan, -1.0, np.inf, "much", np.ones(2), 1e9], ids=str)
def test_what_is_no_force_is_refused(force):
    gel = Gel("digit", BALL)
    with pytest.raises(TactileError, match="force"):
        gel.press(gel.touching(-8e-3, 0.0), force=force)


def test_poses_and_forces_of_other_numbers_are_refused_after_those_that_go_together():
    gel = Gel("digit", BALL)
    pose = gel.touching(-8e-3, 0.0)
    for poses, forces, words in (([pose, pose], [0.1], "forces end"), ([pose], [0.1, None], "poses end")):
        steps = gel.follow(poses, forces)
        assert next(steps).flags == ()
        with pytest.raises(TactileError, match=words):
            next(steps)


def test_what_is_no_pose_or_force_is_passed_over_in_a_loop(caplog):
    gel, other = Gel("digit", BALL), Gel("digit", BALL)
    poses = [gel.touching(-8e-3, 0.0, depth) for depth in (0.02e-3, 0.04e-3)]
    first, lost, last = gel.follow([poses[0], np.full((4, 4), np.nan), poses[1]])
    assert lost.flags == ("refused",) and lost.force is first.force and "finite" in caplog.text
    np.testing.assert_array_equal(last.displacement, [*other.follow(poses)][-1].displacement)
    assert [contact.flags for contact in gel.follow(poses, [np.nan, 0.1])] == [("refused",), ()]
    assert "refused" in FLAGS


@pytest.mark.parametrize("sensor", ["digit", "biotac"])
@pytest.mark.parametrize("friction", [0.78, 0.0])
def test_drawn_out_in_one_step_the_contact_is_that_of_many(sensor, friction):
    """Drawn out farther than nodes are followed, the indenter left a dented surface behind and touched nothing."""
    gel = Gel(sensor, BALL, friction=friction)
    start = gel.touching(-8e-3, 0.0)
    deep, shallow = shifted(start, y=1.7e-3), shifted(start, y=0.3e-3)
    at_once = list(gel.follow([deep, shallow]))[-1]
    gel.reset()
    slowly = list(gel.follow([deep, *(shifted(start, y=y) for y in np.arange(1.5e-3, 0.4e-3, -0.2e-3)), shallow]))[-1]
    assert slowly.force[1] > 0.2
    assert at_once.flags == slowly.flags == ()
    np.testing.assert_allclose(at_once.displacement, slowly.displacement, atol=1e-6)  # m, what may pass through a node


@pytest.mark.parametrize("sensor", ["digit", "biotac"])
def test_a_force_that_falls_to_next_to_nothing_is_found(sensor):
    gel = Gel(sensor, BALL)
    pose = gel.touching(-8e-3, 0.0)
    gel.press(pose, force=5.0)
    faint = gel.press(pose, force=2e-5)  # N
    assert faint.flags == () and faint.force[1] == pytest.approx(2e-5, rel=2e-3)
    gel.press(pose, force=5.0)
    assert not gel.press(pose, force=1e-6).patch.any()


@pytest.mark.parametrize("friction", [0.78, 0.0])
def test_a_contact_too_large_for_a_step_is_given_in_several(friction, monkeypatch):
    """A ball of 300 mm diameter at 300 N took minutes: all nodes touch. Here a small one, with less work."""
    monkeypatch.setattr("tactile_core.jobs.gel._WORK", 2e8 if friction else 2e7)
    gel = Gel("digit", BALL, friction=friction)
    pose = gel.touching(-8e-3, 0.0)
    first = gel.press(pose, force=5.0)
    assert first.flags == ("force not reached", "too large") and 0.1 < first.force[1] < 5
    assert np.abs((first.traction * gel.areas[:, None]).sum(axis=0) - first.force).max() < 0.01 * first.force[1]
    steps = list(gel.follow([pose] * 9, [5.0] * 9))
    missing = [abs(contact.force[1] - 5) for contact in steps if contact.flags]
    assert missing == sorted(missing, reverse=True) and steps[-1].flags == ()
    assert steps[-1].force[1] == pytest.approx(5.0, rel=2e-3)
    monkeypatch.setattr("tactile_core.jobs.gel._WORK", 0.0)
    deeper = gel.press(shifted(steps[-1].pose, y=0.2e-3))
    assert deeper.flags == ("unsolved", "too large") and deeper.force is steps[-1].force
    assert "too large" in FLAGS


def test_flags_tell_what_is_wrong_and_the_loop_goes_on():
    gel = Gel("digit", BALL)
    assert gel.press(gel.touching(-8e-3, 0.0, 0.3e-3)).flags == ("began inside",)
    assert gel.press(gel.touching(-14e-3, 3e-3, 0.3e-3)).flags == ("jumped",)
    deep = gel.press(shifted(gel.touching(-14e-3, 3e-3), y=2.95e-3))
    assert deep.flags == ("too deep",) and deep.depth < 2.5e-3
    strong = gel.press(gel.touching(-14e-3, 3e-3, 0.3e-3), force=400.0)
    assert "force not reached" in strong.flags and strong.force[1] > 1
    away = gel.press(shifted(gel.touching(-14e-3, 3e-3), y=-5e-3))
    assert away.flags == () and not away.patch.any() and not away.displacement.any()
    beside = gel.press(shifted(gel.touching(-14e-3, 3e-3), z=50e-3))
    assert beside.flags == () and not beside.patch.any()
    assert gel.press(shifted(gel.touching(-14e-3, 3e-3), z=50e-3), force=1.0).flags == ("force not reached",)
    assert gel.press(gel.touching(-8e-3, 0.0, 0.02e-3)).flags == ()
    assert {"began inside", "jumped", "too deep", "force not reached"} <= set(FLAGS)


@pytest.mark.parametrize(("friction", "flags"), [(0.78, ("friction forgotten",)), (0.0, ())])
def test_where_the_path_leads_to_no_contact_one_that_comes_straight_in_is_found(friction, flags, monkeypatch):
    gel, straight = Gel("digit", BALL, friction=friction), Gel("digit", BALL, friction=friction)
    *before, last = path(gel)
    for pose in before:
        gel.press(pose)

    def unsolved(*_, **__):
        raise UnsolvedError("no equilibrium")

    monkeypatch.setattr(gel._press, "at_depth", unsolved)
    found = gel.press(last)
    assert found.flags == flags
    np.testing.assert_array_equal(found.displacement, straight.press(last).displacement)
    assert gel.press(shifted(last, x=0.1e-3)).flags == ()  # and the path goes on from there
    monkeypatch.setattr(CorrectedPress, "at_depth", unsolved)
    here = gel.contact
    assert gel.press(last).flags == ("unsolved",)
    np.testing.assert_array_equal(gel.contact.force, here.force)


def test_a_tip_that_sinks_in_between_nodes_is_told_from_a_solver_that_fails():
    gel = Gel("digit", Sphere(0.3e-3))
    steps = [gel.press(gel.touching(-8e-3, 0.1e-3, depth)) for depth in (0.05e-3, 0.5e-3)]
    assert steps[1].flags == ("unsolved", "too sharp") and steps[1].force is steps[0].force
    assert "too sharp" in FLAGS


def test_a_thin_plate_that_has_passed_the_nodes_is_not_taken_for_no_contact():
    gel = Gel("digit", Box((6e-3, 6e-3, 0.1e-3), 0.04e-3))
    assert gel.press(gel.touching(-3e-3, 0.05e-3, 0.7e-3)).flags[-2:] == ("unsolved", "too sharp")


def test_meshes_and_sensors_that_cannot_be_are_refused():
    cut = trimesh.creation.icosphere(2, 3e-3)
    cut.update_faces(np.arange(len(cut.faces)) > 0)
    huge = type(
        "Mesh", (), {"vertices": np.random.default_rng(0).random((9, 3)), "faces": np.zeros((5_000_000, 3), int)}
    )
    for mesh, words in ((cut, "not closed"), (huge, "5000000 triangles"), ("ball", "trimesh"), (None, "trimesh")):
        with pytest.raises(TactileError, match=words):
            Gel("digit", mesh)
    with pytest.raises(TactileError, match="seems to be in millimetres"):
        Gel("digit", trimesh.creation.icosphere(2, 3.0))  # in millimetres
    with pytest.raises(TactileError, match="biotac, biotac_sp, digit"):
        Gel("gelsight", BALL)
    for friction in (-1.0, "rough"):
        with pytest.raises(TactileError, match="coefficient"):
            Gel("digit", BALL, friction=friction)
    with pytest.raises(TactileError, match=r"Gel.touching: -8; expected x, z and depth in m"):
        Gel("digit", BALL).touching(x=-8, z=0)
    with pytest.raises(TactileError, match="one of fast"):
        Gel("digit", BALL, preset="best")
    with pytest.raises(TactileError, match="trimesh"):
        Gel("digit", Sphere)  # the class, not one of it


def test_first_touch_is_looked_for_once_a_line(monkeypatch):
    """It is the same at every depth, and costs as much as a small contact."""
    gel, looked, whole = Gel("digit", BALL), [], gel_module.first_touch_on_line
    pose = gel.touching(-8e-3, 0.5e-3)
    monkeypatch.setattr(gel_module, "first_touch_on_line", lambda *given: looked.append(given) or whole(*given))
    for depth in (0.1e-3, 0.2e-3, 0.3e-3):
        gel.press(shifted(pose, y=depth))
    assert len(looked) == 1
    assert gel.press(shifted(pose, x=0.1e-3, y=0.3e-3)).depth > 0 and len(looked) == 2  # slid


def test_a_copy_moves_on_by_itself():
    poses = path(gel := Gel("digit", BALL))
    *_, alone = gel.follow(poses)
    gel.reset()
    *_, held = gel.follow(poses[:-3])
    for copied in (copy.copy(gel), copy.deepcopy(gel)):
        *_, other = copied.follow(shifted(held.pose, x=-0.1e-3 * k) for k in range(1, 6))
        assert gel.contact is held and other.force[0] < 0
    *_, after = gel.follow(poses[-3:])
    assert same(after, alone)


def test_another_indenter_friction_or_preset_counts_from_the_next_step():
    poses = path(gel := Gel("digit", BALL))
    *_, before = gel.follow(poses)
    shown = gel.picture()
    gel.indenter = Sphere(5e-3)
    np.testing.assert_array_equal(gel.picture(), shown)  # of the contact that was solved
    after, wide = gel.press(poses[-1]), Gel("digit", Sphere(5e-3))
    assert after.flags == ("jumped",) and same(after, wide.press(poses[-1])) and not same(after, before)
    np.testing.assert_array_equal(gel.picture(), wide.picture())
    gel.friction = 0.0
    assert gel.press(poses[-2]).slipping == 0 and "jumped" not in gel.press(poses[-1]).flags
    gel.preset = "standard"
    assert gel._renderer.preset == "standard"
    assert copy.copy(gel)._drawer is None  # Mitsuba's scene cannot be copied
    assert copy.copy(gel)._press.compliance is gel._press.compliance  # 200 MB
