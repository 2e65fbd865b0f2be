"""The stiffness of what touches, as points come and go, and the Newton step of friction that is made of it."""

import types

import numpy as np
import pytest

from tactile_core.mechanics.fast.active_set import UnsolvedError
from tactile_core.mechanics.fast.compliance_rows import ComplianceBlock
from tactile_core.mechanics.fast.contact_stiffness import RIDGE, ContactStiffness
from tactile_core.mechanics.fast.coulomb import Motion, Points, slipping_nodes
from tactile_core.mechanics.fast.newton_step import change_of

CORE = 2


def block(nodes, core=CORE, seed=3) -> ComplianceBlock:
    """A block of a made-up surface: nodes' compliance falls with their distance, alike in every block."""
    nodes = np.asarray(nodes)
    made = types.SimpleNamespace(nodes=nodes, inner=np.arange(core), k=len(nodes), c=core)
    whole = np.random.default_rng(seed).normal(size=(3 * 60 + CORE, 400))
    whole = (whole @ whole.T / 400 + 0.3 * np.eye(len(whole))) * 1e-4  # m/N
    rows = np.r_[(3 * nodes[:, None] + np.arange(3)).ravel(), 3 * 60 + np.arange(core)]
    made.matrix = whole[np.ix_(rows, rows)].astype(np.float32)
    made.keys = np.r_[(3 * nodes[:, None] + np.arange(3)).ravel(), 2**40 + np.arange(core)]
    return made


def amiss(stiffness: ContactStiffness, of: ComplianceBlock, active: np.ndarray) -> float:
    """Largest entry of stiffness times compliance, less one on the diagonal."""
    whole, rows = stiffness.among(of, active)
    wanted = np.r_[np.repeat(active[: of.k], 3), active[of.k :]]
    touch = wanted[rows]
    inverse, rows = whole[np.ix_(touch, touch)], rows[touch]
    np.testing.assert_array_equal(np.sort(rows), np.flatnonzero(wanted))
    assert np.count_nonzero(whole) == np.count_nonzero(inverse)
    compliance = of.matrix[np.ix_(rows, rows)].astype(float) * (1 + RIDGE * np.eye(len(rows)))
    return float(np.abs(inverse @ compliance - np.eye(len(rows))).max())


def test_points_come_and_go_from_block_to_block():
    random, stiffness = np.random.default_rng(0), ContactStiffness()
    for _ in range(200):  # past the updates after which it is made anew
        of = block(np.sort(random.choice(60, random.integers(20, 50), replace=False)))
        active = random.random(of.k + of.c) < 0.9
        for _ in range(3):
            assert amiss(stiffness, of, active) < 1e-4  # single precision, a condition of 30, and 50 updates
            active = active ^ (random.random(len(active)) < 0.05)
    assert amiss(stiffness, of, np.zeros(of.k + of.c, bool) | (np.arange(of.k + of.c) == 3)) < 1e-5


def test_nothing_touches_and_then_something():
    stiffness, of = ContactStiffness(), block(range(10), core=0)
    assert stiffness.among(of, np.zeros(10, bool))[0].shape == (0, 0)
    assert amiss(stiffness, of, np.ones(10, bool)) < 1e-5


@pytest.mark.parametrize("size", [8, 12, 16])
def test_what_is_not_definite_is_refused_and_forgotten(size):
    stiffness, of, bad = ContactStiffness(), block(range(12)), block(range(size))
    assert amiss(stiffness, of, np.ones(14, bool)) < 1e-5
    bad.matrix = -bad.matrix
    bad.keys = bad.keys + 3000
    with pytest.raises(UnsolvedError, match="positive definite"):
        stiffness.among(bad, np.ones(bad.k + bad.c, bool))
    with pytest.raises(UnsolvedError, match="positive definite"):
        stiffness.among(bad, np.ones(bad.k + bad.c, bool))  # as the same block
    assert amiss(stiffness, of, np.ones(14, bool)) < 1e-5


