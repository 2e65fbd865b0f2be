"""Translate recordings of a real BioTac and judge what comes out, with no truth but the sensor's own pressure.

The label for strength is PDC, the fluid's pressure: a transducer of its own that the translation never sees.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tactile_core import accuracy, sensors
from tactile_core.accuracy import Row, row
from tactile_core.errors import TactileError
from tactile_core.files import atomic
from tactile_core.recordings import PrepareOptions, Signals, read
from tactile_core.recordings.electrode_gains import ElectrodeGains
from tactile_core.recordings.flags import Flag
from tactile_core.recordings.preparer import Preparer
from tactile_core.recordings.repair import fill
from tactile_core.sensors import unrolling
from tactile_core.translation.translate import pass_over
from tactile_core.translation.translator import Translation, Translator

from . import slide_set
from .slide_metrics import CONTACT, SlideMetrics, largest_step, metrics

Translate = Callable[[Signals], Translation]
CHUNK = 128  # frames in memory at a time: 10 MB of displacements
STRENGTHS = ("force", "volume")
AIMED = "force"  # the strength that the targets are for; the other one is reported beside it
# Targets (docs/sources.md, Targets) for held-out recordings of the same sensor and task.
RANK_MEDIAN, RANK_QUARTILE, SILENCE, ROUGHNESS, SPREAD_MM = 0.92, 0.87, 0.05, 0.14, 0.9
NO_LARGER = 1.0  # a repaired sample may step as far as the recording does elsewhere


@dataclass(frozen=True, eq=False)
class Translated:
    """Parts of a translated recording that are evaluated; T frames, all of the recording's.

    time : (T,) unix s; force : (T,) N, magnitude; volume : (T,) mm3 of displaced gel
    centre : (T, 2) mm, (x, z) on the DIGIT, interpolated where there is no contact; missed : (T,) bool, where that was
    latent : (T, L) the DIGIT's latent; repaired : (T,) bool
    not_finite : how many numbers of all that was translated are no numbers
    """

    time: np.ndarray
    force: np.ndarray
    volume: np.ndarray
    centre: np.ndarray
    missed: np.ndarray
    latent: np.ndarray
    repaired: np.ndarray
    not_finite: int


def translate(
    path: Path, network: Translate, options: PrepareOptions | None = None, sensor: ElectrodeGains | None = None
) -> Translated:
    """Translate one recording as `tactile convert` does. Raises TactileError for a file that cannot be read."""
    recording = read(path)
    signals = Preparer(options, sensor)(recording)
    every = np.arange(len(recording))
    if isinstance(network, Translator):
        whole = pass_over(network, signals, recording.time)
        found = (whole(every[rows]).translation for rows in _chunks(len(recording)))
    else:  # a baseline answers by itself
        found = (network(signals.at(rows)) for rows in _chunks(len(recording)))
    parts = [_numbers(each) for each in found]
    force, volume, centre, latent = (np.concatenate([part[k] for part in parts]) for k in range(4))
    missed = ~np.isfinite(centre).all(axis=1)
    return Translated(
        time=recording.start_time + recording.time,
        force=force, volume=volume, missed=missed, latent=latent,
        centre=fill(centre, np.broadcast_to(missed[:, None], centre.shape)),
        repaired=(signals.flags & np.uint16(Flag.REPAIRED)) > 0,
        not_finite=sum(part[4] for part in parts),
    )  # fmt: skip


def _chunks(count: int) -> list[slice]:
    return [slice(start, start + CHUNK) for start in range(0, count, CHUNK)]


def _numbers(found: Translation) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, int]:
    """Force N, volume mm3, centre mm, latent, and the count of NaN of a translation."""
    arrays = (found.force, found.displacement_biotac, found.displacement_digit, found.latent_digit, found.confidence)
    not_finite = sum(int(np.count_nonzero(~np.isfinite(array))) for array in arrays)
    volume = 1e9 * displaced_volume(found.displacement_digit)
    return accuracy.lengths(found.force), volume, 1e3 * found.contact_center, found.latent_digit, not_finite


def displaced_volume(displacement: np.ndarray) -> np.ndarray:
    """Volume (T,) m3 of the gel's dent, for displacements (T, M, 3) m of its surface; bulges do not count."""
    digit = sensors.digit_surface()
    areas = unrolling.node_areas(np.asarray(digit.rest), np.asarray(digit.faces))
    return np.maximum(accuracy.height(displacement), 0) @ areas


def write(folder: Path, name: str, translated: Translated) -> None:
    """Write ``<name>.npz`` as the judging tool beside the recordings reads it; it appears whole or not at all."""
    arrays = {key: getattr(translated, key) for key in ("force", "volume", "centre")}
    with atomic.new_file(folder / f"{name}.npz") as partial, open(partial, "wb") as file:
        np.savez(file, t=translated.time, feat=translated.latent, **arrays)


@dataclass(frozen=True, eq=False)
class Judged:
    """Metrics of one recording. metrics : None where wrench or pose are missing

    missed : share of the frames surely in contact for which no contact is found, NaN where there are none
    step, step_unrepaired : see `largest_step`; the second with the bad samples left in; NaN where there are none
    not_finite : how many numbers of the translation are none
    """

    metrics: SlideMetrics | None
    missed: float
    step: float
    step_unrepaired: float
    not_finite: int


