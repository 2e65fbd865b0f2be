"""The model card for people: what the networks were trained on, their errors, their best and worst answers."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from tactile_core import sensors
from tactile_core.accuracy import Row
from tactile_core.files import atomic
from tactile_core.simulation.pairs_file import Pairs
from tactile_core.training.step_errors import mesh_columns, true_displacement
from tactile_core.translation.translator import Translator

from ..measured_rows import png_of, renew_tables, short, write_table
from .test_set import SEED, as_read

PICTURE = "translation_cases.png"
# Words of an estimate, its row, and what the number is followed by.
EXPECTED = (
    ("place of the contact on the gel", "likely_place_mm", " mm"),
    ("force", "likely_force_size_percent", " %"),
    ("depth of the gel's dent", "likely_peak_percent", " %"),
    ("overlap with the true contact patch, best is 1", "likely_iou", ""),
)
SHALLOW, DEEP = "0.1 to 0.3 mm deep", "deeper than 0.3 mm"  # in the sets of these rows
HEAD = f"| estimate, median error | {SHALLOW} | nearest example | {DEEP} | nearest example |"
CONDITIONS = "| condition | of these networks and contacts |", "|---|---|"


def expected(rows: Sequence[Row]) -> list[str]:
    """Return a Markdown table's lines: errors of contacts 0.1 to 0.3 mm deep and of deeper ones, beside baselines."""
    by_set = {(row["name"], part): row for row in rows for part in (SHALLOW, DEEP) if part in (row["set"] or "")}
    lines = [HEAD, "|---|---|---|---|---|"]
    for words, name, unit in EXPECTED:
        found = [by_set[name, part] for part in (SHALLOW, DEEP) if (name, part) in by_set]
        numbers = [number for row in found for number in (row["value"], row["baseline"])]
        shown = [short(number) + unit for number in numbers]
        lines += [f"| {words} | {' | '.join(shown)} |"] if len(found) == 2 else []
    return lines


def renew_model_card(
    page: Path, rows: list[Row], translator: Translator, pairs: Pairs, apart: Sequence[Translator] = ()
) -> None:
    """Renew the card ``page``: its tables, and CSV and picture beside it. rows : all that was measured; apart :
    networks kept from what the rows of unseen sets measure. Raises ValueError for a page without the tables."""
    conditions = [f"| {what} | {words} |" for what, words in _conditions(translator.card, pairs, apart)]
    renew_tables(page, {HEAD: expected(rows), CONDITIONS[0]: [*CONDITIONS, *conditions]})
    unseen = [each for each in rows if (each["set"] or "").startswith("unseen")]
    write_table(
        page.with_suffix(".csv"), {"test contacts": [each for each in rows if each not in unseen], "kept apart": unseen}
    )
    atomic.write_bytes(page.with_name(PICTURE), _cases(translator, pairs))


def _conditions(card: dict, pairs: Pairs, apart: Sequence[Translator]) -> Iterator[tuple[str, str]]:
    """Yield what the networks were trained on and measured with, in words."""
    data, options = card["pairs"], card["options"]
    counts = ", ".join(f"{number} for {what}" for what, number in data["contacts"].items())
    total = sum(data["contacts"].values())
    yield (
        "training data",
        f"{total} simulated paired contacts ({counts}), fast tier, sha256 `{data['sha256'][:16]}...`",
    )
    yield "indenters", ", ".join(json.loads(data["indenters"]))
    latents = ", ".join(f"{name} {options[f'latent_{name.lower()}']}" for name in ("signal", "BioTac", "DIGIT"))
    yield "latents", f"{latents}; KL weight {options['beta']:g}; seed {card['seed']}; torch {card['versions']['torch']}"
    yield "test contacts", f"{len(pairs.press)} of {len(np.unique(pairs.press))} presses"
    for kept in (each.card["options"] for each in apart):
        left, below = [*kept["without"]], kept["without_below_x"]
        left += [] if below is None else [f"the pad beyond x = {1e3 * below:g} mm"]
        yield "kept apart", f"networks without {' and '.join(left)}, for {kept['effort']:g} of the usual epochs"


def _cases(translator: Translator, pairs: Pairs) -> bytes:
    """Draw a PNG: true, translated and difference of the gel's depth, for three contacts."""
    from matplotlib.figure import Figure

    nets, gel = translator.nets, sensors.digit_surface()
    change = as_read(pairs.signal, SEED)
    found = nets.decode_target(nets.likely_latents(nets.encode_signal(change))[1])
    true = true_displacement(pairs, "digit", np.arange(len(change)))
    metrics = mesh_columns("chain", found, true) | mesh_columns("baseline", 0 * true, true)
    share = np.where(true[..., 1].max(1) >= 1e-4, metrics["chain_rms_um"] / metrics["baseline_rms_um"], np.nan)
    order = np.argsort(share)[: np.isfinite(share).sum()]
    names = pairs.indenter_names
    figure = Figure(figsize=(9, 9), layout="constrained")
    axes = figure.subplots(3, 3)
    for row, (word, contact) in enumerate(
        zip(("best", "median", "worst"), order[[0, len(order) // 2, -1]], strict=True)
    ):
        depth = [1e3 * each[contact, :, 1] for each in (true, found, found - true)]
        peak = np.abs(depth[0]).max()
        for ax, values, title in zip(axes[row], depth, ("true", "translated", "difference"), strict=True):
            drawn = ax.tripcolor(1e3 * gel.rest[:, 2], 1e3 * gel.rest[:, 0], gel.faces, values, shading="gouraud",
                                 cmap="RdBu_r", vmin=-peak, vmax=peak)  # fmt: skip
            ax.set(aspect="equal", title=title, xlabel="z, mm")
        axes[row, 0].set_ylabel(f"{word}: {names[pairs.indenter[contact]]}\nx, mm")
        figure.colorbar(drawn, ax=axes[row], label="depth, mm")
    return png_of(figure)
