"""Make the fast tier's correction: solve sample presses in the full tier, learn by kernel ridge regression what the
fast tier's forces and displacements lack."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import logging
import time
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from tactile_core.accuracy import Row, row
from tactile_core.errors import TactileError
from tactile_core.mechanics.fast import correction
from tactile_core.mechanics.fast.compliance import compliance_of
from tactile_core.mechanics.fast.contact import ContactProblem
from tactile_core.mechanics.fast.contact_state import Contact
from tactile_core.mechanics.fast.correction import ALL, ESSENTIAL, LINES, MIRRORED, Correction, Learned, PatchFrame
from tactile_core.mechanics.fast.edge_contact import EdgeContactProblem
from tactile_core.mechanics.finite_strain.body import ONE_STEP, Sensor, graded_body
from tactile_core.mechanics.placement import depth_at, pose_at

from ..mechanics.random_contacts import RandomContact

FIELDS = 32  # learned fields per sensor
_WIDTHS = 2.0, 4.0, 8.0, 16.0  # of the kernel, in standard deviations of a feature
# Ridge over the kernel's mean diagonal. With a hundredth of it the fit extrapolated worse: a ring without tilt was 25 %
# off in force.
_RIDGES = 1e-1, 1.0
MOST = 0.6  # limit of the logarithm of a force's factor: beyond, contacts are too small for the fast tier's lattice
WHOLE = np.array([[0.0, 1.0, 1.0]])  # ``Learned.trust`` of a correction that is applied in full
log = logging.getLogger(__name__)

SHARES = 0.4, 0.7, 1.0  # of a press's depth, at which it is sampled
# m of a load step with friction: on a 7 mm ball 0.06 mm steps differ from it by 4 um rms and 1.6 % of force.
_RUBBING_STEP = 0.5e-3
_FOLDS = 5
_BINS = 0.05, 0.1, 0.2, 0.3, 0.4, 0.6, 2.0  # depth over thickness, of which errors are trusted and reported
_LEAST = 8  # fewest contacts of a bin
_SIGNIFICANT = 10e-6  # m, nodes that move less do not count: they belong to no contact


class Known(NamedTuple):
    """Samples to learn from, n contacts. x : (n, f) features; log_ratio : (n,), ln of full tier's force over fast's
    fields : (n, g, 3), full less fast displacement, divided by depth, at g = LINES^2 places
    fold : (n,), the fold of cross-validation that holds the sample out; rubbing : (n,) bool, true with friction"""

    x: np.ndarray
    log_ratio: np.ndarray
    fields: np.ndarray
    fold: np.ndarray
    rubbing: np.ndarray


def mirrored(field: np.ndarray) -> np.ndarray:
    """Mirror ``field`` (..., LINES * LINES, 3), vectors on a flattened grid (along x, along z), at z = 0."""
    grid = field.reshape(*field.shape[:-2], LINES, LINES, 3)[..., :, ::-1, :]
    return (grid * [1.0, 1.0, -1.0]).reshape(field.shape)


class Choice(NamedTuple):
    """Settings of kernel ridge regression. width : of the kernel, in standard deviations of a feature
    ridge : divided by the mean of the kernel's diagonal"""

    width: float
    ridge: float

    def near(self, a: np.ndarray, b: np.ndarray, a_rubs: np.ndarray, b_rubs: np.ndarray) -> np.ndarray:
        """Return the kernel (n, m) between contacts a and b, scaled features a (n, j), b (m, j); a_rubs (n,), b_rubs
        (m,) : whether each has friction"""
        return correction.kernel(a, b, correction.squares(b), self.width) * correction.alike(a_rubs[:, None], b_rubs)

    def weights(self, scaled: np.ndarray, rubbing: np.ndarray, goals: np.ndarray) -> np.ndarray:
        """Return the weights (n, k) of n contacts that fit goals (n, k).
        scaled : (n, f) features; rubbing : (n,), whether each contact has friction"""
        near = self.near(scaled, scaled, rubbing, rubbing)
        return np.linalg.solve(near + self.ridge * np.eye(len(near)) * np.trace(near) / len(near), goals)


