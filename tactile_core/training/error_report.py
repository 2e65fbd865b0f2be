"""Report a training's errors on presses it never saw, and its loss curves. measure : a `Measure`, in all functions"""

from __future__ import annotations

import csv
import io
from functools import cached_property
from pathlib import Path

import numpy as np
import torch

from .. import accuracy
from ..accuracy import Row
from ..sensors import TARGET
from ..translation.card import KINDS, SURFACES, fit_bounds, silent_level
from ..translation.layers import DISTANCES
from ..translation.networks import Networks
from ..translation.weights import write_bytes
from .data import Contacts
from .stages import Model
from .step_errors import (
    Bodies,
    Columns,
    error_columns,
    joined,
    mesh_columns,
    metric_row,
    metric_rows,
    parts,
    translation_metrics,
    true_displacement,
)
from .surface_codec import SILENT

QUANTILES = (0.5, 0.9, 0.95, 0.99, 0.999)
# The shapes that the prototype (docs/sources.md, Networks) was trained on: three spheres and a flat cylinder.
PROTOTYPE = ("sphere_3.5mm", "sphere_7mm", "sphere_14mm", "short_cylinder_7mm")
SHARES = dict(zip(KINDS, (0.0, 1.0), strict=True))  # of frames that lose their sign
SILENT_FRAMES = 2048  # two of them lie above the outermost quantile


class Measure:
    """The exported networks, and the test presses: their rows (C,), and their signals change (C, e) counts with noise.
    bodies : surfaces of the sensors; seed : the training's, by which noise is drawn"""

    def __init__(self, networks: Networks, contacts: Contacts, bodies: Bodies, seed: int) -> None:
        self.networks, self.contacts, self.bodies, self.seed = networks, contacts, bodies, seed
        self.rows = contacts.split.test
        self.change = self.read(self.rows, 2)

    def read(self, rows: np.ndarray, stream: int) -> np.ndarray:
        """Return signed signals (C, e) counts, with noise, of contacts ``rows`` (C,); stream : number that seeds it"""
        return self.contacts.read(rows, np.random.default_rng([self.seed, stream]))[:, :-1]

    @cached_property
    def silence(self) -> dict[str, np.ndarray]:
        """Largest displacements biotac_m and digit_m, and force_N, all (T,), of T frames of noise, each alone."""
        signal = self.networks.encode_signal(self.read(np.full(SILENT_FRAMES, SILENT), 3))
        state = self.networks.contact(signal)
        biotac, digit = self.networks.latents(signal, state)
        return {
            "biotac_m": accuracy.lengths(self.networks.decode_source(biotac)).max(-1),
            "digit_m": accuracy.lengths(self.networks.decode_target(digit)).max(-1),
            "force_N": accuracy.lengths(self.networks.force_in(state, biotac)),
        }


def error_rows(measure: Measure, model: Model) -> list[Row]:
    """Return the card's rows of errors (`accuracy.row`) for each step, the chain and the direct network."""
    pairs, rows = measure.contacts.pairs, measure.rows
    columns = translation_metrics(measure.networks, pairs, rows, measure.change, measure.bodies)
    columns |= direct_columns(model, measure)
    found = [*signal_rows(measure), *metric_rows(columns, pairs, rows, "test presses", {}), *silence_rows(measure)]
    among = np.isin(np.array(pairs.indenter_names)[pairs.indenter[rows]], PROTOTYPE)
    if not among.any():
        return found
    few = {name: np.where(among, column, np.nan) for name, column in columns.items()}
    return [*found, *metric_rows(few, pairs, rows, "test presses, shapes of the prototype", {})]


def direct_columns(model: Model, measure: Measure) -> Columns:
    """Return `mesh_columns`, named "direct", of ``model.directly``, the single network that the chain must beat."""
    pairs = measure.contacts.pairs

    def answer(part: slice) -> Columns:
        """Return the errors of some contacts."""
        change = torch.from_numpy(measure.change[part])
        with torch.no_grad():
            latent = model.directly(torch.cat([change, torch.zeros(len(change), 1)], -1))
            found = model.MVD.surface.frame.to_shared(model.direct_decoder.field(latent).numpy())
        return mesh_columns("direct", found, true_displacement(pairs, TARGET, measure.rows[part]))

    return joined(answer(part) for part in parts(len(measure.rows)))


