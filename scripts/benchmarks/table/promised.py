"""Compare the bounds that mechanics and translation state for their errors with measured errors, all held out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.measure_tiers import FAST_EDGES
from benchmarks.mechanics.contact_tiers import SENSORS, by_depth, fast_misses
from benchmarks.translation.test_set import SEED, as_read
from tactile_core.accuracy import Row, row
from tactile_core.simulation.scene import load_scene
from tactile_core.training.step_errors import error_columns, our_bodies
from tactile_core.translation.card import SURFACES
from tactile_core.translation.translate import load_translator

from .method import EVERY, TRAINING, test_contacts

COVER = 0.9, 0.98  # least and largest share of contacts below a right bound of 95 % (assumed)
FEWEST = 200  # contacts for a target: with fewer the share is 1.5 % off and more by chance
TABLE = "| what | among | contacts | bound, median | measured, median | below the bound |", "|---|---|---|---|---|---|"
FOLDS = 5


@dataclass(frozen=True)
class Promise:
    """A stated bound that 95 % of errors should keep, on C contacts. bound, found : (C,) in ``unit``, bounds and errors
    name : of the error; groups : (C,), each contact's group in the table; of : names the contacts, a text"""

    name: str
    unit: str
    bound: np.ndarray
    found: np.ndarray
    groups: Sequence[str]
    of: str

    def covered(self, among: np.ndarray | None = None) -> float:
        """Return the share, 0 to 1, of contacts whose error is within its bound; among : (C,) bool, None for all"""
        held = self.found <= self.bound
        return float((held if among is None else held[among]).mean())

    def row(self) -> Row:
        """Return a report row of the share of contacts within their bounds, with a target if there are enough."""
        share, enough = self.covered(), len(self.found) >= FEWEST
        least = COVER[0] if enough else None
        found = row(f"promised_{self.name}_covered", share, "1", least, of=self.of, at_least=True)
        return found | {"ok": COVER[0] <= share <= COVER[1]} if enough else found

    def lines(self) -> Iterator[str]:
        """Yield a Markdown table's rows: all contacts, then each group."""
        names = np.array(self.groups)
        for name in ["all", *sorted(set(self.groups))]:
            here = np.ones(len(names), bool) if name == "all" else names == name
            bound, found = (f"{np.median(values[here]):.3g} {self.unit}" for values in (self.bound, self.found))
            yield f"| {self.name} | {name} | {here.sum()} | {bound} | {found} | {self.covered(here):.1%} |"


def promised(quick: bool) -> tuple[list[Row], dict[str, list[str]]]:
    """Return rows of all bounds' coverage, and heading -> lines of the page's table of it; quick : fewer contacts"""
    promises = [*of_mechanics(quick), *of_translation(quick)]
    lines = [line for promise in promises for line in promise.lines()]
    return [promise.row() for promise in promises], {TABLE[0]: [*TABLE, *lines]}


def of_mechanics(quick: bool) -> Iterator[Promise]:
    """Yield bounds and errors of the fast tier's shape and of its force, for each sensor. quick : fewer contacts"""
    pairs, (scene, _) = test_contacts(quick), load_scene(TRAINING)
    for sensor in SENSORS:
        misses = list(fast_misses(sensor, pairs, scene))
        bounds = np.empty((len(misses), 2))
        for fold in range(FOLDS):
            table = by_depth([each for each in misses if each.press // EVERY % FOLDS != fold], FAST_EDGES)
            for number, each in enumerate(misses):
                if each.press // EVERY % FOLDS == fold:
                    entry = next((one for one in table if each.share <= one["depth_share_to"]), table[-1])
                    bounds[number] = entry["shape_95_um"], 100 * entry["force_95"]
        edges = [next(edge for edge in FAST_EDGES if each.share <= edge + 1e-6) for each in misses]
        depths = [f"to {edge:g} of the thickness" for edge in edges]
        of = f"{len(misses)} test contacts, five folds by press"
        found = np.array([(1e6 * each.shape, 100 * each.force) for each in misses])
        for k, (what, unit) in enumerate((("shape", "um"), ("force", "%"))):
            yield Promise(f"fast_{sensor}_{what}", unit, bounds[:, k], found[:, k], depths, of)


def of_translation(quick: bool) -> Iterator[Promise]:
    """Yield bounds and errors of the largest node error of translations, for each surface. quick : fewer contacts"""
    pairs, translator = test_contacts(quick), load_translator()
    change, rows = as_read(pairs.signal, SEED), np.arange(len(pairs.press))
    columns = error_columns(translator.nets, pairs, rows, change, our_bodies(), translator.silent("digit_m"))
    names = [pairs.indenter_names[number] for number in pairs.indenter]
    of = f"{len(rows)} test contacts, largest node error"
    for surface in SURFACES:
        bound = translator.bound(columns[f"{surface}_expected_m"], columns["x_m"], surface)
        yield Promise(f"translation_{surface}", "um", 1e6 * bound, 1e6 * columns[f"{surface}_max_m"], names, of)