def fit(known: Known, for_force: Choice, by_few: Choice, for_fields: Choice) -> Learned:
    """Fit a correction to known samples and their mirror images, by kernel ridge regression.
    for_force : settings for the force by all features; by_few : for the force by the `ESSENTIAL` ones alone (their mean
    is taken); for_fields : for the fields of displacement"""
    x = np.concatenate([known.x, known.x * MIRRORED])
    fields = np.concatenate([known.fields, mirrored(known.fields)])
    log_ratio = np.clip(np.tile(known.log_ratio, 2), -MOST, MOST)
    shift, scale = x.mean(axis=0) * (MIRRORED > 0), x.std(axis=0) + 1e-9
    scaled, rubbing = (x - shift) / scale, correction.rubs(x)
    flat = fields.reshape(len(fields), -1)
    few_samples = len(flat) < flat.shape[1]  # else the covariance is smaller; its vectors come by growing value
    basis = np.linalg.svd(flat, full_matrices=False)[2] if few_samples else np.linalg.eigh(flat.T @ flat)[1][:, ::-1].T
    basis = basis[:FIELDS]
    few = scaled[:, ESSENTIAL]
    return Learned(
        shift, scale, scaled.astype(np.float32), rubbing.astype(np.float32),
        np.array([for_force.width, by_few.width, for_fields.width]),
        np.array([for_force.weights(scaled, rubbing, log_ratio), by_few.weights(few, rubbing, log_ratio)]),
        for_fields.weights(scaled, rubbing, flat @ basis.T).astype(np.float32),
        basis.reshape(len(basis), LINES * LINES, 3).astype(np.float16), WHOLE,
    )  # fmt: skip


def choices(known: Known, kind: bool) -> tuple[Choice, Choice, Choice]:
    """Return the settings with the least error on held-out presses: for forces by all features, for forces by the
    ``ESSENTIAL`` ones alone, for fields. kind : true for presses with friction, false for those without"""
    coarse = known.fields[:, ::7].reshape(len(known.x), -1)  # enough points of the grid to choose by
    forces = np.clip(known.log_ratio, -MOST, MOST)[:, None]
    every = [Choice(width, ridge) for width in _WIDTHS for ridge in _RIDGES]
    both = [_fold_errors(known, kind, ALL, np.column_stack([forces, coarse]), choice) for choice in every]
    few = [_fold_errors(known, kind, ESSENTIAL, forces, choice) for choice in every]
    pairs = itertools.product(range(len(every)), repeat=2)
    one, other = min(pairs, key=lambda pair: _size((both[pair[0]][:, :1] + few[pair[1]]) / 2))
    fields = min(range(len(every)), key=lambda i: _size(both[i][:, 1:]))
    return every[one], every[other], every[fields]


def _fold_errors(known: Known, kind: bool, parts: slice | np.ndarray, goals: np.ndarray, choice: Choice) -> np.ndarray:
    """Return errors (m, k) of predicted goals of the m samples of one kind, each predicted from the other folds.
    kind : true for those with friction; parts : slice or indices of the features to use; goals : (n, k), of all"""
    error, rubbing = np.zeros_like(goals), correction.rubs(known.x)
    for f in np.unique(known.fold):
        rest, held = known.fold != f, (known.fold == f) & (known.rubbing == kind)
        scaled = ((known.x - known.x[rest].mean(axis=0)) / (known.x[rest].std(axis=0) + 1e-9))[:, parts]
        near = choice.near(scaled[held], scaled[rest], rubbing[held], rubbing[rest])
        error[held] = near @ choice.weights(scaled[rest], rubbing[rest], goals[rest]) - goals[held]
    return error[known.rubbing == kind]


def _size(error: np.ndarray) -> float:
    """Return the median plus the mean of the root mean squares of an error's rows, (m, k)."""
    size = np.sqrt((error**2).mean(axis=1))
    return float(np.median(size) + size.mean())


@dataclasses.dataclass(frozen=True)
class Sample:
    """One contact, solved in the full and in the fast tier.

    press : number of its press; friction : Coulomb's coefficient; features : (f,), frame : of the fast tier's contact
    depth : m; ratio : force of the full tier along the motion, divided by that of the fast tier
    fast, full : (n, 3) float32 m, displacement of the surface's nodes in each tier"""

    press: int
    friction: float
    features: np.ndarray
    frame: PatchFrame
    depth: float
    ratio: float
    fast: np.ndarray
    full: np.ndarray


def full_press(sensor: Sensor, press: RandomContact, friction: float) -> dict[str, np.ndarray]:
    """Solve a press in the full tier at ``SHARES`` of its depth, until one does not converge; return arrays by name.

    depths (k,) m; of the first c <= k, which converged: displacement (c, n, 3) float32 m, force (c, 3) N, seconds (c,)
    of CPU. friction : Coulomb's coefficient"""
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
        found.append((body.displacement(touch).astype(np.float32), touch.force, time.process_time() - began))
    moved, force, seconds = (np.array(values) for values in (zip(*found, strict=True) if found else [[]] * 3))
    return {"depths": np.array(SHARES) * deepest, "displacement": moved, "force": force, "seconds": seconds}


def paired(
    sensor: Sensor, number: int, press: RandomContact, friction: float, full: dict[str, np.ndarray]
) -> Iterator[Sample]:
    """Solve press ``number`` in the fast tier at the depths of ``full``, which ``full_press`` returned; yield a sample
    of each contact that is valid in both tiers. friction : Coulomb's coefficient"""
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
        at = correction.frame(compliance, contact)
        yield Sample(
            number, friction, correction.features(compliance, contact, at), at, float(depth),
            along / contact.axial_force, contact.displacement, moved,
        )  # fmt: skip


