"""Fill unreadable samples, remove glitches without touching fast contacts, and average over neighbouring frames."""

from __future__ import annotations

import numpy as np

LIMIT = 30.0  # counts from the level around it; a glitch (docs/sources.md, BioTac read-out)
SHORT = 5  # samples; the longest glitch that a median of 11 samples can see
STUCK = 50  # samples; longest stay of a single electrode at a wrong level that is still repaired (assumed, 0.5 s)
END = 3  # samples; longest glitch at the very start or end of a recording (assumed)
END_LIMIT = 100.0  # counts, for glitches at the ends, where only one side can be compared (assumed)
FLATNESS = 1 / 3  # of the jump: how far a glitch's samples and the levels around it may differ (assumed)
LEVEL = 10.0  # counts that the level may have moved during any glitch, whatever its size (assumed)
STEEPER = 3.0  # times the jump must exceed the calmer neighbouring step: a steep press is steep on both sides (assumed)
ALONE = 3  # electrodes that step by `LEVEL` together in a stuck run; a real contact moves most of the 19 (assumed)
ROUNDS = 12  # glitches within glitches are peeled off one by one; a backstop
TOGETHER = 0.02  # share by which electrodes that fade together may differ; in a contact they differ more (assumed)
MAX_SHARE = 0.2  # of the frames; beyond, the rows are no time series and nothing is repaired (assumed)


def fill(values: np.ndarray, bad: np.ndarray) -> np.ndarray:
    """Return values (T, C) with the bad samples, bad (T, C) bool, of each column interpolated linearly; at the ends the
    nearest good sample is taken, and a column without any becomes 0. If none is bad, values itself is returned."""
    if not bad.any():
        return values
    values = values.astype(float)
    index = np.arange(len(values))
    for j in np.flatnonzero(bad.any(axis=0)):
        good = ~bad[:, j]
        values[~good, j] = np.interp(index[~good], index[good], values[good, j]) if good.any() else 0.0
    return values


def find_glitches(values: np.ndarray) -> np.ndarray:
    """Return (T, C) bool, true for samples that leave the signal's level for a moment: the signal comes back to it.

    values : (T, C) float, counts, finite
    A run of samples is a glitch when all of these hold. It begins with a jump of more than 30 counts in one sample and
    ends with one in the opposite direction. The level after it is the one before it, and its own samples lie on one
    level, both within a third of the jump. The jumps are three times as steep as the calmer of the two steps just
    outside. It leaves the median level of the second around it (a gap between two glitches does not). It lasts at most
    5 samples, or at most 50 where no more than 3 electrodes step by 10 counts (a bit stuck in one channel; seen in
    mat5_50 of the slide set).
    A press, a tap and a rolling contact pass: they rise and fall over several samples, or stay. A round tap of 20-50 ms
    is not flat; a contact within one single sample (10 ms) looks like a glitch. At the start and end of a recording
    only one jump can be seen; there it must exceed 100 counts, within 3 samples. The search ends early if so many
    frames hold glitches that the rows can be no time series."""
    found = np.zeros(values.shape, bool)
    for _ in range(ROUNDS):
        if not is_time_series(found):
            break  # nothing will be repaired, and noise has such runs everywhere: hours in a long file
        jumping = _jumping(values)
        new = (_short_runs(values, jumping) | _end_runs(values)) & ~found
        if not new.any():
            new = _stuck_runs(values, jumping) & ~found
        if not new.any():
            break
        found |= new
        values = fill(values, found)
    return found


def is_time_series(glitches: np.ndarray) -> bool:
    """Return false if so many frames hold glitches (T, C) bool that the rows can be no time series."""
    return not glitches.any() or float(glitches.any(axis=1).mean()) <= MAX_SHARE


def _jumping(values: np.ndarray) -> np.ndarray:
    """Return the indices (k,) int of the columns of values (T, C) counts that anywhere step by more than `LIMIT`."""
    return np.flatnonzero([np.abs(np.diff(column.astype(float))).max(initial=0) > LIMIT for column in values.T])


def _short_runs(values: np.ndarray, jumping: np.ndarray) -> np.ndarray:
    """Return (T, C) bool, true for glitches of 1 to 5 samples in values (T, C); jumping : (k,) columns to search"""
    frames = len(values)
    found = np.zeros(values.shape, bool)
    for length in range(1, min(SHORT, frames - 2) + 1):
        for j in jumping:
            _mark_short(values[:, j].astype(float), found[:, j], length)
        if not is_time_series(found):
            break
    return found


def _mark_short(column: np.ndarray, found: np.ndarray, length: int) -> None:
    """Set ``found`` (T,) bool for glitches of `length` samples in a column (T,) counts, beside those already set."""
    steps = np.diff(column)  # steps[i] leads from sample i to i + 1
    large = np.abs(steps) > LIMIT
    calm = np.abs(np.pad(steps, 1, mode="edge"))  # calm[i] = |step| into sample i
    starts = len(column) - 1 - length  # run = samples i+1 .. i+length for i < starts
    into, out = steps[:starts], steps[length : length + starts]
    first = np.flatnonzero(large[:starts] & large[length:][:starts] & (into * out < 0))
    around = np.minimum(calm[first], calm[np.minimum(first + length + 2, len(column))])
    for i in first[_is_flat_jump(column[first + np.arange(length + 2)[:, None]], around)].tolist():
        if not found[i : i + length + 2].any():  # else judge it in the next round, against the repaired level
            found[i + 1 : i + 1 + length] = _leaves_usual(column, i, i + length + 1)


