"""Measure the contact estimated from signals, and the posterior that it is taken from, on contacts of known truth.

Median errors of place, force, depth of the deepest node and overlap of patches, of three answers: the most plausible
contact, the mean of the posterior, and the most plausible contact solved on the DIGIT (``convert --gel solved``). The
baseline is the nearest example: the contact of another press of the test set whose signals have the most similar
pattern, scaled to the size of these signals.
"""

from __future__ import annotations

import numpy as np

from tactile_core import accuracy, sensors
from tactile_core.accuracy import Row, row
from tactile_core.jobs import solved_gel
from tactile_core.simulation.pairs_file import Pairs
from tactile_core.training.step_errors import Bodies, Columns, digit_columns, true_displacement
from tactile_core.translation.card import PLACE
from tactile_core.translation.networks import Networks
from tactile_core.translation.posterior import FORCE_SCALE, Posterior, touches
from tactile_core.translation.simulated_likeness import recovered

# Targets of each frame alone (docs/sources.md, Targets):
# depths on the BioTac, mm -> largest median (least for the overlap).
SETS = {
    "0.1 to 0.3 mm deep": (0.1e-3, 0.3e-3, {"place_mm": 1.2, "force_size_percent": 18.0, "peak_percent": 25.0}),
    "deeper than 0.3 mm": (
        0.3e-3, np.inf, {"place_mm": 0.5, "force_size_percent": 6.0, "peak_percent": 18.0, "iou": 0.47},
    ),
}  # fmt: skip
# Of rectified signals: share of the true depth (120 of 254 um), mm, share of contacts (docs/sources.md, Targets).
RECTIFIED_PEAK, RECTIFIED_PLACE, RECTIFIED_SILENT = 120 / 254, 0.8, 0.05
REGIONS = {0.5: (0.45, 0.55), 0.9: (0.86, 0.94)}  # share of the posterior -> between which shares of truths lie in it
FELT = 0.1  # of a field's peak: nodes whose error counts in `left_of_nothing`
DRAWS = 200  # of each posterior: a share is known to .035 per contact, to .002 over 368 of them


def answer_rows(nets: Networks, pairs: Pairs, change: np.ndarray, bodies: Bodies) -> list[Row]:
    """Return rows of median errors of the three answers, beside the nearest example, on contacts that do not slide.
    change : (C, 19) counts, the pairs' signals as read; bodies : holds the gel's surface, for place and patch"""
    answers = _answers(nets, pairs, change, bodies)
    found, still = [], ~pairs.slide.any(-1)
    answers |= metrics("nearest", *nearest_example(pairs, change, pairs.press), pairs, bodies)
    for name, (least, most, targets) in SETS.items():
        inside = still & (pairs.depth_biotac >= least) & (pairs.depth_biotac < most)
        for metric in ("place_mm", "force_size_percent", "peak_percent", "iou"):
            likely, mean, solved, baseline = (
                _median(answers[f"{who}_{metric}"][inside]) for who in ("likely", "mean", "solved", "nearest")
            )
            unit, at_least = metric.rsplit("_", 1)[-1].replace("percent", "%").replace("iou", "1"), metric == "iou"
            of = f"{inside.sum()} contacts {name}; baseline: the nearest example"
            beside = {"baseline": baseline, "of": of}
            found.append(row(f"likely_{metric}", likely, unit, targets.get(metric), at_least=at_least, **beside))
            found.append(row(f"mean_{metric}", mean, unit, **beside))
            if metric != "force_size_percent":  # which solving takes as it is
                found.append(row(f"solved_{metric}", solved, unit, **beside))
    return found


def rectified_rows(nets: Networks, pairs: Pairs, change: np.ndarray, bodies: Bodies) -> list[Row]:
    """Return rows for signals that lost their sign: median depth of the gel and error of place, share of lost contacts.

    Contacts that slide are left out. Baseline of the depth: the true one, which a translation should reach.
    change : (C, 19) counts, the pairs' signals as read, before they lose their sign"""
    folded, unsigned = recovered(np.abs(change), np.ones(len(change), bool))
    read = nets.encode_signal(folded, unsigned)
    state = nets.contact(read, unsigned)
    gel = nets.decode_target(nets.latents(read, state, unsigned)[1])
    still = ~pairs.slide.any(-1)
    deep, truth = (
        1e6 * float(np.median(accuracy.height(each).max(1)[still]))
        for each in (gel, true_displacement(pairs, "digit", slice(None)))
    )
    place = digit_columns("read", gel, pairs.contact_patch_digit, bodies)["read_position_mm"]
    of = f"{still.sum()} contacts read without their signs"
    return [
        row("rectified_peak_um", deep, "um", RECTIFIED_PEAK * truth, baseline=truth,
            of=f"{of}; baseline: the true depth", at_least=True),
        row("rectified_place_mm", _median(place[still]), "mm", RECTIFIED_PLACE, of=of),
        row("rectified_silent", float((~touches(state))[still].mean()), "1", RECTIFIED_SILENT, of=of),
    ]  # fmt: skip


