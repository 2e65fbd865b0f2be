"""Track a contact through time: the most plausible path given the posteriors of all frames.

A finger's contact moves little in 10 ms, so a frame whose signals leave two places open is decided by its neighbours.
Each frame's posterior is a mixture; first the best path through its components is found, by their weights less the cost
of each step (Viterbi 1967), then the places on it are smoothed both ways (Kalman filter; Rauch, Tung and Striebel
1965). Force and depth may change within a frame, so they are not smoothed: they are the frame's own estimates, given
its place. `Follower` runs the filter alone, frame by frame, on live signals.

A path may jump without contact, where frames are missing, and, at a cost, anywhere.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from .network_sizes import PLACE
from .networks import FORCE_SCALE, Posterior

# Standard deviation of what a state changes by in 10 ms. Places are in tens of cells: 0.3 cells, so 30 mm/s; asinh of
# force and depth 0.6, which a tap that is over in 50 ms still reaches (chosen on the shipped recording with gains off).
STEP = np.array([0.03, 0.03, 0.6, 0.6])
FRAME = 0.01  # s
GAP = 0.1  # s without a frame: nothing is known of what happened meanwhile (assumed)
ANYWHERE = 2.0  # tens of cells: the standard deviation of a place that may be anywhere on a sensor
# Of a contact's state, below which nothing touches: half the force of the lightest contact that training knows, 0.06 N.
LEAST_FORCE = float(np.arcsinh(0.03 / FORCE_SCALE))
JUMP = 8.0  # price of a jump in mid-contact: that of a step of four standard deviations (assumed)
BLOCK, MARGIN = 256, 64  # frames smoothed at once, and how many more are read on either side (a course forgets sooner)

Read = Callable[[int, int], tuple[np.ndarray, Posterior]]


class _Course(NamedTuple):
    """Places on the best path.

    mean, variance : (T, PLACE); touched : (T,), true in contact; free : (T,), true where the path starts again
    """

    mean: np.ndarray
    variance: np.ndarray
    touched: np.ndarray
    free: np.ndarray


def track(posterior: Posterior, time: np.ndarray) -> np.ndarray:
    """Estimate the state (T, STATE) float32 of the contact in T frames at times (T,) s from their posterior,
    smoothed both ways.
    """
    if len(time) == 0:
        return np.zeros(posterior.mean.shape[::2], np.float32)
    course = _best_course(posterior, time)
    steps = np.where(course.free[:, None], ANYWHERE**2, _steps(time)[:, :PLACE])
    return _given(_smoothed(course, steps), course.touched, _components(posterior)).astype(np.float32)


class Tracked:
    """States of the contact in a whole recording, computed on demand."""

    def __init__(self, read: Read, count: int) -> None:
        """Take read(start, stop), which gives times and posterior of these frames; count : frames in all."""
        self._read, self._count = read, count
        self._kept: tuple[int, np.ndarray] | None = None

    def __call__(self, frames: np.ndarray) -> np.ndarray:
        """States (n, STATE) of frames (n,), in rising order; a frame's state does not depend on the other
        frames requested.
        """
        blocks = frames // BLOCK
        parts = [self._block(int(block))[frames[blocks == block] - block * BLOCK] for block in np.unique(blocks)]
        return np.concatenate(parts)

    def _block(self, block: int) -> np.ndarray:
        if self._kept is None or self._kept[0] != block:
            first = block * BLOCK
            start, stop = max(first - MARGIN, 0), min(first + BLOCK + MARGIN, self._count)
            time, posterior = self._read(start, stop)
            self._kept = block, track(posterior, time)[first - start :][:BLOCK]
        return self._kept[1]


class Follower:
    """Forward filter alone: one frame after another, without later ones."""

    def __init__(self) -> None:
        self._score: np.ndarray | None = None
        self._place = np.zeros(PLACE)
        self._variance: np.ndarray
        self._frame: _Frame
        self._time: float

    def __call__(self, posterior: Posterior, time: float) -> np.ndarray:
        """Estimate the state (1, STATE) float32 of a contact from the posterior of one frame at `time` s."""
        now = _Frame(*(each[0] for each in _components(posterior)))
        score, before = now.weight, np.full(PLACE, ANYWHERE**2)
        if self._score is not None and 0 <= time - self._time < GAP:
            step = _step(time - self._time)
            moves, free = _moves(self._frame, now, step)
            total = self._score[:, None] + moves
            score = total.max(axis=0) + now.weight
            if not free[total[:, score.argmax()].argmax(), score.argmax()]:
                before = self._variance + step[:PLACE]
        best = int(score.argmax())
        gain = before / (before + now.spread[best, :PLACE] ** 2)
        place = self._place + gain * (now.mean[best, :PLACE] - self._place)
        variance = (1 - gain) * before
        self._score, self._frame, self._time = score - score.max(), now, time
        self._place, self._variance = place, variance
        frame = _Frame(*(each[None] for each in now))
        return _given(place[None], _touched(now.mean[best])[None], frame).astype(np.float32)


class _Frame(NamedTuple):
    """Components of frames: weight (..., C), a logarithm; mean, spread (..., C, STATE)."""

    weight: np.ndarray
    mean: np.ndarray
    spread: np.ndarray


def _components(posterior: Posterior) -> _Frame:
    weight = np.log(np.maximum(posterior.weight, np.finfo(np.float32).tiny))
    return _Frame(*(np.asarray(each, np.float64) for each in (weight, posterior.mean, posterior.spread)))


def _step(seconds: np.ndarray | float) -> np.ndarray:
    """Variance (..., STATE) of the change of a state in that time."""
    return np.square(STEP) * np.asarray(seconds)[..., None] / FRAME


def _steps(time: np.ndarray) -> np.ndarray:
    """Variance (T, STATE) of the change since the frame before; free at the first frame and after gaps."""
    seconds = np.diff(time, prepend=-np.inf)
    close = (seconds >= 0) & (seconds < GAP)  # a clock that runs backwards carries no information
    return np.where(close[:, None], _step(np.where(close, seconds, 0)), ANYWHERE**2)


def _moves(before: _Frame, now: _Frame, step: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Negative cost (..., C, C) of the step from each component of one frame to each of the next, and true where it is
    free.

    The cost is half the squared distance in standard deviations, without a density's normalisation: neighbours err
    together, by gains and rest, so that two frames that agree prove less than with independent errors (with it, the 90
    % quantile of place is 6.1 cells for 3.3, on the recording that the steps were chosen by).
    """
    far = now.mean[..., None, :, :] - before.mean[..., :, None, :]
    known = np.square(now.spread[..., None, :, :]) + np.square(before.spread[..., :, None, :])
    lightest = np.minimum(now.mean[..., None, :, PLACE], before.mean[..., :, None, PLACE])
    untouched = lightest < LEAST_FORCE
    off = np.square(far) / (known + step[..., None, None, :])
    off[..., :PLACE] *= ~untouched[..., None]
    price = 0.5 * off.sum(axis=-1)
    return -np.minimum(price, JUMP), untouched | (price > JUMP)


