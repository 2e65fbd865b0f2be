"""Contacts followed through time: what is decided by neighbours, and what must not be smeared over them."""

import dataclasses

import numpy as np
import pytest

from tactile_core.translation.contact_track import Evidence, ForwardTracker, Tracker, track
from tactile_core.translation.posterior import touches

SPREAD = np.float32([0.1, 0.1, 0.1, 0.1])  # a cell, and 10 % of a force
OTHER = np.float32([0.8, -0.6, 0, 0])  # where another contact would answer for the same signals
STATE = np.float32([1.0, 0.5, 2.5, 2.0])


def posterior(states, rng, right=0.9):
    """Two components a frame: the truth, measured with noise, and another place; in 1 - `right` that weighs more."""
    means = states + SPREAD * rng.standard_normal(states.shape).astype(np.float32)
    weight = np.where(rng.random(len(states)) < right, 0.6, 0.4).astype(np.float32)
    mean = np.stack([means, means + OTHER], axis=1)
    size, signed = 100 * np.sinh(states[:, 2]), np.zeros(len(states), bool)  # counts, in proportion to the force
    weights, spread = np.stack([weight, 1 - weight], axis=1), np.broadcast_to(SPREAD, mean.shape)
    return Evidence(weights, mean, spread, size, signed, states, signed, np.zeros((len(states), 0)))


def part(whole, start, stop):
    return whole.at(slice(start, stop))


def follow(whole, time):
    tracker = ForwardTracker()
    return np.concatenate([tracker(part(whole, at, at + 1), time[at]) for at in range(len(time))])


def place_error(states, truth):
    return np.hypot(*(states - truth)[:, :2].T)


@pytest.fixture
def sliding():
    """Three seconds of a contact that moves by 2 cells, and what each frame says of it."""
    truth = np.tile(STATE, (300, 1))
    truth[:, 0] += np.linspace(0, 0.2, 300, dtype=np.float32)
    return truth, posterior(truth, np.random.default_rng(5)), np.arange(300) / 100


def test_neighbours_decide_between_two_places(sliding):
    truth, said, time = sliding
    alone, both, causal = (place_error(each, truth) for each in (said.likely, track(said, time), follow(said, time)))
    assert np.mean(alone > 0.5) > 0.05  # what there is to decide
    assert both.max() < 0.5
    assert np.median(both) < 0.5 * np.median(alone)
    assert np.mean(causal > 0.5) < 0.02
    assert np.median(causal) < 0.7 * np.median(alone)


@pytest.mark.parametrize("frames", [3, 5])
def test_a_tap_keeps_its_frames_and_its_force(frames):
    """50 ms and less: what is not touched stays so, and no force is lost to the neighbours."""
    truth = np.zeros((60, 4), np.float32)
    truth[30 : 30 + frames] = STATE
    said, time = posterior(truth, np.random.default_rng(2), right=1.0), np.arange(60) / 100
    for found in (track(said, time), follow(said, time)):
        touched = touches(found)
        assert np.array_equal(np.flatnonzero(touched), np.arange(30, 30 + frames))
        assert np.abs(found[touched, 2] - STATE[2]).max() < 3 * SPREAD[2]


def test_a_contact_that_comes_elsewhere_is_not_drawn_there():
    """Two places, with three frames without contact between them."""
    truth = np.tile(STATE, (43, 1))
    truth[20:23] = 0
    truth[23:, :2] = -STATE[:2]
    said = posterior(truth, np.random.default_rng(3), right=1.0)
    found = track(said, np.arange(43) / 100)
    assert place_error(found, truth)[np.r_[:20, 23:43]].max() < 3 * SPREAD[0]


def test_nothing_is_smoothed_over_a_gap():
    truth = np.tile(STATE, (40, 1))
    truth[20:, :2] += 0.3
    said = posterior(truth, np.random.default_rng(4), right=1.0)
    time = np.arange(40) / 100
    time[20:] += 10
    found = track(said, time)
    apart = [track(part(said, *rows), time[slice(*rows)]) for rows in ((0, 20), (20, 40))]
    assert np.allclose(found, np.concatenate(apart), atol=2e-3)  # what an all but free step still ties
    clock = np.concatenate([time[20:], time[:20]])  # one that was set back
    assert np.isfinite(track(said, clock)).all()


