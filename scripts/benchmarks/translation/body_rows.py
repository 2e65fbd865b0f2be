"""Measure the translation by the body that presses: the training's, random ones, large ones that are in no training.
Contacts are drawn as in training, but with another seed and these bodies, and solved by the fast tier on both sensors.
Baseline: the nearest example among the shipped test contacts, of the training's bodies; for the gel no displacement.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from benchmarks.table.translation_methods import plain_signals
from tactile_core.accuracy import Row, lengths, peak_depth_error, row
from tactile_core.jobs import solved_gel
from tactile_core.jobs.pairs import make_pairs
from tactile_core.simulation.pairs_file import Pairs, read_pairs
from tactile_core.training.step_errors import Bodies, true_displacement
from tactile_core.translation.gel_place import contact_normal
from tactile_core.translation.translator import Translation, Translator
from tactile_core.translation.trust_words import FIRM

from .contact_rows import left_of_nothing, metrics, nearest_example
from .test_set import SEED, as_read

SCENE = Path(__file__).resolve().parents[3] / "scenes" / "training" / "scene.toml"
COUNT, OWN_SEED = 300, 52  # contacts of each set; the training pairs have seed 0
METRICS = {"place_mm": "mm", "force_size_percent": "%", "peak_percent": "%", "iou": "1"}
# Diameters, mm. A plate touches a round finger where both are parallel, and the gel likewise: a ball of 2 m stands for
# it, whose lean turns the force alone. (A leaned plate itself would touch the gel by its edge.)
BALLS = {"ball_28mm": 28.0, "ball_100mm": 100.0, "plate": 2000.0}
FLAT = """format = "tactile-scene-1"
name = "large"
description = "Bodies much larger than the finger, which it meets as flat, or nearly so."
indenters = [
    BALLS
    {kind = "lying_cylinder", name = "cylinder_40mm", radius_mm = 20.0, edge_mm = 1.0, length_mm = 60.0},
]

""".replace(
    "BALLS", "\n".join(f'{{kind = "sphere", name = "{name}", radius_mm = {mm / 2}}},' for name, mm in BALLS.items())
)


def rows(network: Translator, known: Pairs, bodies: Bodies, count: int = COUNT) -> list[Row]:
    """Return rows of contacts of ``count`` presses of each set, and ``known_rows``: median errors of place, force (also
    of firm contacts alone), depth, median overlap, and mean error of the gel, divided by that of no displacement.
    known : contacts that the nearest example is taken from; bodies : surfaces of gel and skin"""
    text = SCENE.read_text(encoding="utf-8")
    scenes = {
        "the training's bodies": text, "random bodies": f"{text}random_bodies = 1.0\n", "large bodies": flat_scene(),
    }  # fmt: skip
    drawn = {name: pairs_of(scene, count) for name, scene in scenes.items()}
    found = [one for name, pairs in drawn.items() for one in _rows(name, network, pairs, known, bodies)]
    return found + known_rows(network, drawn["large bodies"])


def _normal_row(answer: Translation, pairs: Pairs, of: str) -> Row:
    """Return a row of the median angle between the skin's normals at the answer's dent and at the true one; baseline:
    the force's direction. of : the set"""
    true = contact_normal(true_displacement(pairs, "biotac", slice(None)), "biotac")
    with np.errstate(invalid="ignore"):  # no force where nothing touches
        ways = answer.contact_normal, answer.force / lengths(answer.force)[:, None]
    value, baseline = (float(np.nanmedian(np.degrees(np.arccos(np.clip((way * true).sum(1), -1, 1))))) for way in ways)
    return row("bodies_normal_deg", value, "deg", baseline=baseline, of=f"{of}; baseline: the force's direction")


def flat_scene() -> str:
    """Return the text of a scene with bodies so large that a fingertip meets them as flat, drawn as in training."""
    text = SCENE.read_text(encoding="utf-8")
    return FLAT + text[text.index("[pairs]") :]


def pairs_of(scene: str, count: int) -> Pairs:
    """Draw and solve contacts of ``count`` presses by the fast tier on both sensors; scene : a scene file's text"""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "scene.toml").write_text(scene, encoding="utf-8")
        make_pairs(folder, count, OWN_SEED, folder / "pairs.h5")
        return read_pairs(folder / "pairs.h5")


def _rows(name: str, network: Translator, pairs: Pairs, known: Pairs, bodies: Bodies) -> list[Row]:
    change = as_read(pairs.signal, SEED)
    answer, nearest = network(plain_signals(change)), nearest_example(known, change)
    errors = metrics("found", answer.displacement_digit, lengths(answer.force), pairs, bodies)
    errors |= metrics("nearest", *nearest, pairs, bodies)
    of = f"{len(change)} contacts of {name}"
    made = []
    for metric, unit in METRICS.items():
        value, baseline = (float(np.nanmedian(errors[f"{who}_{metric}"])) for who in ("found", "nearest"))
        made.append(row(f"bodies_{metric}", value, unit, baseline=baseline, of=of, at_least=metric == "iou"))
    firm = lengths(pairs.force) > FIRM
    if firm.any():
        off, baseline = (float(np.median(errors[f"{who}_force_size_percent"][firm])) for who in ("found", "nearest"))
        over = f"{firm.sum()} over {FIRM:g} N of {of}"
        made.append(row("bodies_firm_force_percent", off, "%", baseline=baseline, of=over))
    made.append(_normal_row(answer, pairs, of))
    true = true_displacement(pairs, "digit", slice(None))
    left, copied = (float(left_of_nothing(gel, true).mean()) for gel in (answer.displacement_digit, nearest[0]))
    return [*made, row("bodies_gel_left", left, "1", baseline=1.0, of=f"{of}; the nearest example: {copied:.2f}")]


def known_rows(network: Translator, pairs: Pairs) -> list[Row]:
    """Return rows of the gel's depth and error under the flat scene's balls, if the body is known to be that ball and
    solved for (``--gel ball:MM``); baseline: the translation. pairs : of the flat scene"""
    answer, made = vars(network(plain_signals(as_read(pairs.signal, SEED)))), []
    for name, diameter in BALLS.items():
        at = np.flatnonzero(pairs.indenter == pairs.indenter_names.index(name))
        arrays = {word: answer[word][at] for word in ("displacement_digit", "flags", "contact_center", "force")}
        if not len(at):
            continue
        gels = solved_gel.solved(arrays, ball=diameter / 2e3)["displacement_digit"], arrays["displacement_digit"]
        true, of = true_displacement(pairs, "digit", at), f"{len(at)} contacts of a {name}, known to be one"
        depth, before = (float(np.median(100 * np.abs(peak_depth_error(gel, true)))) for gel in gels)
        left, whole = (float(left_of_nothing(gel, true).mean()) for gel in gels)
        made += [row("bodies_known_peak_percent", depth, "%", baseline=before, of=of)]
        made += [row("bodies_known_gel_left", left, "1", baseline=whole, of=of)]
    return made