def _best_course(posterior: Posterior, time: np.ndarray) -> _Course:
    """Find the best path through the components of each frame."""
    all_frames = _components(posterior)
    before, now = (_Frame(*(each[part] for each in all_frames)) for part in (slice(None, -1), slice(1, None)))
    moves, free = _moves(before, now, _steps(time)[1:])
    score, came = all_frames.weight[0], np.zeros(posterior.weight.shape, int)
    for frame in range(1, len(time)):
        total = score[:, None] + moves[frame - 1]
        came[frame] = total.argmax(axis=0)
        score = total.max(axis=0) + all_frames.weight[frame]
    path = np.empty(len(time), int)
    path[-1] = score.argmax()
    for frame in range(len(time) - 1, 0, -1):
        path[frame - 1] = came[frame, path[frame]]
    each = np.arange(len(time))
    begins = np.concatenate([[True], free[each[:-1], path[:-1], path[1:]]])
    mean, spread = (values[each, path, :PLACE] for values in all_frames[1:])
    return _Course(mean, np.square(spread), _touched(all_frames.mean[each, path]), begins)


def _touched(mean: np.ndarray) -> np.ndarray:
    return mean[..., PLACE] >= LEAST_FORCE


def _given(place: np.ndarray, touched: np.ndarray, components: _Frame) -> np.ndarray:
    """States (T, STATE) at places (T, PLACE): force and depth are means over components, weighted by their nearness to
    the place.

    touched : (T,), which components count: without contact the place is zero, where contacts lie too
    """
    far = (place[:, None] - components.mean[..., :PLACE]) / components.spread[..., :PLACE]
    share = components.weight - (0.5 * np.square(far) + np.log(components.spread[..., :PLACE])).sum(axis=-1)
    share = np.where(_touched(components.mean) == touched[:, None], share, -np.inf)
    share = np.exp(share - share.max(axis=-1, keepdims=True))
    share /= share.sum(axis=-1, keepdims=True)
    return np.concatenate([place, (share[..., None] * components.mean[..., PLACE:]).sum(axis=1)], axis=-1)


def _smoothed(course: _Course, steps: np.ndarray) -> np.ndarray:
    """Means (T, PLACE) of a random walk given all its measurements."""
    mean, variance, expected = (np.empty_like(course.mean) for _ in range(3))
    now, spread = course.mean[0], np.zeros(PLACE)
    for frame, step in enumerate(steps):
        expected[frame] = spread + step
        gain = expected[frame] / (expected[frame] + course.variance[frame])
        now = now + gain * (course.mean[frame] - now)
        spread = (1 - gain) * expected[frame]
        mean[frame], variance[frame] = now, spread
    for frame in range(len(steps) - 2, -1, -1):
        back = variance[frame] / expected[frame + 1]
        mean[frame] += back * (mean[frame + 1] - mean[frame])
    return mean