def test_force_is_calmed_by_the_size_of_the_signals():
    """The signals show how the force changes from frame to frame better than each frame's own estimate does."""
    truth = np.tile(STATE, (300, 1))
    truth[:, 2] += 0.5 * np.sin(2 * np.arange(300, dtype=np.float32))
    said, time = posterior(truth, np.random.default_rng(9), right=1.0), np.arange(300) / 100
    unknown = dataclasses.replace(said, size=np.full(300, said.size.mean()))
    off = {name: np.std(each[:, 2] - truth[:, 2]) for name, each in (
        ("both ways", track(said, time)), ("causal", follow(said, time)), ("unknown", track(unknown, time)),
    )}  # fmt: skip
    assert off["both ways"] < 0.6 * SPREAD[2]
    assert off["causal"] < 0.8 * SPREAD[2]
    assert off["unknown"] > SPREAD[2]


def test_rectified_places_move_less():
    """Their errors outlast a frame, so that their steps are taken as shorter."""
    truth = np.tile(STATE, (300, 1))
    said, time = posterior(truth, np.random.default_rng(10), right=1.0), np.arange(300) / 100
    rectified = dataclasses.replace(said, rectified=np.ones(300, bool))
    for each in (track, follow):
        calm, other = (np.std(each(one, time)[50:, :2], axis=0) for one in (rectified, said))
        assert (calm < 0.8 * other).all()


def test_a_live_contact_may_begin_on_a_path_that_did_not_touch():
    """The best path's frame before may be of a contact that was not the frame's own answer."""
    truth = np.tile(STATE, (3, 1))
    said = posterior(truth, np.random.default_rng(11), right=1.0)
    said.mean[0, 0] = 0.0  # no contact, likelier in the first frame; on the path the other component is
    said.mean[0, 1] = STATE
    assert np.isfinite(follow(said, np.arange(3) / 100)).all()


def test_no_lag_in_a_ramp(sliding):
    """A force that grows within 0.2 s is not answered late: no frame's force is that of one before or after."""
    ramp = np.concatenate([np.zeros(20), np.linspace(0, 3, 20), np.full(20, 3.0), np.linspace(3, 0, 20), np.zeros(20)])
    truth = np.tile(STATE, (100, 1)) * (ramp > 0)[:, None]
    truth[:, 2:] = ramp[:, None]
    said = posterior(truth.astype(np.float32), np.random.default_rng(6), right=1.0)
    found = track(said, np.arange(100) / 100)[:, 2]
    off = [np.abs(np.roll(found, -lag) - ramp)[5:95].mean() for lag in (-1, 0, 1)]
    assert np.argmin(off) == 1
    assert off[1] < 0.1


def test_a_frame_depends_on_no_choice_of_frames():
    rng = np.random.default_rng(7)
    truth = np.cumsum(rng.normal(scale=0.02, size=(1000, 4)), axis=0).astype(np.float32) + STATE
    said, time = posterior(truth, rng), np.arange(1000) / 100

    def read(start, stop):
        return time[start:stop], part(said, start, stop)

    evidence, whole = Tracker(read, 1000)(np.arange(1000))
    assert np.array_equal(evidence.mean, said.mean)
    for frames in (np.arange(0, 1000, 7), np.arange(250, 262), np.array([999])):
        assert np.array_equal(Tracker(read, 1000)(frames)[1], whole[frames])
    steps = Tracker(read, 1000)
    assert np.array_equal(np.concatenate([steps(np.arange(at, at + 50))[1] for at in range(0, 1000, 50)]), whole)
    # The margin is as good as the whole recording, but for what a choice between components carries further.
    assert np.mean(np.abs(whole - track(said, time)) > 0.02) < 0.01


def test_no_frame_and_one_frame():
    said = posterior(STATE[None], np.random.default_rng(8), right=1.0)
    assert track(part(said, 0, 0), np.empty(0)).shape == (0, 4)
    assert np.allclose(track(said, np.zeros(1)), said.likely, atol=2e-3)
    assert np.allclose(follow(said, np.zeros(1)), said.likely, atol=4e-3)  # a weak prior draws it to the middle
