"""Fluid pressure estimated from the electrodes, against the one that PDC measures: the absolute label on real fingers.

Slides hold both from one zero. Sample 7 of each material may be looked at, the others are reported; of grips only the
order within a file counts, as their pressure has no zero (docs/sources.md, Real data sets).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from tactile_core.accuracy import Row, row
from tactile_core.recordings import Signals, read
from tactile_core.recordings.electrode_gains import ElectrodeGains
from tactile_core.recordings.preparer import Preparer
from tactile_core.sensors import PRESSURE_PER_COUNT
from tactile_core.translation.translate import pass_over
from tactile_core.translation.translator import Translator

from . import slide_set
from .prints import CONTACT
from .slide_metrics import rank_correlation

AS_IT_COMES, SCALED = 20.0, 7.0  # per cent, targets (docs/sources.md, Targets)
ABOVE = 0.05  # share of contact frames above the training's largest pressure, likewise
SWING = 550.0  # Pa, by which a grip's pressure must change to have an order


def slide_rows(folder: Path, network: Translator, most: int | None, sensor: ElectrodeGains | None) -> Iterator[Row]:
    """Median errors as they come and after one scale, from sample 7, beside a constant and the electrodes' sum."""
    report = slide_set.reporting(folder)[:most]
    choose = [path for path in slide_set.find(folder) if path not in slide_set.reporting(folder)]
    if not choose:
        return
    estimated, seen = (np.concatenate([_frames(path, network, sensor) for path in paths]) for paths in (report, choose))
    of = f"{len(estimated)} frames above {CONTACT:g} Pa, {len(report)} recordings"
    constant = np.median(seen[:, 0])
    value, baseline = (
        _error(estimated[:, 1], estimated[:, 0]),
        _error(np.full(len(estimated), constant), estimated[:, 0]),
    )
    yield row(
        "pressure_error",
        value,
        "%",
        AS_IT_COMES,
        baseline=baseline,
        of=f"{of}; baseline: a constant, {constant:.0f} Pa",
    )
    scale = [np.median(seen[:, 0] / seen[:, k]) for k in (1, 2)]
    value, baseline = (_error(scale[k - 1] * estimated[:, k], estimated[:, 0]) for k in (1, 2))
    whole_set = f"{of}; scale {scale[0]:.3f} from sample {slide_set.CHOOSING}; baseline: sum of electrodes, scaled too"
    yield row("pressure_error_scaled", value, "%", SCALED, baseline=baseline, of=whole_set)
    largest = network.card["pairs"]["largest_pressure_Pa"]
    above = float((estimated[:, 0] > largest).mean())
    yield row("pressure_above_training", above, "1", ABOVE, of=f"{of}; {largest:.0f} Pa")


def grip_row(prepared: Iterable[Signals], network: Translator) -> Row:
    """Median rank correlation within grips whose pressure changes; baseline: sum of the absolute changes."""
    ranks, sums = [], []
    for signals in prepared:
        measured = PRESSURE_PER_COUNT * signals.pdc
        if np.subtract(*np.percentile(measured, [95, 5])) > SWING:
            ranks.append(rank_correlation(network(signals).pressure, measured))
            sums.append(rank_correlation(np.abs(signals.change).sum(axis=1), measured))
    value, baseline = (float(np.median(each)) if each else None for each in (ranks, sums))
    of = f"{len(ranks)} grips whose pressure changes by {SWING:g} Pa; baseline: sum of electrodes"
    return row("grip_pressure_rank", value, "1", baseline=baseline, of=of, at_least=True)


def _frames(path: Path, network: Translator, sensor: ElectrodeGains | None) -> np.ndarray:
    """Frames surely in contact, (T, 3): pressure measured and estimated, Pa, and the electrodes' sum, counts.

    Contacts are followed, as `convert` does: a light frame alone may look like none, and then has no pressure.
    """
    recording = read(path)
    signals = Preparer(None, sensor)(recording)
    measured = PRESSURE_PER_COUNT * signals.pdc
    estimated = pass_over(network, signals, recording.time)(np.arange(len(recording))).translation.pressure
    columns = np.column_stack([measured, estimated, np.abs(signals.change).sum(axis=1)])
    return columns[measured > CONTACT]


def _error(estimated: np.ndarray, measured: np.ndarray) -> float:
    return float(100 * np.median(np.abs(estimated / measured - 1)))
