"""What the bounds of a translation would cover if their factors were found anew, on fresh pairs and by place."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from tactile_core.evaluation.readings import as_read
from tactile_core.evaluation.test_set import SEED
from tactile_core.evaluation.translation import Columns, error_columns, joined, parts
from tactile_core.network_sizes import SURFACES
from tactile_core.paired_contacts import Pairs, read_pairs
from tactile_core.rows import Row, row
from tactile_core.translate import Translator, load_translator

from .method import TEST_SET
from .promise import COVER
from .translation import plain_signals

LEVEL = 0.95
EDGES = -14e-3, -8e-3, -2e-3  # m, x of the answer's contact: tip, first and last electrodes, base (assumed)
TEXT = """
The bounds' factors are one number a surface, found on the training's validation presses: right on average over contacts
like those, but too wide over the electrodes and too narrow beyond them, while the test contacts lie toward the tip by
half. Found anew without training, on {count} fresh pairs of seed {seed} (split conformal prediction in groups, by where
the answer lies along the finger), and tried on the test contacts, which took no part:

| bound | among | pairs | test contacts | factor | pairs below, shipped | test below, shipped | test below, anew |
|---|---|---|---|---|---|---|---|
"""


def recalibrated(file: Path) -> tuple[list[Row], str]:
    """Rows and a table; file : pairs of another seed than the training's."""
    translator, pairs, test = load_translator(), read_pairs(file), read_pairs(TEST_SET)
    fresh, held = answers(translator, pairs, SEED + 1), answers(translator, test, SEED)
    rows, lines = [], []
    for surface in SURFACES:
        found, told = of_surface(surface, fresh, held, translator.card["error_bounds"]["signed"][surface])
        rows.append(found)
        lines += told
    text = TEXT.format(count=f"{len(pairs.press):,}", seed=pairs.attributes["seed"])
    return rows, text + "\n".join([*lines, ""])


def answers(translator: Translator, pairs: Pairs, seed: int) -> Columns:
    """Largest errors and expected ones of every contact, and x of the answer, m; NaN where it is silent."""
    change, rows = as_read(pairs.signal, seed), np.arange(len(pairs.press))
    nets = translator.nets
    found = joined(error_columns(nets, pairs, rows[part], change[part], False) for part in parts(len(rows)))
    places = [translator(plain_signals(change[part])).contact_center[:, 0] for part in parts(len(rows))]
    return found | {"x": np.concatenate(places)}


def of_surface(surface: str, fresh: Columns, held: Columns, shipped: float) -> tuple[Row, list[str]]:
    """The row of what the new bounds cover of the test contacts, and a line a group."""
    ratios = [each[f"{surface}_max_m"] / each[f"{surface}_expected_m"] for each in (fresh, held)]
    below, lines = np.zeros(len(ratios[1]), bool), []
    for name, *masks in groups(fresh["x"], held["x"]):
        of_fresh, of_held = (ratio[mask] for ratio, mask in zip(ratios, masks, strict=True))
        factor = float(np.quantile(of_fresh, min(1.0, LEVEL * (1 + 1 / len(of_fresh)))))
        below[masks[1]] = of_held <= factor
        shares = (of_fresh <= shipped), (of_held <= shipped), (of_held <= factor)
        told = " | ".join(f"{share.mean():.1%}" if len(share) else "" for share in shares)
        lines.append(f"| {surface} | {name} | {len(of_fresh)} | {len(of_held)} | {factor:.2f} | {told} |")
    share = float(below.mean())
    told = [f"{(ratio <= shipped).mean():.1%}" for ratio in ratios]
    lines.append(f"| {surface} | all | {len(ratios[0])} | {len(ratios[1])} | | {told[0]} | {told[1]} | {share:.1%} |")
    of = "test contacts, factors found anew by place"
    found = row(f"promised_recalibrated_{surface}_covered", share, "1", COVER[0], of=of, at_least=True)
    return found | {"ok": COVER[0] <= share <= COVER[1]}, lines


def groups(*places: np.ndarray) -> Iterator[tuple]:
    """Name of a group and its mask in each of the arrays of x, m."""
    yield "silent answers", *(np.isnan(x) for x in places)
    edges = -np.inf, *EDGES, np.inf
    for low, high in zip(edges[:-1], edges[1:], strict=True):
        name = f"x {1e3 * low:g} to {1e3 * high:g} mm" if np.isfinite([low, high]).all() else (
            f"x below {1e3 * high:g} mm" if np.isfinite(high) else f"x above {1e3 * low:g} mm"
        )  # fmt: skip
        yield name, *((x >= low) & (x < high) for x in places)
