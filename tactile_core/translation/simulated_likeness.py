"""Compare signals with those of simulated contacts, to find two contacts at once and changes that no contact makes.

The networks know single contacts; they translate two contacts to one between them or to one of the two. Electrodes
respond to two contacts far apart about as to the sum of both, so each signal is fitted by one simulated contact and by
two, of any strengths. Two always fit better; a frame counts as two where two leave little and one leaves much. Both fit
badly for signals of a unit unlike the simulated one, which are not marked. A second contact near the first, or much
lighter, looks like one.

A signal unlike every simulated contact comes from a wrong rest, polarity or order of channels. One that is more like a
change of the fluid's conductivity, which moves all electrodes alike, comes from drift. Rectified signals are not
judged: without signs, two contacts look like one (5 % of pairs were found).

Lost signs are recovered where rectified changes match one simulated contact closely, because the pattern of sizes
determines which electrodes rise and which fall: on test contacts of a unit with gains 10 % off, the nearest simulated
signal has the right sign in 89 of 100 electrodes, with 98 % of the changes' sum. S2MPN then finds the place better than
R2MPN, which must allow for any signs. Real slides match no simulated contact as closely: signs would change from frame
to frame, and nearly all frames stay as they are."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from ..recordings.polarity import contact_signals
from ..recordings.unit.film import PRESSED
from ..sensors import SOURCE, divider, places_of
from ..sensors.readout import NOISE
from .layers import compress

# Shares of the signal's length: what two contacts leave at most, and how much more one leaves. Chosen on 4,000 contacts
# of training pairs and sums of two: 1 % of the contacts are marked, and a third of the sums.
LEFT_BY_TWO, MORE_BY_ONE = 0.25, 0.17
# Least share of a signal's length that the most similar simulated contact leaves, to be unlike all. Of test contacts
# with noise and gains 10 % apart, one in a thousand leaves more than .53; of real grips of hard objects, those whose
# rest is known leave .22 to .43, those whose rest was taken under load .73 and more. Chosen with both in sight.
UNLIKE = 0.6
# Cosine of two patterns, above which they are the same contact, a little moved or pressed (assumed).
ALIKE = 0.6
# Largest share of a signal, on the networks' scale, that the nearest simulated one may leave for signs to be recovered.
# Chosen on sample 7 of the slides (2 frames in 1,000 are within): at .25 the rank of force stays .908 (quartile .879);
# with a fifth of the posterior left to R2MPN the quartile falls to .86 at .28, to .81 at .33. Half of the test contacts
# are within, two in three of those from 0.3 mm.
LEFT = 0.25
# Length, counts, below which a change is noise: 19 electrodes with 1.5 counts each have 6.5 (assumed).
FAINT = 8.0
# Most of the estimated pressure over the fluid's own, and of that over it: .24 to 1.7 on real grips and slides.
# FELT : Pa, some 4 counts of PDC, its noise (assumed).
MOST_OVER, MOST_BELOW, FELT = 2.0, 5.0, 150.0
DRIFT = 1.1  # of the films' impedance, by which its pattern is drawn (assumed; it hardly depends on it)
FIRST = 64  # patterns most like the signal, of which one must be among the two: an eighth of the work


@dataclass(frozen=True)
class Patterns:
    """Signals of P simulated contacts on e electrodes, to compare others with.
    signals : (P, e) float64 counts; units : (P, e), signals scaled to length one; alike : (P, P), cosines between them
    drift : (e,), of length one, the change when the fluid's conductivity changes"""

    signals: np.ndarray
    units: np.ndarray
    alike: np.ndarray
    drift: np.ndarray


def patterns_of(signals: np.ndarray, rest: np.ndarray) -> Patterns:
    """Return the `Patterns` of simulated contacts, from their signals (P, e) and the unit's rest (e,), counts."""
    units = signals / np.linalg.norm(signals, axis=1, keepdims=True)
    drift = divider.of_films(DRIFT, rest) - rest
    return Patterns(signals, units, units @ units.T, drift / np.linalg.norm(drift))


@functools.cache
def shipped_patterns(sensor: str = SOURCE) -> Patterns:
    """Return the `Patterns` of the simulated contacts that ship with a sensor's descriptor."""
    return patterns_of(contact_signals(sensor), places_of(sensor).rest_counts)


