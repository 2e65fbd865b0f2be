"""Make the fast tier's correction: full-tier contacts on a sample of presses, and a kernel regression on them."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import logging
import time
from collections.abc import Iterable, Iterator

import numpy as np

from tactile_core.accuracy import Row, row
from tactile_core.errors import TactileError
from tactile_core.mechanics.fast import correction
from tactile_core.mechanics.fast.compliance import compliance_of
from tactile_core.mechanics.fast.contact import ContactProblem
from tactile_core.mechanics.fast.contact_state import Contact
from tactile_core.mechanics.fast.correction import Correction, PatchFrame, features, frame
from tactile_core.mechanics.fast.edge_contact import EdgeContactProblem
from tactile_core.mechanics.finite_strain.body import ONE_STEP, Sensor, graded_body
from tactile_core.mechanics.placement import depth_at, pose_at

from ..mechanics.random_contacts import RandomContact
from .correction_fit import MOST, WHOLE, Known, choices, fit

log = logging.getLogger(__name__)

SHARES = 0.4, 0.7, 1.0  # of a press's depth, at which it is sampled
# m of a load step with friction: on a 7 mm ball 0.06 mm steps differ from it by 4 um rms and 1.6 % of force.
_RUBBING_STEP = 0.5e-3
_FOLDS = 5
_BINS = 0.05, 0.1, 0.2, 0.3, 0.4, 0.6, 2.0  # depth over thickness, of which errors are trusted and reported
_SIGNIFICANT = 10e-6  # m, nodes that move less do not count: they belong to no contact


@dataclasses.dataclass(frozen=True)
class Sample:
    """Contact in the full and the fast tier.

    press : number of its press; friction : Coulomb's coefficient; features : (f,), and frame : of the fast contact
    depth : m; ratio : force of the full tier over that of the fast, along the motion
    fast, full : displacement (n, 3) float32 m of the surface's nodes, in either tier"""

    press: int
    friction: float
    features: np.ndarray
    frame: PatchFrame
    depth: float
    ratio: float
    fast: np.ndarray
    full: np.ndarray


def full_press(sensor: Sensor, press: RandomContact, friction: float) -> dict[str, np.ndarray]:
    """Solve the full tier's contacts of a press at its ``SHARES`` with Coulomb's ``friction``, as far as they converge.

    Returns depths (k,) m wanted; of the c <= k that converged displacement (c, n, 3) float32 m, force (c, 3) N,
    iterations (c,), load steps (c,) and seconds (c,)."""
    pose = pose_at(sensor, press.indenter, press.place)
    deepest = depth_at(press.depth, sensor, press.indenter, pose)
    body = graded_body(sensor, press.indenter, pose, deepest)
    problem = body.contact(press.indenter, pose, deepest, friction)
    touch, found = None, []
    for depth in np.array(SHARES) * deepest:
        began = time.process_time()
        try:
            touch = problem.press(depth, touch, _RUBBING_STEP if friction else ONE_STEP)
            body.penetration_depth(touch, press.indenter)  # raises where it went through the surface
        except TactileError as error:
            log.info("%s: %s", press.name, error)
            break
        took = time.process_time() - began
        found.append((body.displacement(touch).astype(np.float32), touch.force, touch.iterations, touch.steps, took))
    names = ("displacement", "force", "iterations", "steps", "seconds")
    columns = zip(*found, strict=True) if found else [[]] * len(names)
    arrays = {name: np.array(values) for name, values in zip(names, columns, strict=True)}
    return {"depths": np.array(SHARES) * deepest, **arrays}


def paired(
    sensor: Sensor, number: int, press: RandomContact, friction: float, full: dict[str, np.ndarray]
) -> Iterator[Sample]:
    """Solve press ``number`` in the fast tier at the depths of ``full_press``'s contacts, ``full``; yield a sample of
    each contact that both tiers hold. friction : Coulomb's coefficient"""
    compliance, pose = compliance_of(sensor), pose_at(sensor, press.indenter, press.place)
    problem = ContactProblem(compliance, press.indenter, pose, float(full["depths"][-1]), friction)
    contact = None
    for depth, moved, force in zip(full["depths"], full["displacement"], full["force"], strict=False):
        contact = problem.at_depth(float(depth), contact if contact is not None and contact.converged else None)
        if friction == 0 and not isinstance(problem, EdgeContactProblem) and not _holds(problem, contact):
            problem = EdgeContactProblem(compliance, press.indenter, pose, float(full["depths"][-1]))
            contact = problem.at_depth(float(depth))
        along = float(force @ pose.direction)
        if not _holds(problem, contact) or contact.axial_force <= 0 or along <= 0:
            continue
        at = frame(compliance, contact)
        yield Sample(
            number, friction, features(compliance, contact, at), at, float(depth), along / contact.axial_force,
            contact.displacement, moved,
        )  # fmt: skip


def _holds(problem: ContactProblem, contact: Contact) -> bool:
    """Return true if a contact is valid, with the indenter in front of the surface."""
    if not contact.converged:
        return False
    try:
        problem.check_follows(contact)
    except TactileError:
        return False
    return True


def residual_on_grid(sensor: str, at: PatchFrame, residual: np.ndarray) -> np.ndarray:
    """Interpolate a residual (n, 3) at a sensor's nodes to the grid (g, 3) of the patch frame ``at``, in the nodes' own
    axes; 0 beyond the surface."""
    import scipy.interpolate

    local = np.einsum("kji,kj->ki", correction.node_frames(sensor), residual)
    places = at.centre + at.radius * correction.grid_places().reshape(-1, 2)
    return scipy.interpolate.LinearNDInterpolator(_triangulation(sensor), local, fill_value=0.0)(places)


