"""Track a contact through time: the most plausible path given the posteriors of all frames.

A finger's contact moves little in 10 ms, so a frame whose signals allow two places is decided by its neighbours. Each
frame's posterior is a mixture. The best path through its components maximises their weights less the cost of each step
(Viterbi 1967). The places on that path are then smoothed both ways (Kalman filter; Rauch, Tung and Striebel 1965).
Force and depth may change within a frame, so each frame keeps its own estimate of them, given its place; only the ratio
of force to signal size, which changes slowly (at one place, under one object, they are proportional), is smoothed.
`Tracker` runs the filter both ways through a recording, `ForwardTracker` forward only, frame by frame, on live signals.
A path may jump without contact, where frames are missing and, at a cost, anywhere."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .card import PLACE, STATE
from .layers import COMPRESSED_LIMIT
from .posterior import LEAST_TOUCH, Posterior, touches

# Standard deviation of a state's change in 10 ms: of place, in tens of the gel's cells of 0.4 mm, 0.18 mm; of asinh of
# force and depth 0.6, which allows a tap of 50 ms (chosen on the shipped recording with gains off).
STEP = np.array([0.045, 0.045, 0.6, 0.6])
# Factor on the steps of place of rectified signals, whose errors are larger and correlated (chosen on sample 7 of the
# slides with the weights before these: rank of force .905 to .926, spread of place along the finger .71 to .51 mm).
RECTIFIED_STEP = 0.3
# Standard deviations of log(force / signal size): of its change in 10 ms, and of a frame's estimate (chosen on
# scenes/training/test_sequences.npz with the weights before these: force 8.6 % to 7.8 %; from .05 to .15, and .2 for
# the second, within .1). Smoothing it causes no lag: within a simulated press force grows as size^.98 (50,000 pairs).
# The first ratio is as free as a place that may be anywhere.
RATIO_STEP, RATIO_NOISE = 0.05, 0.1
LEAST_SIZE = 0.1  # counts, below any reading's noise: a logarithm's floor
FRAME = 0.01  # s
GAP = 0.1  # s without a frame, after which the path starts anew (assumed)
ANYWHERE = 3.0  # tens of cells: the standard deviation of a place that may be anywhere on the gel
JUMP = 8.0  # cost of a jump in mid-contact, that of a step of four standard deviations (assumed)
BLOCK, MARGIN = 256, 64  # frames smoothed at once, and read in addition on either side: farther ones have no effect


@dataclass(frozen=True)
class Evidence(Posterior):
    """Posterior of each frame by its own signals, and what else they show. In T frames of e electrodes:

    size : (T,) counts, root mean square of the changes; rectified : (T,) bool, frames recorded without signs
    latent : (T, K) of the signals; unsigned : (T,) bool, rectified frames whose signs were not recovered
    second : (T, e) counts, changes by the weaker of two contacts, NaN if there is one; (T, 0) if none is looked for.
        All other fields then describe the stronger contact"""

    size: np.ndarray
    rectified: np.ndarray
    latent: np.ndarray
    unsigned: np.ndarray
    second: np.ndarray

    def at(self, frames: slice | np.ndarray) -> Evidence:
        """Return the evidence of frames (n,) alone."""
        return Evidence(**{name: values[frames] for name, values in vars(self).items()})

    @classmethod
    def joined(cls, parts: Sequence[Evidence]) -> Evidence:
        """Join the parts, evidence of successive frames, to one."""
        return cls(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in vars(parts[0])})


Read = Callable[[int, int], tuple[np.ndarray, Evidence]]


def track(evidence: Evidence, time: np.ndarray) -> np.ndarray:
    """Estimate the states (T, STATE) float32 of `Posterior` from all frames' evidence together: place smoothed forward
    and back, force by its smoothed ratio to the signals' size, depth from each frame alone. time : (T,) s"""
    if len(time) == 0:
        return np.zeros(evidence.mean.shape[::2], np.float32)
    elapsed = _elapsed(time)
    steps = np.minimum(_step(elapsed, evidence.rectified), ANYWHERE**2)
    place, variance, touched, free = _best_course(_components(evidence), steps)
    walk = np.where(free[:, None], ANYWHERE**2, steps[:, :PLACE])
    state = _states(evidence, _smoothed(place, variance, walk), touched)
    ratio = _log_ratio(state[:, PLACE], evidence.size)
    apart = free | ~touched | ~np.concatenate([[False], touched[:-1]])
    walk = np.where(apart, ANYWHERE**2, np.minimum(_ratio_step(elapsed), ANYWHERE**2))
    even = _smoothed(ratio[:, None], np.full((len(ratio), 1), RATIO_NOISE**2), walk[:, None])[:, 0]
    state[touched, PLACE] = _force_of(even, evidence.size)[touched]
    return state.astype(np.float32)