def posterior_rows(nets: Networks, pairs: Pairs, change: np.ndarray) -> list[Row]:
    """Return rows of how many true places lie in the posterior's regions of 50 and 90 % probability.
    change : (C, 19) counts, the pairs' signals as read"""
    true = _true_place(nets, pairs)
    posterior = nets.posterior(nets.encode_signal(change))
    drawn = draw_places(posterior, DRAWS, np.random.default_rng(0))
    denser = _density(posterior, drawn) > _density(posterior, true[None])
    found = []
    for share, (low, high) in REGIONS.items():
        inside = float((denser.mean(0) < share).mean())
        one = row(f"place_in_{100 * share:g}_percent_region", inside, "1", high, of=f"{low:g} to {high:g} wanted")
        found.append(one | {"ok": bool(low <= inside <= high)})
    return found


def draw_places(posterior: Posterior, count: int, rng: np.random.Generator) -> np.ndarray:
    """Draw ``count`` places of each of T contacts from a posterior: (count, T, 2), in the posterior's units."""
    edges = np.cumsum(posterior.weight, -1)
    which = (rng.random((count, len(edges), 1)) > edges / edges[:, -1:]).sum(-1)
    frames = np.arange(len(edges))
    mean, spread = (each[frames, which][..., :PLACE] for each in (posterior.mean, posterior.spread))
    return mean + spread * rng.standard_normal(mean.shape)


def _density(posterior: Posterior, places: np.ndarray) -> np.ndarray:
    """Return the posterior's density (D, T) at D places (D, T, PLACE) for each of T contacts, up to a factor."""
    mean, spread = (each[..., :PLACE].astype(float) for each in (posterior.mean, posterior.spread))
    away = (places[:, :, None] - mean) / spread
    return (posterior.weight / spread.prod(-1) * np.exp(-0.5 * np.square(away).sum(-1))).sum(-1)


def _true_place(nets: Networks, pairs: Pairs) -> np.ndarray:
    return nets.frames["MVD"].place(true_displacement(pairs, "digit", slice(None)))


def _answers(nets: Networks, pairs: Pairs, change: np.ndarray, bodies: Bodies) -> Columns:
    """Return ``metrics`` of the likely, mean and solved answer to ``change`` (C, 19) counts."""
    read = nets.encode_signal(change)
    posterior = nets.posterior(read)
    found = {}
    for name, state in (("likely", posterior.likely), ("mean", posterior.average)):
        skin, latent = nets.latents(read, state)
        gel, force = nets.decode_target(latent), FORCE_SCALE * np.sinh(state[:, PLACE])
        found |= metrics(name, gel, force, pairs, bodies)
        if name == "likely":
            arrays = {
                "displacement_digit": gel, "contact_center": accuracy.dent_center(gel, sensors.digit_surface().rest),
                "force": nets.force_in(state, skin), "flags": np.zeros(len(gel), np.uint16),
            }  # fmt: skip
            found |= metrics("solved", solved_gel.solved(arrays)["displacement_digit"], force, pairs, bodies)
    return found


def metrics(name: str, gel: np.ndarray, force: np.ndarray, pairs: Pairs, bodies: Bodies) -> Columns:
    """Return errors (C,) of answers: "NAME_place_mm", "NAME_iou" (an overlap), "NAME_force_size_percent",
    "NAME_peak_percent". gel : (C, M, 3) m; force : (C,) N, its size; bodies : holds the gel's surface"""
    true, size = true_displacement(pairs, "digit", slice(None)), accuracy.lengths(pairs.force)
    patches = digit_columns(name, gel, pairs.contact_patch_digit, bodies)
    return {
        f"{name}_place_mm": patches[f"{name}_position_mm"],
        f"{name}_iou": patches[f"{name}_iou"],
        f"{name}_force_size_percent": 100 * np.abs(force / size - 1),
        f"{name}_peak_percent": 100 * accuracy.peak_depth_error(gel, true),
    }


def left_of_nothing(gel: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Return the error (C,) of displacements ``gel`` against ``true``, both (C, M, 3) m, divided by that of no
    displacement: rms over nodes that truly move by more than a tenth of the largest."""
    size = accuracy.lengths(true)
    felt = size > FELT * size.max(1, keepdims=True)
    left, all_of_it = ((np.square(each) * felt).sum(1) for each in (accuracy.lengths(gel - true), size))
    return np.sqrt(left / all_of_it)


def nearest_example(pairs: Pairs, change: np.ndarray, press: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Return gel (C, M, 3) m and force (C,) N of the pair with the most similar signal, scaled by the signals' sizes.

    change : (C, e) counts, signals to find examples for
    press : (C,), number of each signal's press, whose contacts are no examples; None if no pair is of these presses
    """
    length = np.sqrt(np.square(change).sum(-1))
    known = np.sqrt(np.square(pairs.signal).sum(-1))
    alike = (change / length[:, None]) @ (pairs.signal / known[:, None]).T
    if press is not None:
        alike[press[:, None] == pairs.press] = -np.inf
    best = alike.argmax(-1)
    factor = length / known[best]
    gel = true_displacement(pairs, "digit", best) * factor[:, None, None].astype(np.float32)
    return gel, factor * accuracy.lengths(pairs.force[best])


def _median(values: np.ndarray) -> float | None:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else None