@functools.cache
def _triangulation(sensor: str):  # noqa: ANN202
    import scipy.spatial

    return scipy.spatial.Delaunay(correction.plane(sensor))


def learn(sensor: str, samples: Iterable[Sample]) -> tuple[Correction, list[Row]]:
    """Learn a sensor's correction; also return rows of its errors on held-out presses (five folds by press)."""
    samples = list(samples)
    known = Known(
        np.array([s.features for s in samples]), np.log([s.ratio for s in samples]),
        np.array([residual_on_grid(sensor, s.frame, s.full - s.fast) / s.depth for s in samples]),
        np.array([s.press for s in samples]) % _FOLDS, np.array([s.friction > 0 for s in samples]),
    )  # fmt: skip
    errors, parts = np.empty((len(samples), 6)), {}
    for kind in map(bool, np.unique(known.rubbing)):
        log_factor, fields = _guessed_apart(known, kind)
        for f in range(_FOLDS):  # what is trusted on a fold is found on the others
            trust = _trust(known, (known.fold != f) & (known.rubbing == kind), log_factor, fields)
            for i in np.flatnonzero((known.fold == f) & (known.rubbing == kind)):
                of_force, of_field = (np.interp(known.x[i, 0], trust[:, 0], trust[:, k]) for k in (1, 2))
                errors[i] = _errors(sensor, samples[i], np.exp(of_force * log_factor[i]), of_field * fields[i])
        chosen = choices(known, kind)
        log.info("%s, %s friction: %s and %s for forces, %s for fields", sensor, "with" if kind else "without", *chosen)
        trust = _trust(known, known.rubbing == kind, log_factor, fields)
        parts[kind] = dataclasses.replace(fit(known, *chosen), trust=trust)
    frictions = np.array([s.friction for s in samples])
    each = ((friction, frictions == friction) for friction in np.unique(frictions))
    depth = known.x[:, 0]
    rows = [found for friction, part in each for found in _rows(sensor, friction, depth[part], errors[part])]
    return Correction(*(parts.get(kind, parts.get(not kind)) for kind in (False, True))), rows  # one stands for both


def _guessed_apart(known: Known, kind: bool) -> tuple[np.ndarray, np.ndarray]:
    """Logarithms (n,) and fields (n, g, 3) of the samples of one kind, each learned from the other folds."""
    log_factor, fields = np.zeros(len(known.x)), np.zeros_like(known.fields)
    for f in range(_FOLDS):
        rest = known.select_rows(known.fold != f)
        part = fit(rest, *choices(rest, kind))
        for i in np.flatnonzero((known.fold == f) & (known.rubbing == kind)):
            log_factor[i], fields[i] = part.log_factor(known.x[i]), part.field(known.x[i])
    return log_factor, fields


def _trust(known: Known, which: np.ndarray, log_guess: np.ndarray, guess: np.ndarray) -> np.ndarray:
    """Return ``Learned.trust``: the share of predictions for held-out presses that leaves the least squares.
    which : (n,) bool, samples that count; log_guess : (n,), guess : (n, g, 3), predictions of log_ratio and fields"""
    rows, depth, log_ratio = [], known.x[which, 0], np.clip(known.log_ratio[which], -MOST, MOST)
    for _, _, here in _bins(depth):
        pairs = (log_guess[which][here], log_ratio[here]), (guess[which][here], known.fields[which][here])
        shares = [float(np.clip((g * t).sum() / max((g * g).sum(), 1e-30), 0, 1)) for g, t in pairs]
        rows.append([float(depth[here].mean()), *shares])
    return np.array(rows) if rows else WHOLE


def _errors(sensor: str, sample: Sample, factor: float, field: np.ndarray) -> list[float]:
    """Return rms and largest shape error m, relative force error; each after the correction, then before.
    factor : of force, field : (g, 3) of shape, the sample's correction"""
    truth = sample.full.astype(float)
    counts = np.linalg.norm(truth, axis=1) > _SIGNIFICANT
    after = correction.add_field(sensor, sample.fast, sample.frame, field, sample.depth) - truth
    out = []
    for error in (after[counts], (sample.fast - truth)[counts]):
        size = np.linalg.norm(error, axis=1) if counts.any() else np.zeros(1)
        out += [float(np.sqrt((size**2).mean())), float(size.max())]
    return [out[0], out[1], factor / sample.ratio - 1, out[2], out[3], 1 / sample.ratio - 1]


def _bins(depth: np.ndarray) -> Iterator[tuple[float, float, np.ndarray]]:
    """Ends of each bin of depth over thickness that holds enough contacts, and which (n,) bool those are."""
    for low, high in itertools.pairwise((0.0, *_BINS)):
        here = (depth > low) & (depth <= high)
        if here.sum() >= _LEAST:
            yield low, high, here


def _rows(sensor: str, friction: float, depth: np.ndarray, errors: np.ndarray) -> Iterator[Row]:
    """Yield median errors with the correction, beside those without it, in bins of depth (n,). errors : (n, 6) of
    ``_errors``; friction : Coulomb's coefficient, all contacts'"""
    measures = ("shape_rms", 0, 3, 1e6, "um"), ("shape_max", 1, 4, 1e6, "um"), ("force_error", 2, 5, 100, "percent")
    for low, high, here in _bins(depth):
        for what, after, before, scale, unit in measures:
            value, baseline = (float(np.median(np.abs(errors[here, k])) * scale) for k in (after, before))
            name = f"{sensor}_friction_{friction:g}_corrected_{low:g}_to_{high:g}_{what}"
            of = f"{here.sum()} contacts of held-out presses, median; baseline: uncorrected"
            yield row(name, value, unit, baseline=baseline, of=of)


_LEAST = 8  # fewest contacts of a bin
