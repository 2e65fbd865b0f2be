"""Measure the way from the BioTac's mesh to the DIGIT's by mechanics alone beside M2MPN, also at untrained places.

No network's number is in it, so the region that `evaluate_translation.py --held-out` keeps from networks is like any
other. ``mechanics-known``: the contact is looked for among the training's bodies, the one pressed among them;
``mechanics-unknown``: that one is left out; ``mechanics-ball``: a ball alone, of any radius.
"""

from __future__ import annotations

import contextlib
from pathlib import Path

import numpy as np

from benchmarks.make.full_pairs import REGION_X
from tactile_core.accuracy import Row
from tactile_core.errors import TactileError
from tactile_core.geometry.indenters import Indenter
from tactile_core.mechanics.skin_contact import BodyContact, likely_contacts
from tactile_core.simulation.pairs_file import Pairs
from tactile_core.simulation.scene import load_scene
from tactile_core.training.step_errors import (
    Bodies,
    Columns,
    digit_columns,
    in_bins,
    joined,
    mesh_columns,
    metric_rows,
    true_displacement,
)

SCENE = Path(__file__).resolve().parents[3] / "scenes" / "training"
SHARE = 2 / 3  # of the baseline, at most, in a part of the pad never trained on (docs/sources.md, Targets)
WAYS = "mechanics-known", "mechanics-unknown", "mechanics-ball"


def mechanics_rows(pairs: Pairs, bodies: Bodies) -> list[Row]:
    """Rows over contacts that press without sliding, in the whole pad and in the region at the tip."""
    rows = np.flatnonzero(~pairs.slide.any(axis=1))
    pressed = {spec.name: spec.build() for spec in load_scene(SCENE)[0].indenters}
    columns = joined(_columns(pairs, row, pressed, bodies) for row in rows)
    tip = pairs.place[rows, 0] < REGION_X
    found = metric_rows(columns, pairs, rows, "seen indenters", {})
    if tip.any():
        at_tip = {name: values[tip] for name, values in columns.items()}
        baseline = in_bins(at_tip["baseline_digit_rms_um"], pairs.depth_biotac[rows[tip]], pairs.indenter[rows[tip]])
        targets = {} if baseline is None else {f"{way}_rms_um": SHARE * baseline for way in WAYS}
        found += metric_rows(at_tip, pairs, rows[tip], "the tip, by mechanics alone", targets)
    return found


def _columns(pairs: Pairs, row: int, pressed: dict[str, Indenter], bodies: Bodies) -> Columns:
    """Metrics of one contact; one that is not found or not borne by the gel counts as no displacement."""
    skin, gel = (true_displacement(pairs, sensor, np.array([row])) for sensor in ("biotac", "digit"))
    own, contacts = pressed[pairs.indenter_names[pairs.indenter[row]]], list[BodyContact]()
    with contextlib.suppress(TactileError):
        contacts = likely_contacts(skin[0].astype(float), pressed.values())
    chosen = {
        "mechanics-known": contacts,
        "mechanics-unknown": [each for each in contacts if each.body is not own],
        "mechanics-ball": [each for each in contacts if each.body not in pressed.values()],
    }
    found = mesh_columns("baseline_digit", np.zeros_like(gel), gel)
    for way in WAYS:
        answer = np.zeros_like(gel)
        with contextlib.suppress(TactileError, IndexError):
            answer[0] = chosen[way][0].on_gel().displacement
        found |= mesh_columns(way, answer, gel) | digit_columns(way, answer, pairs.contact_patch_digit[[row]], bodies)
    return found
