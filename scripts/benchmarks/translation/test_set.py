"""Measure the translation on a test set of contacts that the full tier has solved."""

from __future__ import annotations

import numpy as np

from tactile_core import accuracy
from tactile_core.accuracy import Row, row
from tactile_core.sensors.readout import NOISE
from tactile_core.simulation.pairs_file import Pairs
from tactile_core.training.step_errors import (
    Bodies,
    error_columns,
    metric_row,
    metric_rows,
    slices,
    translation_metrics,
)
from tactile_core.translation.card import SURFACES
from tactile_core.translation.translator import Translator

from .contact_rows import answer_rows, posterior_rows, rectified_rows

# Targets (docs/sources.md, Targets), without shear, depth bins and indenters alike.
TARGETS = {
    "MVB_rms_um": 3.0, "MVD_rms_um": 6.0,
    "M2MPN_rms_um": 12.0, "M2MPN_core_height_um": 30.0, "M2MPN_peak_depth_percent": 5.0, "M2MPN_iou": 0.85,
    "S2MPN_rms_um": 12.0, "S2MPN_position_mm": 0.5, "force_percent": 10.0, "chain_rms_um": 35.0,
}  # fmt: skip
UNSEEN = {"cube_14mm": 32.0, "ring_7mm": 55.0}  # um, of M2MPN on an indenter that was kept from the training
EACH_INDENTER = ("S2MPN_rms_um", "M2MPN_rms_um", "M2MPN_core_height_um", "chain_rms_um")
BASELINE_METRICS = ("baseline_biotac_rms_um", "baseline_digit_rms_um", "baseline_digit_core_height_um")
SEED = 7  # of the readings' noise
GAIN = 0.1  # standard deviation per channel (assumed: docs/sources.md, BioTac read-out)


def seen_rows(translator: Translator, pairs: Pairs, bodies: Bodies) -> list[Row]:
    """Return rows on all contacts: metrics with targets, and metrics of subsets.
    bodies : the gel's surface and the skin's unrolled places, by ``our_bodies``"""
    rows = np.arange(len(pairs.press))
    change = as_read(pairs.signal, SEED)
    columns = translation_metrics(translator.nets, pairs, rows, change, bodies)
    found = answer_rows(translator.nets, pairs, change, bodies) + posterior_rows(translator.nets, pairs, change)
    found += rectified_rows(translator.nets, pairs, change, bodies)
    found += metric_rows(columns, pairs, rows, "seen indenters", TARGETS)
    for name, mask in slices(pairs, rows):
        for step, body in (("S2MPN", "biotac"), ("M2MPN", "digit"), ("chain", "digit")):
            value, baseline = (accuracy.mean(columns[f"{each}_rms_um"][mask]) for each in (step, f"baseline_{body}"))
            found.append(metric_row(f"{step}_rms_um", value, baseline, None, name))
        for metric in ("S2MPN_position_mm", "force_percent"):
            known = columns[metric][mask & np.isfinite(columns[metric])]
            if known.size:
                found.append(metric_row(metric, float(np.median(known)), None, None, name))
    for number, name in enumerate(pairs.indenter_names):
        at = pairs.indenter == number
        each = {metric: np.where(at, columns[metric], np.nan) for metric in (*EACH_INDENTER, *BASELINE_METRICS)}
        found += [one for one in metric_rows(each, pairs, rows, name, {}) if one["value"] is not None]
    return found


def unseen_rows(translator: Translator, pairs: Pairs, bodies: Bodies) -> list[Row]:
    """Return rows on contacts by indenters, and in the region, that the translator's card says training left out."""
    options, names = translator.card["options"], np.array(pairs.indenter_names)
    there = pairs.place[:, 0] < (-np.inf if options["without_below_x"] is None else options["without_below_x"])
    known = ~np.isin(names[pairs.indenter], options["without"])
    sets = {f"unseen {name}": ~there & (names[pairs.indenter] == name) for name in options["without"]}
    sets |= {"unseen region": there & known, "unseen region and indenter": there & ~known}
    found = []
    for name, mask in sets.items():
        rows = np.flatnonzero(mask)
        if len(rows):
            change = as_read(pairs.signal[rows], SEED)
            columns = translation_metrics(translator.nets, pairs, rows, change, bodies)
            target = UNSEEN.get(name.removeprefix("unseen "))
            targets = {} if target is None else {"M2MPN_rms_um": target}
            found += metric_rows(columns, pairs, rows, name, targets)
            found += expected_error_rows(translator, pairs, rows, change, bodies, name)
    return found


def expected_error_rows(
    translator: Translator, pairs: Pairs, rows: np.ndarray, change: np.ndarray, bodies: Bodies, name: str
) -> list[Row]:
    """Return rows of the share of contacts whose largest error is below its bound, of those or flagged, and flagged.
    rows : (C,), indices of pairs; change : (C, 19) counts, signals as read; name : the set's"""
    columns = error_columns(translator.nets, pairs, rows, change, bodies, translator.silent("digit_m"))
    flagged = translator.out_of_range(change)
    found = []
    for surface in SURFACES:
        bound = translator.bound(columns[f"{surface}_expected_m"], columns["x_m"], surface)
        covered = columns[f"{surface}_max_m"] <= bound
        either = float((covered | flagged).mean())
        found.append(row(f"{surface}_error_covered", float(covered.mean()), "1", of=name))
        found.append(row(f"{surface}_error_covered_or_flagged", either, "1", 0.85, of=name, at_least=True))
    return [*found, row("frames_flagged", float(flagged.mean()), "1", of=name)]


def as_read(change: np.ndarray, seed: int) -> np.ndarray:
    """Return the true change (C, 19) counts as sensors read it: with noise, and gains drawn for each contact anew."""
    random = np.random.default_rng(seed)
    gain = 1 + GAIN * random.standard_normal(change.shape)
    return (gain * change + NOISE * random.standard_normal(change.shape)).astype(np.float32)
