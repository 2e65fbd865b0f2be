"""Track a contact through time: the most plausible path given the posteriors of all frames.

A finger's contact moves little in 10 ms, so a frame whose signals leave two places open is decided by its neighbours.
Each frame's posterior is a mixture; first the best path through its components is found, by their weights less the cost
of each step (Viterbi 1967), then the places on it are smoothed both ways (Kalman filter; Rauch, Tung and Striebel
1965). Force and depth may change within a frame, so they are not smoothed: they are the frame's own estimates, given
its place. What changes slowly is the force over the size of the signals (at one place, under one object, force is
proportional to it), and that is smoothed in the force's stead. `Follower` runs the filters alone, frame by frame, on
live signals.

A path may jump without contact, where frames are missing, and, at a cost, anywhere.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .network_sizes import PLACE, STATE
from .networks import COMPRESSED_LIMIT
from .posterior import LEAST_FORCE, Posterior, touches

# Standard deviation of what a state changes by in 10 ms. Places are in tens of cells of the gel, 0.4 mm each: 0.18 mm;
# asinh of force and depth 0.6, which a tap that is over in 50 ms still reaches (chosen on the shipped recording with
# gains off).
STEP = np.array([0.045, 0.045, 0.6, 0.6])
# Of rectified signals, whose places err by more and together: their steps of place are that much shorter (chosen on
# sample 7 of the slides with the weights before these: rank of force .905 to .926, spread of place along the finger
# .71 to .51 mm).
RECTIFIED_STEP = 0.3
# Standard deviations of the logarithm of force over the signals' size: of its change in 10 ms, and of a frame's
# estimate (chosen on scenes/training/test_sequences.npz with the weights before these: force 8.6 % to 7.8 %; from .05
# to .15, and .2 for the second, within .1). Within a simulated press force goes with size to the power .98 (50,000
# pairs), so that no lag comes of it. A first ratio is left as free as a place that may be anywhere.
RATIO_STEP, RATIO_NOISE = 0.05, 0.1
LEAST_SIZE = 0.1  # counts, below any reading's noise: a logarithm's floor
FRAME = 0.01  # s
GAP = 0.1  # s without a frame: nothing is known of what happened meanwhile (assumed)
ANYWHERE = 3.0  # tens of cells: the standard deviation of a place that may be anywhere on the gel
JUMP = 8.0  # price of a jump in mid-contact: that of a step of four standard deviations (assumed)
BLOCK, MARGIN = 256, 64  # frames smoothed at once, and how many more are read on either side (a course forgets sooner)


@dataclass(frozen=True)
class Evidence(Posterior):
    """Posterior of each frame alone, and what its signals show beside it.

    size : (T,) counts, root mean square of the changes; rectified : (T,) bool
    """

    size: np.ndarray
    rectified: np.ndarray


Read = Callable[[int, int], tuple[np.ndarray, Evidence]]


class _Course(NamedTuple):
    """Places on the best path.

    mean, variance : (T, PLACE); touched : (T,), true in contact; free : (T,), true where the path starts again
    """

    mean: np.ndarray
    variance: np.ndarray
    touched: np.ndarray
    free: np.ndarray


def track(evidence: Evidence, time: np.ndarray) -> np.ndarray:
    """Estimate the contact's state (T, STATE) float32 at times (T,) s from posteriors, smoothed both ways."""
    if len(time) == 0:
        return np.zeros(evidence.mean.shape[::2], np.float32)
    steps = _steps(time, evidence.rectified)
    course = _best_course(evidence, steps)
    walk = np.where(course.free[:, None], ANYWHERE**2, steps[:, :PLACE])
    place = _smoothed(course.mean, course.variance, walk)
    state = np.concatenate([place, evidence.near(place, course.touched)[:, PLACE:]], axis=-1)
    state[course.touched, PLACE] = _even_force(state[:, PLACE], evidence.size, course, time)[course.touched]
    return state.astype(np.float32)