def _is_flat_jump(samples: np.ndarray, neighbour_step: np.ndarray | float) -> np.ndarray:
    """Return (N,) bool, true for runs that jump away, steeper than their neighbourhood, stay on one level and return.
    samples : (n + 2, N) counts, the sample before each run, its n samples, and the sample after it
    neighbour_step : (N,) counts, the smaller of the steps just before and after these"""
    jump = np.minimum(np.abs(samples[1] - samples[0]), np.abs(samples[-1] - samples[-2]))
    run = samples[1:-1]
    returns = np.abs(samples[-1] - samples[0]) <= np.maximum(LEVEL, FLATNESS * jump)
    flat = np.ptp(run, axis=0) <= FLATNESS * jump
    steep = jump > STEEPER * neighbour_step
    apart = np.abs(run - 0.5 * (samples[0] + samples[-1])).min(axis=0) > LIMIT
    return returns & flat & steep & apart


def _leaves_usual(column: np.ndarray, first: int, last: int) -> bool:
    """Return true if the run between samples `first` and `last` of column (T,) leaves the level around it."""
    samples = column[first : last + 1]
    jump = min(abs(samples[1] - samples[0]), abs(samples[-1] - samples[-2]))
    usual = np.median(column[max(0, first - STUCK) : last + 1 + STUCK])
    return bool(abs(samples[1:-1].mean() - usual) > max(LEVEL, FLATNESS * jump))


def _end_runs(values: np.ndarray) -> np.ndarray:
    """Return (T, C) bool, true for glitches of 1 to 3 samples at the very start or end of values (T, C) counts."""
    found = np.zeros(values.shape, bool)
    if len(values) < 2 * END + 2:
        return found
    for view, marks in ((values, found), (values[::-1], found[::-1])):
        for j in range(values.shape[1]):
            head = view[: 2 * END + 2, j].astype(float)
            for length in range(1, END + 1):
                jump = abs(head[length] - head[length - 1])
                rest = head[length:]
                if jump > END_LIMIT and np.ptp(head[:length]) <= FLATNESS * jump and np.ptp(rest) <= FLATNESS * jump:
                    marks[:length, j] = True
    return found


def _stuck_runs(values: np.ndarray, jumping: np.ndarray) -> np.ndarray:
    """Return (T, C) bool, true for runs of up to 50 samples in which one to three electrodes sit at a wrong level.
    values : (T, C) counts; jumping : (k,) int, columns to search"""
    found = np.zeros(values.shape, bool)
    together = np.zeros(len(values) - 1, int)
    for column in values.T if len(jumping) else ():
        together += np.abs(np.diff(column.astype(float))) > LEVEL
    for j in jumping:
        column, ended = values[:, j].astype(float), -1
        jumps = (np.abs(np.diff(column)) > LIMIT) & (together <= ALONE)
        for start, end, around in _opposite_jumps(column, np.flatnonzero(jumps)):
            samples = column[start : end + 2, None]
            if start != ended and _is_flat_jump(samples, around)[0] and _leaves_usual(column, start, end + 1):
                found[start + 1 : end + 1, j] = True
                ended = start  # a run ends at the first jump that may end it
    return found


def _opposite_jumps(column: np.ndarray, edges: np.ndarray) -> list[tuple[int, int, float]]:
    """Return, sorted, (start, end, step) for pairs of opposite jumps that may begin and end a stuck run: the samples
    before the two jumps, and the smaller of the steps just outside, counts.
    column : (T,) counts; edges : (n,) int, samples before large steps. (All pairs at once: noise may make millions.)"""
    steps = np.diff(column)
    beside = np.abs(np.concatenate([[np.inf], steps, [np.inf]]))
    pairs: list[tuple[int, int, float]] = []
    for apart in range(1, min(STUCK, len(edges) - 1) + 1):
        start, end = edges[:-apart], edges[apart:]
        near = end - start <= STUCK
        if not near.any():
            break
        start, end = start[near], end[near]
        around = np.minimum(beside[start], beside[end + 2])
        around[np.isinf(around)] = 0.0  # the run leaves no step outside
        ends = column[np.stack([start, start + 1, end, end + 1])]
        kept = (steps[start] * steps[end] < 0) & _is_flat_jump(ends, around)
        pairs += zip(start[kept].tolist(), end[kept].tolist(), around[kept].tolist(), strict=True)
    return sorted(pairs)


def faded_ends(readings: np.ndarray) -> np.ndarray:
    """Return (T,) bool, true for rows at either end of raw readings (T, e) counts that are moving averages with zeros
    beyond the end, as of ``numpy.convolve(..., "same")``: towards it all electrodes fade evenly, to about half."""
    found = np.zeros(len(readings), bool)
    found[: _faded(readings)] = True
    found[len(readings) - _faded(readings[::-1]) :] = True
    return found


def _faded(readings: np.ndarray) -> int:
    """Return the number of first rows of readings (T, e) counts that are averages with zeros before them."""
    if len(readings) < 3 or not (readings[1] > readings[0]).all() or not readings[0].all():
        return 0
    rows = round(float(np.median(readings[0] / (readings[1] - readings[0]))))  # that the first average holds
    if rows < 3 or 2 * rows > len(readings):
        return 0
    share = readings[: rows - 1] / readings[0] / (1 + np.arange(rows - 1) / rows)[:, None]  # the last may be whole
    return rows if np.abs(share - 1).max() < TOGETHER else 0


def smooth(values: np.ndarray, frames: int) -> np.ndarray:
    """Return values (T, k) averaged over an odd number of frames around each, fewer at the ends."""
    if frames == 1:
        return values
    total = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0, dtype=np.float64)])
    frame = np.arange(len(values))
    first, last = np.maximum(frame - frames // 2, 0), np.minimum(frame + frames // 2 + 1, len(values))
    return (total[last] - total[first]) / (last - first)[:, None]
