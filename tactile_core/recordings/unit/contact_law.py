"""Check whether the contacts of a recording, taken together, resemble simulated ones.

A wrong polarity, gain, order of channels or rest turns each contact into signals that some other contact may have, so
one frame hardly shows it. Three statistics over the different contacts of a recording do: the share of the changes that
a few neighbouring simulated contacts leave unexplained; how much less is unexplained if two electrodes are exchanged;
and how much less with a gain for each electrode, if the fitted gains differ widely. A softer or otherwise filled skin
moves the electrodes alike at another fluid pressure, which shows it if it was recorded (table: docs/accuracy.md).

A level that was taken for rest may be a contact, too: a steady grip is as calm as an untouched finger. Its difference
to a typical rest is fitted by the fluid's conductivity, and then by one contact beside it. The contact leaves .53 to
.84 of what conductivity alone leaves in five real units at rest, .23 to .38 in eight hard grips; soft grips (.47 to
.87) cannot be told from rest. A `sensor` is the name of the one whose simulated contacts are compared."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...sensors import SOURCE, contact_pressures_of, contacts_of, divider, typical_rest
from ...sensors.descriptor import of_kind
from ...sensors.fluid_sensor import Fluid
from ..doubt import Doubt, Reason
from ..electrode_faults import DEAD_FRAMES
from ..flags import Flag
from ..polarity import contact_signals, patterns, spread_out, touching, unit
from ..rest_level import Framewise
from .gain_matching import match

MOST = 2000  # frames looked at, evenly spread
MOST_MATCHED = 200  # of them by which gains are fitted, which takes longer
NEIGHBOURS = 8  # simulated contacts that a change is fitted by
RIDGE = 0.1  # of that fit, added to the products of their unit vectors, which are nearly alike
FEWEST = 13  # different contacts: one press and its noise count as up to a dozen, and fewer hardly show a wrong gain
# Unexplained share, LEFT + MORE / sqrt(different contacts), that 199 of 200 recordings of units with the right law stay
# below: simulated contacts of even presses, gains 10 % apart, noise of 1.5 counts, by `wrong_laws.py --fit`, commit
# d537259.
LEFT, MORE = 0.1696, 0.3033
# Cosine of contacts below which they count as different, and the fewest by which gains and exchanges are judged: either
# explains the unlikeness of one contact alone (up to .14 of it in single grips of real fingers).
APART, FEWEST_APART = 0.95, 8
# Doubts need: GAINED of a change explained by fitted gains whose logarithms spread by SPREAD (rms), or EXCHANGED by an
# exchange. Chosen likewise, on other contacts than those reported: with 20 and more, 398 of 400 simulated recordings
# stay below .003 by exchanges, and as many below one of the limits of gains.
GAINED, SPREAD, EXCHANGED = 0.02, 0.2, 0.015
PRIOR = 2.0  # contacts that a gain of 1 counts as
FITS = 2  # in sequence, since the prior shrinks each of them
TRIED = 4  # exchanges that look best by the unexchanged changes' neighbours: the right one was among them in all of 597
SIZE = 0.35  # largest logarithm of the ratio of a simulated contact's size to a change's, for a comparison of pressures
PRESSED = 30.0  # counts, least size of changes whose pressure is judged: that of smaller ones is no larger than drift
FEWEST_PRESSED = 6  # such contacts: the logarithm scatters by .28 for one, .11 for six (simulated, even presses)
# Limits of measured over simulated pressure. Real skins have .7 to .8 of the simulated one's stiffness (descriptor of
# the BioTac); half of their recordings lie between .58 and 1.05.
LEAST_PRESSURE, MOST_PRESSURE = 0.6, 2.0
CONDUCTIVITIES = np.linspace(-1.5, 1.5, 151)  # logarithms over a typical unit's, tried for a level at rest
MOST_LEFT = 0.45  # share that a contact leaves of what a conductivity does: between units at rest and hard grips
LEAST_USED = 0.6  # of the electrodes, which judge a level; of ten, three of 100 units at rest looked like a contact
LEAST_APART = 100.0  # counts, norm of a level's difference without conductivity: units differ by 106 to 434


def unexplained_share(change: np.ndarray, sensor: str = SOURCE) -> tuple[float, int]:
    """Return the share of change (n, 19) counts that no simulated contact explains, and how many contacts differ."""
    if not len(change):
        return 0.0, 0
    change = change[spread_out(len(change), MOST)]
    chosen = unit(change)
    like = chosen @ patterns(sensor).T
    left = np.sqrt(np.square(chosen - _rebuilt(chosen, like, sensor)).sum(axis=1))
    _, which, counts = np.unique(like.argmax(axis=1), return_inverse=True, return_counts=True)
    # Where rest is far off, all contacts look like one, but for what they change by.
    steps = change - np.median(change, axis=0)
    others = np.unique((unit(steps[touching(steps)]) @ patterns(sensor).T).argmax(axis=1))
    return float((np.bincount(which, left) / counts).mean()), max(len(counts), len(others))


def _rebuilt(chosen: np.ndarray, like: np.ndarray, sensor: str) -> np.ndarray:
    """Return unit vectors chosen (n, 19) as fitted by simulated ones; like : (n, P) cosines to all of these"""
    near = patterns(sensor)[np.argpartition(-like, NEIGHBOURS, axis=1)[:, :NEIGHBOURS]]
    products = near @ near.transpose(0, 2, 1) + RIDGE * np.eye(NEIGHBOURS)
    weights = np.linalg.solve(products, (near @ chosen[:, :, None]))
    return (near * weights).sum(axis=1)


def gained_share(change: np.ndarray, sensor: str = SOURCE) -> tuple[float, float]:
    """Return how much less of change (n, 19) is unexplained by fitted gains, and their spread (rms of logarithms)."""
    change = change[spread_out(len(change), MOST_MATCHED)]
    even, log_gain = change, np.zeros(change.shape[1])
    for _ in range(FITS):
        log_gain = log_gain + match(even, contact_signals(sensor), rectified=False, prior=PRIOR).log_gain
        even = change / np.exp(log_gain)
    less = unexplained_share(change, sensor)[0] - unexplained_share(even[touching(even)], sensor)[0]
    return less, float(np.sqrt(np.square(log_gain - np.median(log_gain)).mean()))


def exchanged_share(change: np.ndarray, sensor: str = SOURCE) -> tuple[float, tuple[int, int]]:
    """Return how much less of change (n, 19) counts is unexplained if two electrodes are exchanged, and the best pair's
    indices. (The residual of each exchanged electrode correlates with the other's simulated change.)"""
    change = change[spread_out(len(change), MOST_MATCHED)]
    chosen = unit(change)
    product = chosen.T @ _rebuilt(chosen, chosen @ patterns(sensor).T, sensor)
    own = np.diag(product)
    less = product + product.T - own[:, None] - own  # about what an exchange gains; exactly only for the best TRIED
    first, second = np.triu_indices(len(own), 1)
    before, found = unexplained_share(change, sensor)[0], []
    for k in np.argsort(-less[first, second], kind="stable")[:TRIED]:
        pair = int(first[k]), int(second[k])
        back = change.copy()
        back[:, pair] = change[:, pair[::-1]]
        found.append((before - unexplained_share(back, sensor)[0], pair))
    return max(found)


def apart(change: np.ndarray, sensor: str = SOURCE) -> int:
    """Return the number of different contacts in change (n, 19) counts: unlike each other by simulated ones."""
    known = patterns(sensor)
    near, counts = np.unique((unit(change[spread_out(len(change), MOST)]) @ known.T).argmax(axis=1), return_counts=True)
    kept: list[int] = []
    for each in near[np.argsort(-counts, kind="stable")]:
        if (known[kept] @ known[each] < APART).all():
            kept.append(int(each))
    return len(kept)


def pressure_ratio(change: np.ndarray, pressure: np.ndarray, sensor: str = SOURCE) -> tuple[float, int]:
    """Return the ratio of measured to simulated pressure, median over different contacts, and the number of these;
    (NaN, 0) for none. The simulated pressure is that of the most similar contacts, scaled to the change's size.
    change : (n, 19) counts in contact; pressure : (n,) Pa over rest, NaN if not measured"""
    simulated, size = contact_pressures_of(sensor), np.linalg.norm(change, axis=1)
    judged = np.flatnonzero((size > PRESSED) & np.isfinite(pressure))
    if simulated is None or not len(judged):
        return np.nan, 0
    judged = judged[spread_out(len(judged), MOST)]
    known = contact_signals(sensor)
    of_known = np.linalg.norm(known, axis=1)
    larger = np.log(of_known[None] / size[judged, None])
    like = np.where(np.abs(larger) < SIZE, change[judged] @ known.T / (size[judged, None] * of_known), -2.0)
    best = np.argsort(-like, axis=1)[:, :NEIGHBOURS]
    there = np.take_along_axis(like, best, 1) > -1
    # pressure grows with size: log expected = log simulated - log(its size / this size), the mean over those alike
    expected = np.log(simulated)[best] - np.take_along_axis(larger, best, 1)
    known_size = there[:, 0]
    mean = np.where(there, expected, 0.0).sum(axis=1)[known_size] / there[known_size].sum(axis=1)
    measured = np.maximum(pressure[judged][known_size], 1.0)
    _, which, counts = np.unique(best[known_size, 0], return_inverse=True, return_counts=True)
    if not len(counts):
        return np.nan, 0
    return float(np.exp(np.median(np.bincount(which, np.log(measured) - mean) / counts))), len(counts)


def limit(contacts: int) -> float:
    """Return the largest unexplained share that is not doubted, for a recording's number of different contacts."""
    return LEFT + MORE / float(np.sqrt(contacts))


def doubt(change: np.ndarray, pressure: np.ndarray | None = None, sensor: str = SOURCE) -> Doubt | None:
    """Return the doubt whether change (n, 19) counts, of a typical unit in contact, resembles simulated contacts, or
    None.
    pressure : (n,) Pa of the fluid over its level at rest, NaN if not measured; or None"""
    left, contacts = unexplained_share(change, sensor)
    enough, most = contacts >= FEWEST, limit(max(contacts, 1))
    if contacts and apart(change, sensor) >= FEWEST_APART:
        found = _doubt_electrodes(change, left - most, sensor)
        if found is not None:
            return found
    if enough and left > most:
        return Doubt(Reason.LAW_LEFT_OVER, left=left, contacts=contacts, most=most)
    ratio, pressed = pressure_ratio(change, pressure, sensor) if enough and pressure is not None else (np.nan, 0)
    if pressed >= FEWEST_PRESSED and not LEAST_PRESSURE <= ratio <= MOST_PRESSURE:
        limits = {"least": LEAST_PRESSURE, "most": MOST_PRESSURE}
        return Doubt(Reason.LAW_PRESSURE, ratio=ratio, contacts=pressed, **limits)
    return None


def flagged(
    typical: Framewise, kind: str, quiet: np.ndarray, flags: np.ndarray, pdc: np.ndarray, sensor: str
) -> tuple[np.ndarray, Doubt | None]:
    """Return flags (T,) uint16 with `LAW_DOUBTED` in all frames in contact if they do not resemble simulated contacts,
    else without it; and the doubt, or None.

    typical : (T, e) counts, changes converted to a typical unit; quiet : (T,) bool, frames at rest; flags : (T,) uint16
    pdc : (T,) counts over rest; kind : the recording's; only "raw" and "tared" are judged"""
    if kind not in ("raw", "tared") or contacts_of(sensor) is None:
        return flags, None
    contact = touching(typical) & ~quiet
    frames = np.flatnonzero(contact)
    seen = frames[spread_out(len(frames), MOST)]
    guessed = bool(flags[0] & np.uint16(Flag.NO_QUIET_PART))  # then so is what pressure rose from
    pressure = None if guessed else of_kind(sensor, Fluid).readout.pressure * pdc[seen]
    found = doubt(typical[seen], pressure, sensor)
    flags = flags & ~np.uint16(Flag.LAW_DOUBTED)
    if found is not None:
        flags[contact] |= np.uint16(Flag.LAW_DOUBTED)
    return flags, found


def _doubt_electrodes(change: np.ndarray, beyond: float, sensor: str) -> Doubt | None:
    """Return the doubt of exchanged electrodes or of gains, if it explains over `beyond` of change (n, 19), or None."""
    less, (first, second) = exchanged_share(change, sensor)
    if less > max(EXCHANGED, beyond):
        return Doubt(Reason.LAW_EXCHANGED, share=less, first=first + 1, second=second + 1, most=EXCHANGED)
    less, spread = gained_share(change, sensor)
    if less > max(GAINED, beyond) and spread > SPREAD:
        return Doubt(Reason.LAW_GAINS, share=less, spread=spread, most=GAINED, usual=SPREAD)
    return None


def as_contact(level: np.ndarray, sensor: str, readings: Sequence[np.ndarray] = ()) -> float | None:
    """Return the share (0..1) that one simulated contact explains of a level's difference to a typical rest with the
    conductivity that fits best; None if that is too little for a contact, or if the sensor has no simulated ones.

    level : (e,) counts taken for rest; readings : (T, e) counts of each recording, by which faulty electrodes are left
    out: those that stand still in all, or are outside the range of rests (unless most are)"""
    typical = typical_rest(sensor)
    if typical is None or contacts_of(sensor) is None:
        return None
    used = (level > divider.RESTS[0]) & (level < divider.RESTS[1])
    if sum(map(len, readings)) >= DEAD_FRAMES:
        used &= np.ptp(np.concatenate(readings), axis=0) != 0
    if used.mean() < LEAST_USED:  # a quiet finger, read in few bits
        used[:] = True
    level, typical = level[used], typical[used]
    rest = divider.of_films(np.exp(CONDUCTIVITIES)[:, None], typical)
    change = divider.typical(level - rest, rest, typical)
    known = contact_signals(sensor)[:, used]
    onto = (change @ (known / np.linalg.norm(known, axis=1, keepdims=True)).T).max(axis=1)
    squares = np.square(change).sum(axis=1)
    alone = np.sqrt(squares.min())
    left = np.sqrt(np.maximum(squares - np.square(np.maximum(onto, 0)), 0).min())
    return 1 - float(left / alone) if alone > LEAST_APART and left < MOST_LEFT * alone else None
