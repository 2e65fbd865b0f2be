"""Presses in torch: the contacts of `Gel`, and gradients of pictures by poses and forces against differences."""

from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="training needs torch")
pytest.importorskip("scipy", reason="extra [fem] is not installed")

from tactile_core.errors import TactileError  # noqa: E402
from tactile_core.geometry.indenters import Cylinder, Sphere  # noqa: E402
from tactile_core.jobs.gel import Gel  # noqa: E402
from tactile_core.mechanics.force_search import UnreachableError  # noqa: E402
from tactile_core.training.batch_pictures import BatchPictures  # noqa: E402
from tactile_core.training.press_gradient import moved, pressed  # noqa: E402
from tactile_core.translation.translate import load_translator  # noqa: E402

BALL = Sphere(3e-3)
MOTION = torch.tensor([[0, 0, 0, 0.03, 0.02, 0.2]], dtype=torch.float64)
ELSEWHERE = torch.tensor([[2e-4, 5e-5, -1e-4, 0.02, 0.02, 0.02]], dtype=torch.float64)
UNITS = np.array([1, 1, 1, 3e-3, 3e-3, 3e-3])  # m: what a motion of 1 moves at an indenter's side


@pytest.fixture(scope="module")
def batch():
    return BatchPictures(load_translator()).double()


def start(indenter=BALL, depth: float = 0.3e-3) -> np.ndarray:
    return Gel("digit", indenter=indenter).touching(x=-8e-3, z=1e-3, depth=depth)


@pytest.mark.parametrize(("indenter", "friction"), [(BALL, 0.0), (Cylinder(2e-3, 0.3e-3), 0.78)])
def test_gradients_of_a_picture_by_the_pose_are_those_of_differences(batch, indenter, friction):
    """Of a picture's squared distance from another contact's, as a search for the pose takes it."""
    pose = start(indenter)

    def picture(motion):
        return batch.pictures(pressed("digit", indenter, moved(pose, motion), friction=friction)[0])

    with torch.no_grad():
        goal = picture(MOTION + ELSEWHERE)
    motion = MOTION.clone().requires_grad_()
    (picture(motion) - goal).square().sum().backward()
    step = 2e-6  # m at the side
    for way in np.random.default_rng(0).standard_normal((2, 6)):  # each motion by itself: test_pose_derivative
        part = torch.from_numpy(step * way / UNITS)[None]
        with torch.no_grad():
            ahead, back = ((picture(MOTION + one) - goal).square().sum() for one in (part, -part))
        # Shadows go in steps of their table, and nodes begin to touch: measured below 1.5 %.
        assert float((motion.grad * part).sum()) == pytest.approx(float(ahead - back) / 2, rel=0.03)


def test_gradients_of_a_picture_by_the_force_are_those_of_differences(batch):
    poses = moved(start(), MOTION)

    def pictures(force):
        displacement, found = pressed("digit", BALL, poses, force)
        return batch.pictures(displacement), float(found[0, 1].detach())

    goal = pictures(torch.tensor([0.5], dtype=torch.float64))[0].detach()
    force = torch.tensor([0.4], dtype=torch.float64, requires_grad=True)
    (pictures(force)[0] - goal).square().sum().backward()
    with torch.no_grad():
        (ahead, more), (back, less) = (pictures(share * force) for share in (1.02, 0.98))
    by_difference = float((ahead - goal).square().sum() - (back - goal).square().sum()) / (more - less)
    assert float(force.grad) == pytest.approx(by_difference, rel=0.03)  # as by the pose
    assert more == pytest.approx(1.02 * 0.4, rel=1e-3) and less == pytest.approx(0.98 * 0.4, rel=1e-3)


def test_they_are_the_contacts_of_a_gel_that_begins_anew():
    poses = moved(start(depth=0.15e-3), torch.cat([MOTION, MOTION + ELSEWHERE]))
    displacement, force = pressed("digit", BALL, poses)
    for pose, moves, bears in zip(poses.numpy(), displacement.numpy(), force.numpy(), strict=True):
        contact = Gel("digit", indenter=BALL).press(pose)
        assert "unsolved" not in contact.flags
        np.testing.assert_allclose(moves, contact.displacement, rtol=0, atol=1e-9)
        np.testing.assert_allclose(bears, contact.force, rtol=1e-6, atol=1e-9)


def test_the_forces_gradient_leads_to_the_depth_of_a_force():
    """Newton's method with the gradient of the force: where the ball must stand to bear 0.5 N."""
    pose, depth = start(depth=0.0), torch.tensor(0.2e-3, dtype=torch.float64)
    for _ in range(6):
        depth = depth.detach().requires_grad_()
        motion = torch.zeros(1, 6, dtype=torch.float64).index_put((torch.tensor(0), torch.tensor(1)), depth)
        force = pressed("digit", BALL, moved(pose, motion))[1][0, 1]
        (slope,) = torch.autograd.grad(force, depth)
        depth = depth - (force - 0.5) / slope
    assert float(force.detach()) == pytest.approx(0.5, rel=1e-4)


def test_motions_turn_about_the_indenters_own_origin():
    quarter = torch.tensor([[1e-3, 0, 0, 0, torch.pi / 2, 0]], dtype=torch.float64)
    found = moved(start(), quarter)[0].numpy()
    expected = start()
    expected[0, 3] += 1e-3
    expected[:3, :3] = np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]]) @ expected[:3, :3]
    np.testing.assert_allclose(found, expected, atol=1e-12)
    assert torch.autograd.gradcheck(lambda motion: moved(start(), motion), MOTION.clone().requires_grad_())


def test_where_nothing_touches_nothing_moves():
    motion = torch.tensor([[0, -1e-3, 0, 0, 0, 0]], dtype=torch.float32, requires_grad=True)
    forces = torch.zeros(1, requires_grad=True)
    for given in (None, forces):
        displacement, force = pressed("digit", BALL, moved(start(), motion), given)
        assert displacement.dtype == torch.float32 and not displacement.any() and not force.any()
        (displacement.sum() + force.sum()).backward()
    assert not motion.grad.any() and not forces.grad.any()


def test_what_cannot_be_pressed_is_said_with_its_number():
    with pytest.raises(TactileError, match="shapes of poses and forces"):
        pressed("digit", BALL, torch.zeros(4, 4))
    with pytest.raises(TactileError, match="shapes of poses and forces"):
        pressed("digit", BALL, torch.eye(4)[None], torch.ones(2))
    poses = moved(start(), torch.zeros(2, 6, dtype=torch.float64))
    poses[1] *= 2
    with pytest.raises(TactileError, match=r"poses\[1\].*last row"):
        pressed("digit", BALL, poses)
    deep = moved(start(), torch.tensor([[0, 5e-3, 0, 0, 0, 0]], dtype=torch.float64))
    with pytest.raises(UnreachableError, match=r"poses\[0\].*Press less"):
        pressed("digit", BALL, deep)