def signal_rows(measure: Measure) -> list[Row]:
    """Return the row of SVB's error against the noisy signal, rms over electrodes, mean over contacts, counts.
    Baseline: the signal's own rms."""
    nets = measure.networks
    error = nets.decode_signal(nets.encode_signal(measure.change)) - measure.change
    value, baseline = (accuracy.mean(np.sqrt(np.square(array).mean(-1))) for array in (error, measure.change))
    return [metric_row("SVB_rms_counts", value, baseline, None, "test presses")]


def silence_rows(measure: Measure) -> list[Row]:
    """Return report rows of mean motion, um, and force, N, in frames without contact; the baseline is 0."""
    largest = [(f"silence_{name}_max_um", 1e6 * measure.silence[f"{name}_m"]) for name in SURFACES]
    named = [*largest, ("silence_force_N", measure.silence["force_N"])]
    return [metric_row(name, accuracy.mean(value), 0.0, None, "noise alone") for name, value in named]


def silence_quantiles(measure: Measure) -> dict[str, list[float]]:
    """Return quantiles of `Measure.silence` by its names, and "levels", their shares: smaller results may be noise."""
    return {"levels": list(QUANTILES), **{name: quantiles(value) for name, value in measure.silence.items()}}


def quantiles(values: np.ndarray) -> list[float]:
    """Compute the quantiles of values (n,) at QUANTILES, six digits."""
    return [float(f"{quantile:.6g}") for quantile in np.quantile(values, QUANTILES)]


def distance_quantiles(measure: Measure) -> dict[str, dict[str, list[float]]]:
    """Return quantiles at QUANTILES of `Networks.signal_distance` on validation presses, by kind ("signed",
    "rectified"), then by distance. Rectified signals scatter more, and would hide unusual signed ones."""
    contacts, found = measure.contacts, {}
    for kind, share in SHARES.items():
        random = np.random.default_rng([measure.seed, 5])
        signal = contacts.read(contacts.split.validation, random, share, contacts.options.unit)
        distance = measure.networks.signal_distance(signal[:, :-1], bool(share))
        found[kind] = {name: quantiles(getattr(distance, name)) for name in DISTANCES}
    return found


def fit_error_bounds(measure: Measure, silence: dict[str, list[float]]) -> dict[str, dict[str, list[float]]]:
    """Fit `card.fit_bounds` on validation presses; return numbers by kind ("signed", "rectified"), then by surface
    ("biotac", "digit"). silence : result of `silence_quantiles`"""
    nets, contacts, rows = measure.networks, measure.contacts, measure.contacts.split.validation
    silent, bounds = silent_level(silence, "digit_m"), {}
    for kind, share in SHARES.items():
        signal = contacts.read(rows, np.random.default_rng([measure.seed, 6]), share, contacts.options.unit)
        columns = joined(
            error_columns(nets, contacts.pairs, rows[part], signal[part, :-1], measure.bodies, silent, bool(share))
            for part in parts(len(rows))
        )
        errors = {name: (columns[f"{name}_max_m"], columns[f"{name}_expected_m"]) for name in SURFACES}
        bounds[kind] = {name: fit_bounds(*error, columns["x_m"]) for name, error in errors.items()}
    return bounds


def write_log(path: Path, history: list[list]) -> None:
    """Write the losses of every epoch as CSV; history : rows (stage, epoch, training loss, validation loss)"""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["stage", "epoch", "train", "validation"])
    writer.writerows([stage, epoch, f"{train:.6g}", f"{validation:.6g}"] for stage, epoch, train, validation in history)
    write_bytes(path, text.getvalue().encode())


def draw_losses(path: Path, history: list[list]) -> None:
    """Draw losses over epochs, logarithmic, a plot for each stage, as PNG; history : rows as for `write_log`"""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    stages = list(dict.fromkeys(stage for stage, *_ in history))
    columns = (len(stages) + 1) // 2
    figure = Figure(figsize=(3.2 * columns, 5.0), layout="constrained")
    for index, stage in enumerate(stages):
        axes = figure.add_subplot(2, columns, index + 1)
        rows = [row for row in history if row[0] == stage]
        for column, label in ((2, "training"), (3, "validation")):
            axes.semilogy([row[1] + 1 for row in rows], [row[column] for row in rows], label=label)
        axes.set(title=stage, xlabel="epoch", ylabel="loss (no answer: 1)" if stage != "chain" else "loss")
    figure.axes[0].legend()
    buffer = io.BytesIO()
    FigureCanvasAgg(figure).print_png(buffer)
    write_bytes(path, buffer.getvalue())
