"""The model card for people: what the networks were trained on, their errors, their best and worst answers."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tactile_core import sensors
from tactile_core.accuracy import Row
from tactile_core.files import atomic
from tactile_core.simulation.pairs_file import Pairs
from tactile_core.training.step_errors import mesh_columns, true_displacement
from tactile_core.translation.translator import Translator

from ..measured_rows import png_of, short, write_table
from .test_set import SEED, as_read

PICTURE = "translation_cases.png"
PURPOSE = """\
The networks take the changes of a BioTac's 19 electrodes to the contact that most plausibly caused them, and to the
deformation of the skin and of a DIGIT's gel. `tactile convert` and `tactile.translate` run them; nothing needs to be
set. This page says how far to trust the result; `docs/translation.csv` holds every number that was measured.
"""
# Words of an estimate, its row, and what the number is followed by.
EXPECTED = (
    ("place of the contact on the gel", "likely_place_mm", " mm"),
    ("force", "likely_force_size_percent", " %"),
    ("depth of the gel's dent", "likely_peak_percent", " %"),
    ("overlap with the true contact patch, best is 1", "likely_iou", ""),
)
SHALLOW, DEEP = "0.1 to 0.3 mm deep", "deeper than 0.3 mm"  # in the sets of these rows
NAMES = """\
| name | meaning |
|---|---|
| MVB, MVD, SVB | autoencoders of the BioTac's mesh, the DIGIT's mesh, the signals |
| S2MPN | network from signals to the BioTac's mesh |
| M2MPN, D2B | networks from the BioTac's mesh to the DIGIT's, and back |
| chain | S2MPN, then M2MPN: from signals to the DIGIT's mesh |
| B2S, D2S | from the BioTac's or the DIGIT's mesh back to signals |
| likely, mean | the most plausible contact of the posterior, and the posterior's mean |
| solved | the likely contact, solved on the gel by contact mechanics |
| followed, sequence | recordings whose contact is tracked through time |
| peak, core | depth of the dent; nodes deeper than 30 % of it |
| place, position | centre of the contact |
| iou | intersection over union of the true and the estimated contact patch |
"""
LIMITS = """\
## Limits

- All truth here is simulated. Real recordings are judged apart (`--recordings`): there only the fluid's pressure is
  known, and how strong, silent and smooth the translation is can be measured, not how right a deformation is.
- The size of the electrodes and the BioTac's filling are assumed (see `docs/mechanics.md` and
  `tactile_core/sensors/`). A real unit's gains differ from the simulated ones by half: `tactile adapt` fits them.
- Rectified recordings are read by networks that know they are; expect larger errors, as their bounds say.
- Light touches are lost in the electrodes' noise: see the shallow contacts above.
- Contacts beyond the DIGIT's gel, deeper than trained, or with shapes far from the nine indenters are not learned.
"""


def expected(rows: Sequence[Row]) -> list[str]:
    """Return the lines of a small table: the errors of shallow and of deeper contacts, each beside its baseline."""
    by_set = {(row["name"], part): row for row in rows for part in (SHALLOW, DEEP) if part in (row["set"] or "")}
    lines = [
        f"| estimate, median error | {SHALLOW} | nearest example | {DEEP} | nearest example |",
        "|---|---|---|---|---|",
    ]
    for words, name, unit in EXPECTED:
        found = [by_set[name, part] for part in (SHALLOW, DEEP) if (name, part) in by_set]
        numbers = [number for row in found for number in (row["value"], row["baseline"])]
        shown = [short(number) + unit for number in numbers]
        lines += [f"| {words} | {' | '.join(shown)} |"] if len(found) == 2 else []
    return lines


def write_model_card(
    path: Path,
    rows: list[Row],
    translator: Translator,
    pairs: Pairs,
    apart: Sequence[Translator] = (),
) -> None:
    """Write the card as Markdown, its rows as CSV and the picture of cases beside it.

    apart : the networks of the unseen rows
    """
    card = translator.card
    unseen = [each for each in rows if (each["set"] or "").startswith("unseen")]
    text = [
        "# Model card: the networks that translate touch",
        "",
        PURPOSE,
        "## What to expect",
        "",
        *expected(rows),
        "",
        LIMITS,
        "## Conditions",
        "",
        _training(card),
        f"Test set: {len(pairs.press)} contacts of {len(np.unique(pairs.press))} presses, solved by the full tier of"
        " mechanics on both sensors; signals read with 1.5 counts of noise and gains 10 % off. Depth bins (0.1-0.3,"
        " 0.3-0.6, 0.6-0.9, 0.9-1.2 mm on the BioTac) and indenters count alike, no slides; baseline: no deformation.",
        "",
        "Made by `scripts/evaluate_translation.py --card`; the numbers are of the weights that ship.",
        "",
        "## Cases",
        "",
        f"![best, median and worst contact]({PICTURE})",
        "",
        "From signals to the DIGIT's gel: the contact with the least, the median and the largest error over the true"
        " deformation's size, among those the gel is moved 0.1 mm by and more.",
        "",
        "## Names in the rows",
        "",
        NAMES,
        *([_apart([each.card["options"] for each in apart]), ""] if apart else []),
    ]
    atomic.write_bytes(path, "\n".join(text).encode())
    parts = {"test contacts": [each for each in rows if each not in unseen], "kept apart": unseen}
    write_table(path.with_suffix(".csv"), parts)
    atomic.write_bytes(path.with_name(PICTURE), _cases(translator, pairs))


def _training(card: dict) -> str:
    data, options = card["pairs"], card["options"]
    counts = ", ".join(f"{number} for {what}" for what, number in data["contacts"].items())
    names = ", ".join(json.loads(data["indenters"]))
    return (
        f"Data: {sum(data['contacts'].values())} simulated paired contacts ({counts}; no press in two of them), fast"
        f" tier with friction and the learned correction, sha256 `{data['sha256'][:16]}...`. Indenters: {names}.\n"
        f"Latents: signal {options['latent_signal']}, BioTac {options['latent_biotac']},"
        f" DIGIT {options['latent_digit']};"
        f" KL weight {options['beta']:g}; seed {card['seed']}; torch {card['versions']['torch']}.\n"
    )


def _apart(trainings: list[dict]) -> str:
    each = []
    for options in trainings:
        left = [*options["without"]]
        if options["without_below_x"] is not None:
            left.append(f"the pad beyond x = {1e3 * options['without_below_x']:g} mm")
        each.append(f"one without {' and '.join(left)} for {options['effort']:g} of the usual epochs")
    return (
        f"Rows of unseen sets are of networks of their own: {', '.join(each)};"
        " the weights that ship have seen all of it."
    )


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