def needed(frames: np.ndarray, count: int) -> np.ndarray:
    """Return the frames (n,), of `count` in all, on whose evidence the states of rising ``frames`` (T,) depend."""
    blocks = np.unique(frames // BLOCK)
    return np.unique(np.concatenate([np.arange(*_span(int(block), count)) for block in blocks]))


def _span(block: int, count: int) -> tuple[int, int]:
    """Return the first frame of a block (its number) with margins, and the one past its last; count : frames in all"""
    return max(block * BLOCK - MARGIN, 0), min((block + 1) * BLOCK + MARGIN, count)


class Tracker:
    """Computes evidence and tracked states of frames of a whole recording by ``track``: on demand, block by block."""

    def __init__(self, read: Read, count: int) -> None:
        """Take read(start, stop), which returns times and evidence of these frames; count : frames in all."""
        self._read, self._count = read, count
        self._kept: tuple[int, Evidence, np.ndarray] | None = None

    def __call__(self, frames: np.ndarray) -> tuple[Evidence, np.ndarray]:
        """Return evidence and states (n, STATE) of rising frames (n,); they do not depend on which others are asked
        for."""
        blocks, parts, states = frames // BLOCK, [], []
        for block in np.unique(blocks):
            evidence, state = self._block(int(block))
            rows = frames[blocks == block] - block * BLOCK
            parts.append(evidence.at(rows))
            states.append(state[rows])
        return Evidence.joined(parts), np.concatenate(states)

    def _block(self, block: int) -> tuple[Evidence, np.ndarray]:
        if self._kept is None or self._kept[0] != block:
            start, stop = _span(block, self._count)
            time, evidence = self._read(start, stop)
            rows = slice(block * BLOCK - start, (block + 1) * BLOCK - start)
            self._kept = block, evidence.at(rows), track(evidence, time)[rows]
        return self._kept[1:]


class ForwardTracker:
    """Tracks a contact in a growing recording by ``track`` from past frames alone. Call it once per frame, in order."""

    def __init__(self) -> None:
        self._time, self._score, self._frame = -np.inf, np.zeros(0), _Frame(*(np.zeros(0),) * 3)  # of the frame before
        self._place, self._variance = np.zeros(PLACE), np.zeros(PLACE)
        self._ratio: tuple[np.ndarray, np.ndarray] | None = None  # its mean and variance; None without contact

    def __call__(self, evidence: Evidence, time: float) -> np.ndarray:
        """Return the contact's state (1, STATE) float32 in the next frame, from its evidence; time : s, of the frame"""
        now, elapsed = _components(evidence), _elapsed(np.array([time]), self._time)
        best, free, score = now.weight[0].argmax(), True, now.weight[0]
        step = _step(elapsed, evidence.rectified)
        if np.isfinite(elapsed[0]):
            moves, begins = _moves(self._frame, now, step)
            score, came = _scored(self._score, moves, now.weight)
            best = score.argmax()
            free = begins[0, came[0, best], best]
        place, noise = now.mean[:, best, :PLACE], np.square(now.spread[:, best, :PLACE])
        walk = np.where(free, ANYWHERE**2, step[:, :PLACE])
        variance = np.where(free, 0, self._variance)
        (self._place,), (self._variance,), _ = _filtered(place, noise, walk, self._place, variance)
        touched = touches(now.mean[:, best])
        state = _states(evidence, self._place[None], touched)
        if touched[0]:
            ratio, noise = _log_ratio(state[:, PLACE], evidence.size), np.full(1, RATIO_NOISE**2)
            if not free and self._ratio is not None:
                (ratio,), (noise,), _ = _filtered(ratio[None], noise[None], _ratio_step(elapsed)[None], *self._ratio)
            self._ratio = ratio, noise
            state[:, PLACE] = _force_of(ratio, evidence.size)
        else:
            self._ratio = None
        self._time, self._score, self._frame = time, score - score.max(), now
        return state.astype(np.float32)


def _states(evidence: Evidence, place: np.ndarray, touched: np.ndarray) -> np.ndarray:
    """Return states (T, STATE) of contacts at place (T, PLACE), with each frame's own force and depth at that place.
    touched : (T,) bool, in contact"""
    return np.concatenate([place, evidence.near(place, touched)[:, PLACE:]], axis=-1)


def _log_ratio(force: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Return log(force / signal size) (T,); force : (T,) as in a state, asinh(force / 0.1 N); size : (T,) counts"""
    return np.log(np.sinh(np.clip(force, LEAST_TOUCH, COMPRESSED_LIMIT)) / np.maximum(size, LEAST_SIZE))


def _force_of(log_ratio: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Return forces (T,) as in a state from log_ratio (T,) and size (T,) counts: the inverse of `_log_ratio`."""
    return np.arcsinh(np.exp(log_ratio) * np.maximum(size, LEAST_SIZE))


class _Frame(NamedTuple):
    """Components of frames' posteriors: weight (..., C), as a logarithm; mean, spread (..., C, STATE)."""

    weight: np.ndarray
    mean: np.ndarray
    spread: np.ndarray


def _components(posterior: Posterior) -> _Frame:
    weight = np.log(np.maximum(posterior.weight, np.finfo(np.float32).tiny))
    return _Frame(*(np.asarray(each, np.float64) for each in (weight, posterior.mean, posterior.spread)))


def _step(seconds: np.ndarray | float, rectified: np.ndarray | bool) -> np.ndarray:
    """Return the variance (..., STATE) of a state's change within seconds (...,).
    rectified : (...,) bool, frames whose signals have lost their signs; their place moves by less"""
    shorter = np.where(np.asarray(rectified)[..., None] & (np.arange(STATE) < PLACE), RECTIFIED_STEP, 1.0)
    return np.square(shorter * STEP) * np.asarray(seconds)[..., None] / FRAME


def _ratio_step(seconds: np.ndarray) -> np.ndarray:
    """Return the variance (T,) by which `_log_ratio`, of force to signal size, may change in seconds (T,)."""
    return RATIO_STEP**2 * seconds / FRAME


def _elapsed(time: np.ndarray, before: float = -np.inf) -> np.ndarray:
    """Return the seconds (T,) since the previous frame; infinite after gaps, where the clock runs backwards and, unless
    a frame at `before` s precedes it, at the first frame. time : (T,) s"""
    seconds = np.diff(time, prepend=before)
    return np.where((seconds >= 0) & (seconds < GAP), seconds, np.inf)


def _moves(before: _Frame, now: _Frame, step: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the log probability (..., C, C) of the step from each component to each of the next frame, and a mask,
    true if the step is free: without contact, or as a jump.
    before, now : components of frames and of those that follow them; step : (..., STATE), variances of `_step`

    It is minus half the squared distance in standard deviations, without a density's normalisation: errors of
    neighbouring frames are correlated (gains, rest), so two frames that agree prove less than independent ones would.
    (With it, the 90 % quantile of place is 6.1 cells instead of 3.3, on the recording that the steps were chosen
    by.)"""
    far = now.mean[..., None, :, :] - before.mean[..., :, None, :]
    known = np.square(now.spread[..., None, :, :]) + np.square(before.spread[..., :, None, :])
    lightest = np.minimum(now.mean[..., None, :, PLACE], before.mean[..., :, None, PLACE])
    untouched = lightest < LEAST_TOUCH
    off = np.square(far) / (known + step[..., None, None, :])
    off[..., :PLACE] *= ~untouched[..., None]
    price = 0.5 * off.sum(axis=-1)
    return -np.minimum(price, JUMP), untouched | (price > JUMP)


def _scored(score: np.ndarray, moves: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Continue the best paths (Viterbi) through T further frames; return the paths' scores (C,) at the last, and the
    best predecessor (T, C) of each component in each frame.
    score : (C,) of the paths so far; moves : (T, C, C) log probability of each step; weight : (T, C) log weights"""
    came = np.empty(weight.shape, int)
    for frame, move in enumerate(moves):
        total = score[:, None] + move
        came[frame] = total.argmax(axis=0)
        score = total.max(axis=0) + weight[frame]
    return score, came


def _best_course(frames: _Frame, steps: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the best path through the components of frames: mean and variance (T, PLACE) of the places on it, a mask
    (T,) of contact, and one of where it starts anew. steps : (T, STATE), variances of `_step` before each frame"""
    before, now = (_Frame(*(each[part] for each in frames)) for part in (slice(None, -1), slice(1, None)))
    moves, free = _moves(before, now, steps[1:])
    score, came = _scored(frames.weight[0], moves, now.weight)
    path = np.empty(len(steps), int)
    path[-1] = score.argmax()
    for frame in range(len(steps) - 1, 0, -1):
        path[frame - 1] = came[frame - 1, path[frame]]
    each = np.arange(len(steps))
    begins = np.concatenate([[True], free[each[:-1], path[:-1], path[1:]]])
    mean, spread = (values[each, path, :PLACE] for values in frames[1:])
    return mean, np.square(spread), touches(frames.mean[each, path]), begins


def _filtered(
    value: np.ndarray, noise: np.ndarray, steps: np.ndarray, mean: np.ndarray, variance: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Filter a random walk forward (Kalman 1960); return (T, k) means, variances, and variances before each
    measurement.
    value, noise, steps : (T, k) measurements, their variances, and the variance of the step before each
    mean, variance : (k,) of the walk before the first"""
    means, variances, expected = (np.empty_like(value) for _ in range(3))
    for frame, step in enumerate(steps):
        expected[frame] = variance + step
        gain = expected[frame] / (expected[frame] + noise[frame])
        mean = mean + gain * (value[frame] - mean)
        variance = (1 - gain) * expected[frame]
        means[frame], variances[frame] = mean, variance
    return means, variances, expected


def _smoothed(value: np.ndarray, noise: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Return the means (T, k) of a random walk given all measurements (Rauch, Tung and Striebel 1965).
    value, noise, steps : (T, k) measurements, their variances, and the variance of the step before each"""
    mean, variance, expected = _filtered(value, noise, steps, value[0], np.zeros(value.shape[1]))
    for frame in range(len(steps) - 2, -1, -1):
        back = variance[frame] / expected[frame + 1]
        mean[frame] += back * (mean[frame + 1] - mean[frame])
    return mean
