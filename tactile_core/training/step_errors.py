"""Measure each step of the translation on paired contacts, against the simulated truth, contact by contact."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from .. import accuracy, sensors
from ..accuracy import Row, row
from ..geometry.lattice import Lattice
from ..sensors import PAIR, SOURCE, TARGET, unrolling
from ..simulation.pairs_file import Pairs
from ..translation.card import SURFACES
from ..translation.gel_place import contact_center, contact_patch
from ..translation.networks import Networks

ROWS = 128  # contacts at a time, to bound memory
LEAST_PATCH = 20  # nodes: on smaller patches a share says little
Columns = dict[str, np.ndarray]  # name of a metric -> (C,) a number per contact; NaN where it does not apply


@dataclass(frozen=True)
class Bodies:
    """Surfaces of a pair of sensors, on which errors are measured.
    digit : the gel's surface; unrolled : (N, 2) = (x, z) m, the skin's nodes unrolled on its plane, NaN beside it"""

    digit: Lattice
    unrolled: np.ndarray


def our_bodies(source: str = SOURCE, target: str = TARGET) -> Bodies:
    """Return this version's surfaces of a skin, source, and a gel, target."""
    return Bodies(sensors.sensor_surface(target), unrolling.unrolled_nodes(source))


def true_displacement(pairs: Pairs, sensor: str, rows: np.ndarray) -> np.ndarray:
    """Return displacements (B, n, 3) float32 m of rows (B,) of pairs, on the surface of sensor "biotac" or "digit"."""
    steps, step = getattr(pairs, f"displacement_{sensor}")[rows], getattr(pairs, f"scale_{sensor}")
    return steps.astype(np.float32) * np.float32(step)


def translation_metrics(nets: Networks, pairs: Pairs, rows: np.ndarray, change: np.ndarray, bodies: Bodies) -> Columns:
    """Return every step's errors on the contacts rows (C,) of pairs, read as ``change`` (C, e) counts.

    Steps: ``MVB``, ``MVD`` (each mesh through its autoencoder), ``M2MPN`` (BioTac mesh to DIGIT mesh), ``S2MPN``
    (signal to BioTac mesh), ``chain`` (signal to DIGIT mesh); reverse ``D2B`` (DIGIT mesh to BioTac mesh), and ``B2S``,
    ``D2S`` (meshes to signal), ``force``, ``pressure``. Columns are, say, ``MVB_max_um``; ``baseline_*`` : no
    displacement."""
    return joined(_part(nets, pairs, rows[part], change[part], bodies) for part in parts(len(rows)))


def _rms(values: np.ndarray) -> np.ndarray:
    return np.sqrt(np.square(values, dtype=np.float64).mean(-1))


def parts(count: int) -> list[slice]:
    """Return slices that cut ``count`` contacts into parts of at most ROWS."""
    return [slice(start, start + ROWS) for start in range(0, count, ROWS)]


def joined(columns: Iterator[Columns]) -> Columns:
    """Join the columns of consecutive parts of contacts, each by name, into columns of all contacts."""
    found = list(columns)
    return {name: np.concatenate([part[name] for part in found]) for name in found[0]}


def _part(nets: Networks, pairs: Pairs, rows: np.ndarray, change: np.ndarray, bodies: Bodies) -> Columns:
    skin, gel = (true_displacement(pairs, sensor, rows) for sensor in PAIR)
    patch = pairs.contact_patch_digit[rows]
    mesh, read = nets.encode_source(skin), nets.encode_signal(change)
    state = nets.contact(read)
    signal, chained = nets.latents(read, state)
    found = {
        **mesh_columns("baseline_biotac", np.zeros_like(skin), skin, accuracy.lengths),
        **mesh_columns("baseline_digit", np.zeros_like(gel), gel),
        **mesh_columns("MVB", nets.decode_source(mesh), skin, accuracy.lengths),
        **mesh_columns("MVD", nets.decode_target(nets.encode_target(gel)), gel),
        **mesh_columns("S2MPN", nets.decode_source(signal), skin, accuracy.lengths),
        "S2MPN_position_mm": 1e3 * _skin_offset(nets.decode_source(signal), skin, bodies),
    }
    for name, latent in (("M2MPN", nets.m2m(mesh)), ("chain", chained)):
        answer = nets.decode_target(latent)
        found |= mesh_columns(name, answer, gel) | digit_columns(name, answer, patch, bodies)
    back = nets.m2m_back(nets.encode_target(gel))
    found |= mesh_columns("D2B", nets.decode_source(back), skin, accuracy.lengths)
    for name, latent in (("B2S", mesh), ("D2S", back)):
        found[f"{name}_counts"] = _rms(nets.decode_signal(nets.m2s(latent)) - pairs.signal[rows])
    found["baseline_counts"] = _rms(pairs.signal[rows])
    found |= digit_columns("true_mesh", gel, patch, bodies)
    for name, force in (("force_from_mesh", nets.force(mesh)), ("force", nets.force_in(state, signal))):
        load = accuracy.lengths(pairs.force[rows])
        error = accuracy.lengths(force - pairs.force[rows])
        found[f"{name}_percent"] = np.where(load > FORCE_FROM, 100 * error / load, np.nan)
    pressure = pairs.pressure[rows]
    with np.errstate(divide="ignore"):
        share = 100 * np.abs(nets.pressure(change) / pressure - 1)
    found["pressure_percent"] = np.where(pressure > PRESSURE_FROM, share, np.nan)
    return found


