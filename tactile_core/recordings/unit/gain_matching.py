"""Fit gains and offsets of an unknown unit by matching its signals to the simulated signals most like them.

In turns, each frame is assigned its nearest simulated signal, and each electrode the gain that fits its readings to
these, until nothing changes (as in k-means and iterated closest points). Whole frames are matched, so a recording may
hold any mixture of contacts; matching each electrode's distribution would take a finger touched in one place for wrong
gains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..polarity import SCALE

ROUNDS = 30  # most turns; 10 to 20 are usual
SETTLED = 0.01  # largest change of a log gain in a turn that counts as none
FLOOR = 2.0  # counts added before a ratio is taken: noise of 0.7 to 1.5 (docs/sources.md, BioTac read-out) says no more
SURE = 10.0  # counts: from there on a reading says more of the gain than of noise and of the match (measured)
# Contacts' worth of belief in gain 1 and offset 0 (measured: helps from 10 % scatter on, costs little at 50).
PRIOR = 5.0


@dataclass(frozen=True, eq=False)
class Match:
    """Fitted gains and offsets.
    log_gain : (19,) natural logarithm of the gain; offset : (19,) counts; contacts : (19,) number behind each gain
    matched : number of different simulated signals that were matched; settled : true if the last turn changed none"""

    log_gain: np.ndarray
    offset: np.ndarray
    contacts: np.ndarray
    matched: int
    settled: bool


def match(change: np.ndarray, typical: np.ndarray, rectified: bool, prior: float = PRIOR) -> Match:
    """Return gains and offsets by which frames in contact match simulated signals best.
    change : (n, 19) counts, absolute if `rectified` is true; typical : (P, 19) counts, simulated, signed
    prior : number of contacts that the prior, gain 1 and offset 0, counts as
    Rectified signals give no offset: it is lost with the sign."""
    typical = np.abs(typical) if rectified else np.asarray(typical, np.float64)
    compressed = np.arcsinh(typical / SCALE)
    log_gain, offset = np.zeros(change.shape[1]), np.zeros(change.shape[1])
    settled = False
    for _ in range(ROUNDS):
        near = _nearest(np.arcsinh((change - offset) / np.exp(log_gain) / SCALE), compressed)
        before = log_gain
        log_gain, contacts = _log_gain(change - offset, typical, near, before, rectified, prior)
        if not rectified:
            offset = _offset(change, typical * np.exp(log_gain), near, prior)
        settled = bool(np.abs(log_gain - before).max() < SETTLED)
        if settled:
            break
    return Match(log_gain, offset, contacts, len(np.unique(near)), settled)


def _nearest(frames: np.ndarray, typical: np.ndarray) -> np.ndarray:
    """Return the index (n,) of the row of typical (P, 19) that is nearest to each of frames (n, 19)."""
    return (np.square(typical).sum(axis=1) - 2 * frames @ typical.T).argmin(axis=1)


def _log_gain(
    change: np.ndarray, typical: np.ndarray, near: np.ndarray, before: np.ndarray, rectified: bool, prior: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return log gains (19,) and the number (19,) of contacts behind each: a mean of logs has no bias by noise on both
    sides.
    near : (n,) each frame's row in ``typical``; before : (19,) log gains so far; change, prior : see `match`"""
    wanted = typical[near]
    size = np.square(wanted * np.exp(before))
    weight = size / (size + SURE**2)
    if not rectified:
        weight = weight * (np.sign(change) == np.sign(wanted))
    ratio = np.log((np.abs(change) + FLOOR) / (np.abs(wanted) + FLOOR))
    return _over_contacts(ratio, weight, near, prior)


def _offset(change: np.ndarray, typical: np.ndarray, near: np.ndarray, prior: float) -> np.ndarray:
    """Return offsets (19,) counts, from changes that should be small, on which the gain has little effect.
    change : (n, 19) counts; typical : (P, 19) counts; near : (n,) index into it; prior : contacts that 0 counts as"""
    wanted = typical[near]
    weight = SURE**2 / (np.square(wanted) + SURE**2)
    return _over_contacts(change - wanted, weight, near, prior)[0]


def _over_contacts(
    values: np.ndarray, weight: np.ndarray, near: np.ndarray, prior: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the weighted means (19,) of values (n, 19) over contacts, shrunk towards 0 by `prior` (in contacts), and
    the sums (19,) of the contacts' weights. weight : (n, 19); near : (n,) int, each frame's match: all frames of one
    match count as one contact, so a finger that rests on a table for a minute counts as much as for a second"""
    groups, index, count = np.unique(near, return_inverse=True, return_counts=True)
    weights, sums = (np.zeros((len(groups), values.shape[1])) for _ in range(2))
    np.add.at(weights, index, weight)
    np.add.at(sums, index, weight * values)
    share = weights / count[:, None]
    means = sums / np.maximum(weights, 1e-12)
    contacts = share.sum(axis=0)
    return (share * means).sum(axis=0) / (contacts + prior), contacts
