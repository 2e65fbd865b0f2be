"""What a training achieved on presses it never saw, and its loss curves."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import torch

from .. import metrics
from ..networks import Networks
from ..weights import write_bytes
from .data import SILENT, Contacts
from .modules import compress
from .stages import Model

QUANTILES = (0.5, 0.9, 0.95, 0.99, 0.999)
ROWS = 128  # contacts at a time, to bound memory
SURFACES = ("biotac", "digit")
SILENT_FRAMES = 2048  # two of them lie above the outermost quantile


class Measure:
    """The exported networks on the test presses: signals read once with noise, once without.

    Every answer is given lazily in batches of (predicted, true) displacement, as meshes of all contacts are large.
    """

    def __init__(self, networks: Networks, contacts: Contacts, rest_digit: np.ndarray, seed: int) -> None:
        self.networks, self.contacts, self.rest, self.seed = networks, contacts, rest_digit, seed
        self.rows = contacts.split.test
        self.change = contacts.read(self.rows, np.random.default_rng([seed, 2]))
        self.clean = contacts.pairs.signal[self.rows]

    def true(self, surface: str, rows: np.ndarray) -> np.ndarray:
        """(B, n, 3) m of the contacts in these rows."""
        source = getattr(self.contacts, surface)
        return source.data[rows].astype(np.float32) * np.float32(source.scale)

    def batches(self, surface: str, latent: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Displacement decoded from latents of the test contacts, and the true one."""
        decode = getattr(self.networks, f"decode_{surface}")
        for start in range(0, len(self.rows), ROWS):
            part = slice(start, start + ROWS)
            yield decode(latent[part]), self.true(surface, self.rows[part])

    def encoded(self, surface: str) -> np.ndarray:
        """Latents of the true meshes of the test contacts."""
        encode = getattr(self.networks, f"encode_{surface}")
        parts = [self.rows[start : start + ROWS] for start in range(0, len(self.rows), ROWS)]
        return np.concatenate([encode(self.true(surface, part)) for part in parts])

    def from_modes(self, surface: str, modes: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Displacement from coefficients of the linear basis, and the true one."""
        source = getattr(self.contacts, surface)
        for start in range(0, len(self.rows), ROWS):
            true = self.true(surface, self.rows[start : start + ROWS])
            found = modes[start : start + ROWS] * np.float32(source.unit) @ source.basis.numpy()
            yield found.reshape(true.shape), true


def error_rows(measure: Measure, model: Model) -> list[metrics.Row]:
    """All rows of the card: each step of the chain, the chain, the direct network, each beside its null answer."""
    networks, contacts, rows = measure.networks, measure.contacts, measure.rows
    latent_signal = networks.encode_signal(measure.change)
    biotac, clean = networks.s2m(latent_signal), networks.s2m(networks.encode_signal(measure.clean))
    mesh = measure.encoded("biotac")
    with torch.no_grad():
        direct = model.direct(compress(torch.from_numpy(measure.change))).numpy()
    depth = metrics.lengths
    return [
        *signal_rows(measure, latent_signal),
        *metrics.mesh_rows("biotac_basis", measure.from_modes("biotac", contacts.biotac.modes[rows].numpy()), depth),
        *metrics.mesh_rows("digit_basis", measure.from_modes("digit", contacts.digit.modes[rows].numpy())),
        *metrics.mesh_rows("MVB", measure.batches("biotac", mesh), depth),
        *metrics.mesh_rows("MVD", measure.batches("digit", measure.encoded("digit"))),
        *metrics.mesh_rows("S2MPN", measure.batches("biotac", biotac), depth),
        *metrics.mesh_rows("S2MPN_no_noise", measure.batches("biotac", clean), depth),
        *metrics.mesh_rows("M2MPN", measure.batches("digit", networks.m2m(mesh))),
        *metrics.mesh_rows("chain", measure.batches("digit", networks.m2m(biotac))),
        *metrics.mesh_rows("chain_no_noise", measure.batches("digit", networks.m2m(clean))),
        *metrics.mesh_rows("direct", measure.from_modes("digit", direct)),
        *center_rows(measure, networks.m2m(biotac)),
        *metrics.force_rows("force_from_mesh", networks.force(mesh), contacts.pairs.force[rows]),
        *metrics.force_rows("force", networks.force(biotac), contacts.pairs.force[rows]),
        *silence_rows(measure),
    ]


def signal_rows(measure: Measure, latent: np.ndarray) -> list[metrics.Row]:
    """SVB: rms over electrodes of the reconstruction against the signal as read, averaged over contacts."""
    error = measure.networks.decode_signal(latent) - measure.change
    value, null = (metrics.mean(np.sqrt(np.square(array).mean(-1))) for array in (error, measure.change))
    return [metrics.row("SVB_rms", value, null, "counts")]


def center_rows(measure: Measure, latent_digit: np.ndarray) -> list[metrics.Row]:
    """Contact centre from the translated DIGIT mesh: against the true mesh's dent, and against the known place."""
    train, test = measure.contacts.split.train, measure.contacts.pairs.contact_center[measure.rows]
    null = np.nanmean(measure.contacts.pairs.contact_center[train], 0)
    parts = [
        [metrics.dent_center(mesh, measure.rest) for mesh in batch] for batch in measure.batches("digit", latent_digit)
    ]
    found, dent = (np.concatenate(centers) for centers in zip(*parts, strict=True))
    return [metrics.center_row("center_of_dent", found, dent, null), metrics.center_row("center", found, test, null)]


def silence(measure: Measure) -> dict[str, np.ndarray]:
    """What signals of noise alone are translated to, frame by frame: largest displacements (m) and the force (N)."""
    nets, rows = measure.networks, np.full(SILENT_FRAMES, SILENT)
    change = measure.contacts.read(rows, np.random.default_rng([measure.seed, 3]))
    biotac = nets.s2m(nets.encode_signal(change))
    return {
        "biotac_m": metrics.lengths(nets.decode_biotac(biotac)).max(-1),
        "digit_m": metrics.lengths(nets.decode_digit(nets.m2m(biotac))).max(-1),
        "force_N": metrics.lengths(nets.force(biotac)),
    }


def silence_rows(measure: Measure) -> list[metrics.Row]:
    """Means of `silence`; doing nothing gives zero."""
    values = silence(measure)
    rows = [metrics.row(f"silence_{name}_max", metrics.mean(1e6 * values[f"{name}_m"]), 0.0, "um") for name in SURFACES]
    return [*rows, metrics.row("silence_force", metrics.mean(values["force_N"]), 0.0, "N")]


def silence_quantiles(measure: Measure) -> dict[str, list[float]]:
    """Quantiles at QUANTILES of `silence`: what lies below them is no contact."""
    return {name: quantiles(value) for name, value in silence(measure).items()}


def quantiles(values: np.ndarray) -> list[float]:
    """At QUANTILES, six digits."""
    return [float(f"{quantile:.6g}") for quantile in np.quantile(values, QUANTILES)]


def validation_force(networks: Networks, contacts: Contacts, seed: int) -> float:
    """N, rms of the force's vector error on the validation presses, from signals as read."""
    rows = contacts.split.validation
    change = contacts.read(rows, np.random.default_rng([seed, 4]))
    force = networks.force(networks.s2m(networks.encode_signal(change)))
    return float(np.sqrt(np.square(metrics.lengths(force - contacts.pairs.force[rows])).mean()))


def distance_quantiles(measure: Measure) -> dict[str, list[float]]:
    """Quantiles at QUANTILES of `Networks.signal_distance` on the validation presses, read with noise."""
    rows = measure.contacts.split.validation
    change = measure.contacts.read(rows, np.random.default_rng([measure.seed, 5]))
    distance = measure.networks.signal_distance(change)
    values = {name: getattr(distance, name) for name in ("mahalanobis", "residual", "largest")}
    return {name: quantiles(value) for name, value in values.items()}


def write_log(path: Path, history: list[list]) -> None:
    """The losses of every epoch as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["stage", "epoch", "train", "validation"])
    writer.writerows([stage, epoch, f"{train:.6g}", f"{validation:.6g}"] for stage, epoch, train, validation in history)
    write_bytes(path, text.getvalue().encode())


def draw_losses(path: Path, history: list[list]) -> None:
    """One small picture a stage: training and validation loss over epochs, logarithmic."""
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
