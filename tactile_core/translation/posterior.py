"""The state of a contact, and its posterior given the signals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .card import PLACE

FORCE_SCALE = 0.1  # N: the force is 0.1 N sinh(head), which spans light touches and firm presses alike (assumed)
DEPTH_SCALE = 20e-6  # m, likewise, of the depth in a contact's state (assumed)
# Of a contact's state, below which nothing touches: half the force of the lightest contact that training knows, 0.06 N.
LEAST_TOUCH = float(np.arcsinh(0.03 / FORCE_SCALE))
MEAN_SHIFTS = 3  # the last moves the places of 90 of 100 test contacts by less than 0.02 mm
SEED = 0  # of contacts that are drawn: the same recording, the same contacts


@dataclass(frozen=True)
class Posterior:
    """Posterior of a contact's state given the signals: a mixture of C Gaussians in each of T frames.

    A state (STATE,) is the place of the gel's dent (row and column from the middle, in tens of cells), asinh(force /
    0.1 N) and asinh(depth / 20 um); all zero without contact. The place is that on the gel, which is flat: at the
    BioTac's tip, where most real contacts lie, the skin's lattice has a pole, and a place on it says little.
    weight : (T, C), sum 1 over C; mean, spread : (T, C, STATE), spread being the standard deviation"""

    weight: np.ndarray
    mean: np.ndarray
    spread: np.ndarray

    @property
    def likely(self) -> np.ndarray:
        """State (T, STATE) float32 of the most plausible contact, not the average of all.

        It is found by mean shift (Cheng 1995) from the place of the heaviest component, over the components near it:
        several often describe one contact, and together they are more certain than each alone."""
        state = self.mean[np.arange(len(self.mean)), self.weight.argmax(-1)]
        touched = touches(state)
        for _ in range(MEAN_SHIFTS):
            state = self.near(state[:, :PLACE], touched)
        return state.astype(np.float32)

    def near(self, place: np.ndarray, touched: np.ndarray) -> np.ndarray:
        """Return the mean state (T, STATE) of the components, weighted by their density at place p (T, PLACE): weight
        exp(-|(p - mean) / spread|^2 / 2) / product of the spreads.
        touched : (T,) bool, true averages the components in contact, false those without contact. (Both may lie at one
            place, because components without contact have place zero.)"""
        spread = self.spread[..., :PLACE].astype(np.float64)
        far = (place[:, None] - self.mean[..., :PLACE]) / spread
        share = np.log(np.maximum(self.weight, np.finfo(np.float32).tiny)) - np.log(spread).sum(-1)
        share = share - 0.5 * np.square(far).sum(-1)
        share = np.where(touches(self.mean) == touched[:, None], share, -np.inf)
        share = np.exp(share - share.max(-1, keepdims=True))
        return (share[..., None] * self.mean).sum(1) / share.sum(-1)[:, None]

    @property
    def average(self) -> np.ndarray:
        """Mean (T, STATE) over all components: the least-squares estimate where there is one component."""
        return (self.weight[..., None] * self.mean).sum(1)

    def drawn(self, frames: np.ndarray, count: int) -> np.ndarray:
        """Draw ``count`` states of each frame, (T, count, STATE). frames : (T,) int, numbers in the recording, as
        seeds"""
        found = np.empty((len(frames), count, self.mean.shape[-1]), np.float32)
        for row, frame in enumerate(frames):
            random = np.random.default_rng([SEED, int(frame)])
            share = self.weight[row].astype(np.float64)
            which = random.choice(len(share), count, p=share / share.sum())
            noise = random.standard_normal(found.shape[1:], dtype=np.float32)
            found[row] = self.mean[row, which] + self.spread[row, which] * noise
        return found


def touches(state: np.ndarray) -> np.ndarray:
    """Mark (...,) bool the contacts in state (..., STATE): force at least half that of the lightest in training."""
    return state[..., PLACE] >= LEAST_TOUCH