def _holds(problem: ContactProblem, contact: Contact) -> bool:
    """Return true if a contact converged and the indenter does not pass through the surface."""
    if not contact.converged:
        return False
    try:
        problem.check_follows(contact)
    except TactileError:
        return False
    return True


def residual_on_grid(sensor: str, at: PatchFrame, residual: np.ndarray) -> np.ndarray:
    """Interpolate a residual (n, 3) at sensor nodes to the g = LINES^2 grid places of the patch frame ``at``; return
    it (g, 3) in the axes of the surface there, 0 beyond the surface."""
    import scipy.interpolate

    local = np.einsum("kji,kj->ki", correction.node_frames(sensor), residual)
    places = at.centre + at.radius * correction.grid_places().reshape(-1, 2)
    return scipy.interpolate.LinearNDInterpolator(_triangulation(sensor), local, fill_value=0.0)(places)


@functools.cache
def _triangulation(sensor: str):  # noqa: ANN202
    import scipy.spatial

    return scipy.spatial.Delaunay(correction.plane(sensor))


def learn(sensor: str, samples: Iterable[Sample]) -> tuple[Correction, list[Row]]:
    """Learn a sensor's correction; return it, and rows of its errors on held-out presses (five folds by press)."""
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
    """Return the predicted log_ratio (n,) and fields (n, g, 3) of the samples of one kind, each from the other folds;
    0 for samples of the other kind. kind : true for those with friction"""
    log_factor, fields = np.zeros(len(known.x)), np.zeros_like(known.fields)
    for f in range(_FOLDS):
        rest = Known(*(values[known.fold != f] for values in known))
        part = fit(rest, *choices(rest, kind))
        for i in np.flatnonzero((known.fold == f) & (known.rubbing == kind)):
            log_factor[i], fields[i] = part.log_factor(known.x[i]), part.field(known.x[i])
    return log_factor, fields


def _trust(known: Known, which: np.ndarray, log_guess: np.ndarray, guess: np.ndarray) -> np.ndarray:
    """Return ``Learned.trust``: by depth, the share of a prediction to apply, as it leaves held-out presses the least
    squared error. which : (n,) bool, samples to use; log_guess : (n,), guess : (n, g, 3), predicted log_ratio, field"""
    rows, depth, log_ratio = [], known.x[which, 0], np.clip(known.log_ratio[which], -MOST, MOST)
    for _, _, here in _bins(depth):
        pairs = (log_guess[which][here], log_ratio[here]), (guess[which][here], known.fields[which][here])
        shares = [float(np.clip((g * t).sum() / max((g * g).sum(), 1e-30), 0, 1)) for g, t in pairs]
        rows.append([float(depth[here].mean()), *shares])
    return np.array(rows) if rows else WHOLE


def _errors(sensor: str, sample: Sample, factor: float, field: np.ndarray) -> list[float]:
    """Return rms and largest shape error, m, and relative force error after the correction, then the three before it.
    factor : correction of the force; field : (g, 3), correction of the shape"""
    truth = sample.full.astype(float)
    counts = np.linalg.norm(truth, axis=1) > _SIGNIFICANT
    after = correction.add_field(sensor, sample.fast, sample.frame, field, sample.depth) - truth
    out = []
    for error in (after[counts], (sample.fast - truth)[counts]):
        size = np.linalg.norm(error, axis=1) if counts.any() else np.zeros(1)
        out += [float(np.sqrt((size**2).mean())), float(size.max())]
    return [out[0], out[1], factor / sample.ratio - 1, out[2], out[3], 1 / sample.ratio - 1]


def _bins(depth: np.ndarray) -> Iterator[tuple[float, float, np.ndarray]]:
    """Yield the ends of each bin of depth (n,), over thickness, with enough contacts, and a mask (n,) of these."""
    for low, high in itertools.pairwise((0.0, *_BINS)):
        here = (depth > low) & (depth <= high)
        if here.sum() >= _LEAST:
            yield low, high, here


def _rows(sensor: str, friction: float, depth: np.ndarray, errors: np.ndarray) -> Iterator[Row]:
    """Yield median errors with the correction, and without it as baseline, in bins of depth (n,) over thickness.
    errors : (n, 6), by ``_errors``; friction : Coulomb's coefficient of all contacts"""
    measures = ("shape_rms", 0, 3, 1e6, "um"), ("shape_max", 1, 4, 1e6, "um"), ("force_error", 2, 5, 100, "percent")
    for low, high, here in _bins(depth):
        for what, after, before, scale, unit in measures:
            value, baseline = (float(np.median(np.abs(errors[here, k])) * scale) for k in (after, before))
            name = f"{sensor}_friction_{friction:g}_corrected_{low:g}_to_{high:g}_{what}"
            of = f"{here.sum()} contacts of held-out presses, median; baseline: uncorrected"
            yield row(name, value, unit, baseline=baseline, of=of)