@pytest.mark.parametrize("deepens", [False, True])
def test_the_step_fulfils_its_linear_equations(deepens):
    """Sticking nodes stay, gaps close, friction obeys Coulomb's law and follows the turn of normals."""
    random, of, friction = np.random.default_rng(1), block(range(0, 40, 2)), 0.6
    active = np.ones(of.k + of.c, bool)
    active[[4, 11]] = False
    at, curved = np.array([1, 3, 8, 9, 15]), np.array([1, 3])
    normal = random.normal(size=(of.k, 3))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    lean = np.cross(normal, random.normal(size=(of.k, 3)))
    lean /= np.linalg.norm(lean, axis=1)[:, None]
    slip, moves = (random.normal(size=(of.k, 3)) * 1e-5 for _ in range(2))
    slip -= np.einsum("ai,ai->a", slip, normal)[:, None] * normal
    gap = random.normal(size=of.k) * 1e-5
    bend = np.eye(3) * np.array([300.0, 500.0])[:, None, None]  # 1/m
    direction, core_gap, bears = np.array([0.0, 1.0, 0.0]), np.array([1e-5, -2e-5]), 0.05 * normal
    slips = np.isin(np.arange(of.k), at)
    points = Points(bears, np.zeros(CORE), active, slips, normal, lean, gap, core_gap, slip)
    motion = Motion(moves, slip, gap)
    slipping, away = slipping_nodes(at, points, motion, curved, bend, friction), slip + gap[:, None] * normal
    step = change_of(ContactStiffness().among(of, active), points, motion, slipping, direction, deepens=deepens)
    on = np.r_[np.repeat(active[: of.k], 3), active[of.k :]]
    compliance = of.matrix.astype(float) * (1 + RIDGE * np.eye(len(of.matrix)))
    for column in range(1 + deepens):
        forces = step.forces[:, column]
        assert not forces[~on].any()
        moved = (compliance @ forces)[: 3 * of.k].reshape(-1, 3)
        goal, scale = (-away, 1e-5) if column == 0 else (np.tile(direction, (of.k, 1)), 1.0)
        sticks = active[: of.k] & ~np.isin(np.arange(of.k), at)
        np.testing.assert_allclose(moved[sticks], goal[sticks], atol=1e-4 * scale)
        np.testing.assert_allclose(
            (compliance @ forces)[3 * of.k :], [-core_gap, 0 * core_gap][column], atol=1e-4 * scale
        )
        off, across = moved[at] - goal[at], slipping.across  # a slipping node closes its gap and may slip
        bears = forces[: 3 * of.k].reshape(-1, 3)[at]
        relative = moved[at[curved]] + (moves[at[curved]] if column == 0 else -direction)
        bears[curved] -= np.einsum("cij,cj->ci", slipping.turning, relative)
        turn = np.einsum("ai,ai->a", across, bears)
        np.testing.assert_allclose(np.einsum("ai,ai->a", normal[at], off), 0, atol=1e-4 * scale)
        np.testing.assert_allclose(
            np.einsum("ai,ai->a", across, off), -slipping.against * turn, atol=1e-4 * scale
        )  # fmt: skip
        law = np.einsum("ai,ai->a", lean[at] - friction * normal[at], bears)
        np.testing.assert_allclose(law, 0, atol=1e-4 * np.abs(bears).max())


def test_a_block_without_points_has_no_stiffness():
    stiffness, of, none = ContactStiffness(), block(range(12)), block(range(12))
    assert amiss(stiffness, of, np.ones(14, bool)) < 1e-5
    none.k, none.matrix, none.keys = 0, none.matrix[:0, :0], none.keys[:0]
    assert [len(each) for each in stiffness.among(none, np.ones(0, bool))] == [0, 0]
    assert amiss(stiffness, of, np.ones(14, bool)) < 1e-5