def error_columns(
    nets: Networks,
    pairs: Pairs,
    rows: np.ndarray,
    change: np.ndarray,
    bodies: Bodies,
    silent: float,
    rectified: bool = False,
) -> Columns:
    """Return columns (B,): ``biotac_max_m``, largest node error of the translation, ``biotac_expected_m``, its
    estimate; the same of digit; ``x_m``, the contact's place along the gel, NaN if no node moves by ``silent`` m.
    rows : (B,) indices into the pairs' contacts; change : (B, e) counts, as read; rectified : true if without signs"""
    biotac, digit = nets.likely_latents(nets.encode_signal(change, rectified), rectified)
    answers = {SOURCE: nets.decode_source(biotac), TARGET: nets.decode_target(digit)}
    truth = {name: true_displacement(pairs, name, rows) for name in answers}
    found = {f"{name}_max_m": accuracy.max_error(answer, truth[name]) for name, answer in answers.items()}
    expected = nets.expected_error(change, rectified)
    found |= {f"{name}_expected_m": expected[:, index] for index, name in enumerate(SURFACES)}
    return found | {"x_m": contact_center(answers[TARGET], bodies.digit.rest, silent)[:, 0]}


FORCE_FROM = 0.2  # N: below, the share of an error says nothing (assumed)
PRESSURE_FROM = 550.0  # Pa: below, a real finger may not touch (docs/sources.md, BioTac read-out)
PEAK_FROM = 0.3e-3  # m: as much of the peak depth


def mesh_columns(name: str, found: np.ndarray, true: np.ndarray, depth: accuracy.Depth = accuracy.height) -> Columns:
    """Return errors of displacement found (C, n, 3) m from the true one: ``rms_um`` of moving nodes, ``max_um``,
    ``core_height_um``, ``peak_depth_percent`` (NaN for true peaks below PEAK_FROM). name : prefix of the columns
    depth : function from displacement (C, n, 3) m to depth (C, n) m, by which core and peak are found"""
    metrics = accuracy.mesh_metrics(found, true, depth)
    deep = depth(true).max(-1) > PEAK_FROM
    metrics["peak_depth_percent"] = np.where(deep, metrics["peak_depth_percent"], np.nan)
    return {f"{name}_{metric}": values for metric, values in metrics.items()}


def digit_columns(name: str, found: np.ndarray, patch: np.ndarray, bodies: Bodies) -> Columns:
    """Compare the contact patch of gels found (C, M, 3) m with the true patch (C, M) bool: ``iou``, intersection over
    union (NaN below LEAST_PATCH true nodes), ``position_mm`` between middles. name : prefix of the columns"""
    predicted = contact_patch(found, bodies.digit)
    with np.errstate(invalid="ignore", divide="ignore"):
        overlap = (predicted & patch).sum(-1) / (predicted | patch).sum(-1)
        places = bodies.digit.rest[:, [0, 2]]
        middles = [(each @ places) / each.sum(-1, keepdims=True) for each in (predicted, patch)]
    large = patch.sum(-1) >= LEAST_PATCH
    return {
        f"{name}_iou": np.where(large, overlap, np.nan),
        f"{name}_position_mm": 1e3 * accuracy.lengths(middles[0] - middles[1]),
    }