def _even_force(force: np.ndarray, size: np.ndarray, course: _Course, time: np.ndarray) -> np.ndarray:
    """Smooth force over size: (T,) asinh scale, of forces (T,) on it and signals' sizes (T,) counts."""
    ratio, touched = _log_ratio(force, size), course.touched
    apart = course.free | ~touched | ~np.concatenate([[False], touched[:-1]])
    step = np.where(apart, ANYWHERE**2, np.minimum(RATIO_STEP**2 * _elapsed(time) / FRAME, ANYWHERE**2))
    noise = np.full((len(ratio), 1), RATIO_NOISE**2)
    return _force_of(_smoothed(ratio[:, None], noise, step[:, None])[:, 0], size)


def _log_ratio(force: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Logarithm of forces, given on their asinh scale, over signals' sizes, counts."""
    return np.log(np.sinh(np.clip(force, LEAST_FORCE, COMPRESSED_LIMIT)) / np.maximum(size, LEAST_SIZE))


def _force_of(log_ratio: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Forces on their asinh scale: the inverse of `_log_ratio`."""
    return np.arcsinh(np.exp(log_ratio) * np.maximum(size, LEAST_SIZE))


def needed(frames: np.ndarray, count: int) -> np.ndarray:
    """Return the frames (n,), out of `count`, whose posteriors decide the states of rising frames (T,)."""
    blocks = np.unique(frames // BLOCK)
    return np.unique(np.concatenate([np.arange(*_span(int(block), count)) for block in blocks]))


def _span(block: int, count: int) -> tuple[int, int]:
    """Return the first frame, and the one past the last, that a block and its margins hold."""
    return max(block * BLOCK - MARGIN, 0), min((block + 1) * BLOCK + MARGIN, count)


class Tracked:
    """States of the contact in a whole recording, computed on demand."""

    def __init__(self, read: Read, count: int) -> None:
        """Take read(start, stop), which gives times and posterior of these frames; count : frames in all."""
        self._read, self._count = read, count
        self._kept: tuple[int, np.ndarray] | None = None

    def __call__(self, frames: np.ndarray) -> np.ndarray:
        """States (n, STATE) of rising frames (n,); a frame's state does not depend on which others are asked for."""
        blocks = frames // BLOCK
        parts = [self._block(int(block))[frames[blocks == block] - block * BLOCK] for block in np.unique(blocks)]
        return np.concatenate(parts)

    def _block(self, block: int) -> np.ndarray:
        if self._kept is None or self._kept[0] != block:
            start, stop = _span(block, self._count)
            time, posterior = self._read(start, stop)
            self._kept = block, track(posterior, time)[block * BLOCK - start :][:BLOCK]
        return self._kept[1]


class Follower:
    """Forward filters alone: one frame after another, without later ones."""

    def __init__(self) -> None:
        self._score: np.ndarray | None = None
        self._place, self._place_variance = np.zeros(PLACE), np.full(PLACE, ANYWHERE**2)
        self._ratio: tuple[np.ndarray, np.ndarray] | None = None  # of the frame before, with its variance; in contact
        self._frame: _Frame
        self._time: float

    def __call__(self, evidence: Evidence, time: float) -> np.ndarray:
        """Estimate the state (1, STATE) float32 of a contact from the posterior of one frame at `time` s."""
        now = _Frame(*(each[0] for each in _components(evidence)))
        score, before, ratio_before = now.weight, np.full(PLACE, ANYWHERE**2), None
        if self._score is not None and 0 <= time - self._time < GAP:
            step = _step(time - self._time, evidence.rectified[0])
            moves, free = _moves(self._frame, now, step)
            total = self._score[:, None] + moves
            score = total.max(axis=0) + now.weight
            if not free[total[:, score.argmax()].argmax(), score.argmax()]:
                before = self._place_variance + step[:PLACE]
                if self._ratio is not None:
                    ratio_before = self._ratio[0], self._ratio[1] + RATIO_STEP**2 * (time - self._time) / FRAME
        best = int(score.argmax())
        place = now.mean[best, :PLACE], np.square(now.spread[best, :PLACE])
        self._place, self._place_variance = _updated(self._place, before, *place)
        self._score, self._frame, self._time = score - score.max(), now, time
        touched = touches(now.mean[best])
        state = np.concatenate([self._place[None], evidence.near(self._place[None], touched[None])[:, PLACE:]], axis=-1)
        self._ratio = None
        if touched:
            ratio = _log_ratio(state[:, PLACE], evidence.size), np.full(1, RATIO_NOISE**2)
            if ratio_before is not None:
                ratio = _updated(*ratio_before, *ratio)
            self._ratio = ratio
            state[:, PLACE] = _force_of(ratio[0], evidence.size)
        return state.astype(np.float32)


class _Frame(NamedTuple):
    """Components of frames: weight (..., C), a logarithm; mean, spread (..., C, STATE)."""

    weight: np.ndarray
    mean: np.ndarray
    spread: np.ndarray


def _components(posterior: Posterior) -> _Frame:
    weight = np.log(np.maximum(posterior.weight, np.finfo(np.float32).tiny))
    return _Frame(*(np.asarray(each, np.float64) for each in (weight, posterior.mean, posterior.spread)))


def _step(seconds: np.ndarray | float, rectified: np.ndarray | bool) -> np.ndarray:
    """Variance (..., STATE) of the change of a state in that time (...,)."""
    shorter = np.where(np.asarray(rectified)[..., None] & (np.arange(STATE) < PLACE), RECTIFIED_STEP, 1.0)
    return np.square(shorter * STEP) * np.asarray(seconds)[..., None] / FRAME


def _elapsed(time: np.ndarray) -> np.ndarray:
    """Seconds (T,) since the frame before; infinite at the first frame, after gaps and where a clock runs backwards."""
    seconds = np.diff(time, prepend=-np.inf)
    return np.where((seconds >= 0) & (seconds < GAP), seconds, np.inf)


def _steps(time: np.ndarray, rectified: np.ndarray) -> np.ndarray:
    """Variance (T, STATE) of the change since the frame before; free at the first frame and after gaps."""
    return np.minimum(_step(_elapsed(time), rectified), ANYWHERE**2)


def _moves(before: _Frame, now: _Frame, step: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Negative cost (..., C, C) of each component's step to each of the next frame, and true where it is free.

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


def _best_course(evidence: Evidence, steps: np.ndarray) -> _Course:
    """Find the best path through the components of each frame; steps (T, STATE) as of `_steps`."""
    all_frames = _components(evidence)
    before, now = (_Frame(*(each[part] for each in all_frames)) for part in (slice(None, -1), slice(1, None)))
    moves, free = _moves(before, now, steps[1:])
    score, came = all_frames.weight[0], np.zeros(evidence.weight.shape, int)
    for frame in range(1, len(steps)):
        total = score[:, None] + moves[frame - 1]
        came[frame] = total.argmax(axis=0)
        score = total.max(axis=0) + all_frames.weight[frame]
    path = np.empty(len(steps), int)
    path[-1] = score.argmax()
    for frame in range(len(steps) - 1, 0, -1):
        path[frame - 1] = came[frame, path[frame]]
    each = np.arange(len(steps))
    begins = np.concatenate([[True], free[each[:-1], path[:-1], path[1:]]])
    mean, spread = (values[each, path, :PLACE] for values in all_frames[1:])
    return _Course(mean, np.square(spread), touches(all_frames.mean[each, path]), begins)


def _updated(
    mean: np.ndarray, variance: np.ndarray, value: np.ndarray, noise: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Mean and variance of a state, known as given, once it is measured with a variance `noise` (Kalman 1960)."""
    gain = variance / (variance + noise)
    return mean + gain * (value - mean), (1 - gain) * variance


def _smoothed(value: np.ndarray, noise: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Means (T, k) of a random walk of variances `steps` (T, k), given all its measurements and their variances."""
    mean, variance, expected = (np.empty_like(value) for _ in range(3))
    now, spread = value[0], np.zeros(value.shape[1])
    for frame, step in enumerate(steps):
        expected[frame] = spread + step
        now, spread = _updated(now, expected[frame], value[frame], noise[frame])
        mean[frame], variance[frame] = now, spread
    for frame in range(len(steps) - 2, -1, -1):
        back = variance[frame] / expected[frame + 1]
        mean[frame] += back * (mean[frame + 1] - mean[frame])
    return mean