def residual_shares(change: np.ndarray, rectified: np.ndarray, patterns: Patterns | None = None) -> np.ndarray:
    """Return shares (T, 3) of each change's length: unexplained by the best pattern, by the best two, and by drift.
    change : (T, 19) counts, in a typical unit; patterns : the sensor's, None for a BioTac's
    rectified : (T,) bool; these frames and those that change no more than noise are not judged: NaN"""
    patterns = patterns or shipped_patterns()
    found = np.full((len(change), 3), np.nan)
    length = np.sqrt(np.square(change, dtype=np.float64).sum(axis=1))
    rows = np.flatnonzero((length >= FAINT) & ~rectified)
    signals = change[rows] / length[rows, None]
    by_drift = np.sqrt(np.maximum(1 - np.square(signals @ patterns.drift), 0))
    found[rows] = np.stack([*residual_lengths(signals, patterns), by_drift], axis=1)
    return found


def two_contacts(shares: np.ndarray) -> np.ndarray:
    """Mark (T,) bool the frames that two contacts explain and one does not; shares : (T, 3), of `residual_shares`"""
    one, two, _ = shares.T
    return (two < LEFT_BY_TWO) & (one - two > MORE_BY_ONE)


def unlike(shares: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Mark (T,) bool frames like no simulated contact, or more like drift; shares : (T, 3), of `residual_shares`
    change : (T, 19) counts; in faint changes a larger share is allowed, for noise"""
    one, _, by_drift = shares.T
    square = np.maximum(np.square(change, dtype=np.float64).sum(axis=1), FAINT**2)
    return one > np.minimum(np.sqrt(UNLIKE**2 + change.shape[1] * NOISE**2 / square), by_drift)


def contradicted(pressure: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """Mark (T,) bool frames whose estimated pressure (T,) Pa is far from that measured (T,) Pa (NaN: not measured)."""
    measured = np.maximum(measured, 0)
    return (pressure > MOST_OVER * measured + FELT) | (measured > MOST_BELOW * pressure + PRESSED)


def residual_lengths(signals: np.ndarray, patterns: Patterns) -> tuple[np.ndarray, np.ndarray]:
    """Return lengths (T,) of what the best pattern leaves of each of signals (T, 19), of length 1, and of what the best
    two leave. Two are fitted only if one leaves more than ``MORE_BY_ONE``; else both lengths are equal."""
    alike, near = patterns.alike, signals @ patterns.units.T
    one = np.sqrt(np.maximum(1 - np.square(near.max(axis=1, initial=0)), 0))
    two = one.copy()
    for row in np.flatnonzero(one > MORE_BY_ONE):
        likeness = near[row]
        first = np.argpartition(-likeness, FIRST)[:FIRST]
        a, b, cosine = likeness[first, None], likeness, alike[first]
        # The squared length of the projection onto both, where it takes some of each.
        some = (cosine < ALIKE) & (a > cosine * b) & (b > cosine * a)
        onto = (a * a + b * b - 2 * cosine * a * b) / (1 - np.square(np.clip(cosine, -1, ALIKE)))
        two[row] = min(np.sqrt(max(1 - onto.max(where=some, initial=0), 0)), one[row])
    return one, two


def recovered(
    change: np.ndarray, rectified: np.ndarray, patterns: Patterns | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Give change (T, 19) counts its signs back if they are certain; also return the mask (T,) of frames left
    rectified.
    rectified : (T,) bool, frames that have lost their signs; patterns : the sensor's, None for a BioTac's"""
    change, rectified = np.array(change, np.float32), np.array(rectified, bool)
    rows = np.flatnonzero(rectified)
    if not len(rows):
        return change, rectified
    known = (patterns or shipped_patterns()).signals
    signs = np.where(known > 0, np.float32(1), np.float32(-1))
    sizes, known = compress(np.abs(change[rows])), compress(np.abs(known))
    # |a - b|^2 of all pairs; a signal of zeros resembles none
    apart = np.square(sizes).sum(1)[:, None] - 2 * sizes @ known.T + np.square(known).sum(1)
    nearest, size = apart.argmin(1), np.square(sizes).sum(1)
    plain = apart.min(1) < LEFT**2 * size
    change[rows[plain]] = np.abs(change[rows[plain]]) * signs[nearest[plain]]
    rectified[rows[plain]] = False
    return change, rectified