def judge(path: Path, network: Translate, out: Path | None = None, sensor: ElectrodeGains | None = None) -> Judged:
    """Translate a recording, write ``<out>/<name>.npz`` unless `out` is None, and measure."""
    found = translate(path, network, sensor=sensor)
    if out is not None:
        write(out, slide_set.name_of(path), found)
    step = largest_step(found.force, found.repaired)
    unrepaired = np.nan
    if found.repaired.any():
        untouched = translate(path, network, PrepareOptions(repair=False, smooth=1), sensor)
        unrepaired = largest_step(untouched.force, found.repaired)
    if not slide_set.is_whole(path):
        return Judged(None, np.nan, step, unrepaired, found.not_finite)
    recording = slide_set.load(path)
    strengths = {name: getattr(found, name) for name in STRENGTHS}
    contact = recording.pressure > CONTACT
    missed = np.interp(recording.time, found.time, found.missed)[contact]
    return Judged(
        metrics(recording, found.time, strengths, found.centre),
        float(missed.mean()) if len(missed) else np.nan, step, unrepaired, found.not_finite,
    )  # fmt: skip


def rows(
    folder: str | os.PathLike,
    network: Translate,
    out: str | os.PathLike | None = None,
    most: int | None = None,
    sensor: ElectrodeGains | None = None,
) -> list[Row]:
    """Translate and judge a folder's recordings kept for reporting, the first `most` or all.

    The baseline is the electrodes' sum.
    out : folder for the translations, in the form that the judging tool beside the recordings reads
    sensor : gains and offsets of the sensor that made them, as `tactile adapt` finds them
    Raises TactileError for a folder without recordings, and for one that cannot be read.
    """
    out = None if out is None else Path(out)
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
    return rows_of([judge(path, network, out, sensor) for path in slide_set.reporting(folder)[:most]])


def rows_of(judged: list[Judged]) -> list[Row]:
    """Rows of recordings, medians unless named otherwise. Raises TactileError where none has wrench and pose."""
    whole = [one.metrics for one in judged if one.metrics is not None]
    if not whole:
        raise TactileError("recordings", "none with its _cw.csv and _cp.csv", "at least one", "Copy them beside it")
    of = f"{len(whole)} recordings"
    table = [rows for name in STRENGTHS for rows in _strength_rows(whole, name, of, name == AIMED)]
    for name in ("electrode_1", "electrode_sum", "electrode_rms"):
        table.append(_row(f"{name}_rank_median", [one.ranks[name] for one in whole], "1", None, of=of))
    for axis, word in enumerate(("along", "across")):
        value, baseline = ([one.spreads[key][axis] for one in whole] for key in ("centre", "electrodes"))
        table.append(_row(f"centre_spread_{word}", value, "mm", SPREAD_MM, baseline=baseline, of=of))
    table.append(_row("contact_missed", [one.missed for one in judged], "1", None, baseline=[1.0], of=of))
    step, unrepaired = ([getattr(one, name) for one in judged] for name in ("step", "step_unrepaired"))
    bad = f"worst of {np.isfinite(step).sum()} recordings with bad samples; baseline: not repaired"
    table.append(_row("step_at_repaired", step, "1", NO_LARGER, baseline=unrepaired, of=bad, over=np.max))
    numbers = [one.not_finite for one in judged]
    table.append(_row("not_finite", numbers, "numbers", 0, of=f"all frames of {len(judged)} recordings", over=np.sum))
    return [row for rows in table for row in rows]


def _strength_rows(whole: list[SlideMetrics], name: str, of: str, aimed: bool) -> list[list[Row]]:
    def pick(metric: str) -> dict[str, list[float]]:
        value, baseline = ([getattr(one, metric)[key] for one in whole] for key in (name, "electrode_sum"))
        return {"values": value, "baseline": baseline}

    ranks, still, rough = pick("ranks"), pick("silences"), pick("roughs")
    lost = f"{np.isfinite(still['values']).sum()} recordings that lose contact"
    targets = (RANK_MEDIAN, RANK_QUARTILE, SILENCE, ROUGHNESS) if aimed else (None,) * 4
    return [
        _row(f"{name}_rank_median", **ranks, unit="1", target=targets[0], of=of, at_least=True),
        _row(f"{name}_rank_quartile", **ranks, unit="1", target=targets[1], of=of, at_least=True, over=_quartile),
        _row(f"{name}_silence", **still, unit="1", target=targets[2], of=lost),
        _row(f"{name}_roughness", **rough, unit="1", target=targets[3], of=of),
    ]


def _row(
    name: str,
    values: Sequence[float],
    unit: str,
    target: float | None,
    *,
    of: str,
    baseline: Sequence[float] = (),
    at_least: bool = False,
    over: Callable[[np.ndarray], float] = np.median,
) -> list[Row]:
    """Make one row, `over` the recordings that have the metric; none where no recording has it."""
    value, nothing = (
        float(over(numbers[np.isfinite(numbers)])) if np.isfinite(numbers).any() else None
        for numbers in (np.asarray(values, float), np.asarray(baseline, float))
    )
    if value is None:
        return []
    return [row(f"recordings_{name}", value, unit, target, baseline=nothing, of=of, at_least=at_least)]


def _quartile(values: np.ndarray) -> float:
    return float(np.percentile(values, 25))