def _skin_offset(found: np.ndarray, true: np.ndarray, bodies: Bodies) -> np.ndarray:
    """Return the distance (C,) m, on the unrolled pad, of the dents' middles of skins found and true (C, N, 3) m."""
    on_pad = np.isfinite(bodies.unrolled[:, 0])
    places = bodies.unrolled[on_pad]
    first, second = (accuracy.core_center(accuracy.lengths(each[:, on_pad]), places, 0.0) for each in (found, true))
    return accuracy.lengths(first - second)


BINS = (0.1e-3, 0.3e-3, 0.6e-3, 0.9e-3, 1.2e-3)  # m, of depth on the BioTac, the sensor that is read (assumed)

MEDIANS = ("position_mm", "percent")
BASELINES = {"MVB": "baseline_biotac", "S2MPN": "baseline_biotac", "D2B": "baseline_biotac"}


def in_bins(values: np.ndarray, depth: np.ndarray, indenter: np.ndarray, median: bool = False) -> float | None:
    """Return the mean over bins of depth of the mean over indenters of mean (or median) values; None without any.
    values : (C,), NaN left out; depth : (C,) m; indenter : (C,) int, index of each contact's indenter"""
    middle = np.median if median else np.mean
    bins = []
    for low, high in zip(BINS[:-1], BINS[1:], strict=True):
        inside = np.isfinite(values) & (depth >= low) & (depth < high)
        each = [middle(values[inside & (indenter == kind)]) for kind in np.unique(indenter[inside])]
        if each:
            bins.append(np.mean(each))
    return float(np.mean(bins)) if bins else None


def metric_rows(
    columns: Columns, pairs: Pairs, rows: np.ndarray, set_name: str, targets: dict[str, float]
) -> list[Row]:
    """Return a report's row for each metric over the contacts rows (C,) that do not slide, averaged by `in_bins`.
    columns : (C,) by metric; targets : limits by metric, in its unit; set_name : name of these contacts"""
    still = ~pairs.slide[rows].any(-1)
    depth, indenter = pairs.depth_biotac[rows], pairs.indenter[rows]
    found = []
    for name, values in columns.items():
        if not name.startswith("baseline_"):
            at = np.where(still, values, np.nan)
            value = in_bins(at, depth, indenter, is_median(name))
            baseline = in_bins(np.where(still, _baseline(columns, name), np.nan), depth, indenter, is_median(name))
            found.append(metric_row(name, value, baseline, targets.get(name), set_name))
    return found


def is_median(name: str) -> bool:
    """Return true if a metric is summarised by its median: distances, and relative errors of forces and peaks."""
    return name.endswith(MEDIANS)


def _baseline(columns: Columns, name: str) -> np.ndarray:
    step, metric = name.split("_", 1)
    of = "baseline" if metric == "counts" else BASELINES.get(step, "baseline_digit")
    nothing = columns.get(f"{of}_{metric}")
    return np.full(len(columns[name]), np.nan) if nothing is None else nothing


def metric_row(name: str, value: float | None, baseline: float | None, target: float | None, set_name: str) -> Row:
    """Return one row of a report; the unit is the last word of name. Larger is better for an intersection over union.
    value, baseline, target : the metric, that without a translation, its limit, or None; set_name : of contacts"""
    unit = name.rsplit("_", 1)[1].replace("percent", "%").replace("iou", "1")
    target = None if value is None else target
    return row(name, value, unit, target, baseline=baseline, of=set_name, at_least=name.endswith("iou"))


def slices(pairs: Pairs, rows: np.ndarray) -> Iterable[tuple[str, np.ndarray]]:
    """Yield a name and a mask (C,) over ``rows`` (C,) for each subset: below 0.1 mm deep, by depth, deeper, sliding."""
    depth, sliding = pairs.depth_biotac[rows], pairs.slide[rows].any(-1)
    yield "lighter than 0.1 mm", (depth < BINS[0]) & ~sliding
    for low, high in zip(BINS[:-1], BINS[1:], strict=True):
        yield f"{1e3 * low:g} to {1e3 * high:g} mm", (depth >= low) & (depth < high) & ~sliding
    yield "deeper than 1.2 mm", (depth >= BINS[-1]) & ~sliding
    yield "sliding", sliding
