"""Making the fast tier's correction: full-tier contacts on a sample of presses, and a kernel regression on them."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import logging
import time
from collections.abc import Iterable, Iterator

import numpy as np

from ..errors import TactileError
from ..rows import Row, row
from . import correction
from .compliance import compliance_of
from .contact import ContactProblem
from .correction import LINES, MIRRORED, Frame, Learned, features, frame, kernel
from .finite_strain_tier import ONE_STEP, Sensor, graded_body
from .placement import pose_at
from .random_contacts import RandomContact
from .thickness import depth_at

log = logging.getLogger(__name__)

SHARES = 0.4, 0.7, 1.0  # of a press's depth, at which it is sampled
# m of a load step with friction: on a 7 mm ball 0.06 mm steps differ from it by 4 um rms and 1.6 % of force.
_RUBBING_STEP = 0.5e-3
FIELDS = 32  # learned fields a sensor
_WIDTHS = 2.0, 4.0, 8.0  # of the kernel, in standard deviations of a feature
_RIDGES = 1e-3, 1e-2, 1e-1
_MOST = 0.6  # of the logarithm of a force's factor: beyond lie contacts too small for the fast tier's lattice
_LEFT_OUT = 1e9  # scale of a feature that plays no part
_FOLDS = 5
_BINS = 0.05, 0.1, 0.2, 0.3, 0.4, 0.6, 2.0  # depth over thickness, of what is trusted and told
_SIGNIFICANT = 10e-6  # m, nodes that move less do not count (issue 3, point 8)


@dataclasses.dataclass(frozen=True)
class Sample:
    """One contact in the full and the fast tier.

    press : number of its press; friction : Coulomb's coefficient; features (f,); frame; depth m
    ratio : force of the full tier over that of the fast
    fast, full : displacement (n, 3) float32 m
    """

    press: int
    friction: float
    features: np.ndarray
    frame: Frame
    depth: float
    ratio: float
    fast: np.ndarray
    full: np.ndarray


def full_press(sensor: Sensor, press: RandomContact, friction: float) -> dict[str, np.ndarray]:
    """The full tier's contacts of a press at its ``SHARES`` with Coulomb's ``friction``, as far as they converge.

    Returns depths (k,) m wanted; of the c <= k that converged displacement (c, n, 3) float32 m, force (c, 3) N,
    iterations (c,), load steps (c,) and seconds (c,).
    """
    pose = pose_at(sensor, press.indenter, press.place)
    deepest = depth_at(press.depth, sensor, press.indenter, pose)
    body = graded_body(sensor, press.indenter, pose, deepest)
    problem = body.contact(press.indenter, pose, deepest, friction)
    touch, found = None, []
    for depth in np.array(SHARES) * deepest:
        began = time.process_time()
        try:
            touch = problem.press(depth, touch, _RUBBING_STEP if friction else ONE_STEP)
            body.hidden(touch, press.indenter)  # raises where it went through the surface
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
    """The press in the fast tier, beside the full tier's contacts of ``full_press``; those that converged in both."""
    compliance, pose = compliance_of(sensor), pose_at(sensor, press.indenter, press.place)
    problem = ContactProblem(compliance, press.indenter, pose, float(full["depths"][-1]), friction)
    contact = None
    for depth, moved, force in zip(full["depths"], full["displacement"], full["force"], strict=False):
        contact = problem.at_depth(float(depth), contact if contact is not None and contact.converged else None)
        along = float(force @ pose.direction)
        if not contact.converged or contact.axial_force <= 0 or along <= 0:
            continue
        at = frame(compliance, contact)
        yield Sample(
            number, friction, features(compliance, contact, at), at, float(depth), along / contact.axial_force,
            contact.displacement, moved,
        )  # fmt: skip


def residual_on_grid(sensor: str, at: Frame, residual: np.ndarray) -> np.ndarray:
    """A field (n, 3) at a sensor's nodes, in the frames of its nodes, on the moving grid (g, 3); 0 beyond the nodes."""
    import scipy.interpolate

    local = np.einsum("kji,kj->ki", correction.node_frames(sensor), residual)
    places = at.centre + at.radius * correction.grid_places().reshape(-1, 2)
    return scipy.interpolate.LinearNDInterpolator(_triangulation(sensor), local, fill_value=0.0)(places)


@functools.cache
def _triangulation(sensor: str):  # noqa: ANN202
    import scipy.spatial

    return scipy.spatial.Delaunay(correction.plane(sensor))


def mirrored(field: np.ndarray) -> np.ndarray:
    """A field on the grid (..., g, 3) under z -> -z."""
    grid = field.reshape(*field.shape[:-2], LINES, LINES, 3)[..., :, ::-1, :]
    return (grid * [1.0, 1.0, -1.0]).reshape(field.shape)


def learn(sensor: str, samples: Iterable[Sample]) -> tuple[Learned, list[Row]]:
    """The correction of one sensor, and rows of its errors on presses kept apart (five folds by press)."""
    samples = list(samples)
    x = np.array([s.features for s in samples])
    fields = np.array([residual_on_grid(sensor, s.frame, s.full - s.fast) / s.depth for s in samples])
    log_ratio = np.log([s.ratio for s in samples])
    fold = np.array([s.press for s in samples]) % _FOLDS
    choice = _choose(x, log_ratio, fields, fold)
    log.info("%s: %d features, kernel width %g, ridge %g", sensor, len(choice[0]), choice[1], choice[2])
    guess = np.empty(len(samples)), np.empty_like(fields)
    for f in range(_FOLDS):
        part = _fit(x[fold != f], log_ratio[fold != f], fields[fold != f], *choice)
        for i in np.flatnonzero(fold == f):
            factor, guess[1][i] = part.predict(x[i])
            guess[0][i] = np.log(factor)
    errors = np.empty((len(samples), 6))
    for f in range(_FOLDS):  # what is trusted on a fold is found on the others
        trust = _trust(
            x[fold != f, 0], guess[0][fold != f], log_ratio[fold != f], guess[1][fold != f], fields[fold != f]
        )
        for i in np.flatnonzero(fold == f):
            of_force, of_field = (np.interp(x[i, 0], trust[:, 0], trust[:, k]) for k in (1, 2))
            errors[i] = _errors(sensor, samples[i], np.exp(of_force * guess[0][i]), of_field * guess[1][i])
    depth, frictions = x[:, 0], np.array([s.friction for s in samples])
    learned = dataclasses.replace(
        _fit(x, log_ratio, fields, *choice),
        trust=_trust(depth, guess[0], log_ratio, guess[1], fields),
    )
    each = ((friction, frictions == friction) for friction in np.unique(frictions))
    return learned, [found for friction, part in each for found in _rows(sensor, friction, depth[part], errors[part])]


def _trust(
    depth: np.ndarray, log_guess: np.ndarray, log_ratio: np.ndarray, guess: np.ndarray, fields: np.ndarray
) -> np.ndarray:
    """See ``Learned``: the share of what was predicted for presses kept apart that leaves the least squares."""
    rows = []
    for _, _, here in _bins(depth):
        pairs = (log_guess[here], np.clip(log_ratio[here], -_MOST, _MOST)), (guess[here], fields[here])
        shares = [float(np.clip((g * t).sum() / max((g * g).sum(), 1e-30), 0, 1)) for g, t in pairs]
        rows.append([float(depth[here].mean()), *shares])
    return np.array(rows) if rows else np.array([[0.0, 1.0, 1.0]])


def _fit(
    x: np.ndarray, log_ratio: np.ndarray, fields: np.ndarray, taking_part: np.ndarray, width: float, ridge: float
) -> Learned:
    """Kernel ridge regression on samples and their mirror images, by the features that take part."""
    x = np.concatenate([x, x * MIRRORED])
    fields = np.concatenate([fields, mirrored(fields)])
    log_ratio = np.clip(np.concatenate([log_ratio, log_ratio]), -_MOST, _MOST)
    shift, scale = x.mean(axis=0) * (MIRRORED > 0), np.full(x.shape[1], _LEFT_OUT)
    scale[taking_part] = x.std(axis=0)[taking_part] + 1e-9
    scaled = (x - shift) / scale
    flat = fields.reshape(len(fields), -1)
    _, _, basis = np.linalg.svd(flat, full_matrices=False) if len(flat) < flat.shape[1] else _by_covariance(flat)
    basis = basis[:FIELDS]
    goals = np.column_stack([log_ratio, flat @ basis.T])
    near = kernel(scaled, scaled, width)
    weights = np.linalg.solve(near + ridge * np.eye(len(near)) * np.trace(near) / len(near), goals)
    shape = (len(basis), LINES * LINES, 3)
    return Learned(
        shift, scale, scaled.astype(np.float32), width, weights[:, 0], weights[:, 1:].astype(np.float32),
        basis.reshape(shape).astype(np.float16), np.array([[0.0, 1.0, 1.0]]),
    )  # fmt: skip


def _by_covariance(flat: np.ndarray) -> tuple[None, None, np.ndarray]:
    values, vectors = np.linalg.eigh(flat.T @ flat)
    return None, None, vectors[:, np.argsort(values)[::-1]].T


def _choose(
    x: np.ndarray, log_ratio: np.ndarray, fields: np.ndarray, fold: np.ndarray
) -> tuple[np.ndarray, float, float]:
    """Features, kernel width and ridge with the least error on two of the folds."""
    best = (np.inf, np.arange(x.shape[1]), 0.0, 0.0)
    coarse = fields[:, ::7]  # enough points of the grid to choose by
    for part in (np.arange(x.shape[1]), correction.ESSENTIAL):
        for width in _WIDTHS:
            for ridge in _RIDGES:
                score = np.mean([_score(x, log_ratio, coarse, fold == f, part, width, ridge) for f in (0, 1)])
                if score < best[0]:
                    best = (score, part, width, ridge)
    return best[1:]


def _score(x, log_ratio, fields, held, part, width, ridge) -> float:  # noqa: ANN001
    """Median errors of force and shape on held samples, each over that of doing nothing."""
    scale = x.std(axis=0)[part] + 1e-9
    scaled = (x[:, part] - x[:, part].mean(axis=0)) / scale
    near = kernel(scaled[~held], scaled[~held], width)
    goals = np.column_stack([np.clip(log_ratio, -_MOST, _MOST), fields.reshape(len(fields), -1)])
    weights = np.linalg.solve(near + ridge * np.eye(len(near)) * np.trace(near) / len(near), goals[~held])
    found = kernel(scaled[held], scaled[~held], width) @ weights
    error, null = np.abs(found - goals[held]), np.abs(goals[held])
    sizes = [np.sqrt((values[:, 1:] ** 2).mean(axis=1)) for values in (error, null)]
    return float(np.median(error[:, 0]) / np.median(null[:, 0]) + np.median(sizes[0]) / np.median(sizes[1]))


def _errors(sensor: str, sample: Sample, factor: float, field: np.ndarray) -> list[float]:
    """rms and largest shape error m, relative force error; each after the correction, then before."""
    truth = sample.full.astype(float)
    counts = np.linalg.norm(truth, axis=1) > _SIGNIFICANT
    after = sample.fast + sample.depth * correction.spread_field(sensor, sample.frame, field) - truth
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
    """Median errors with the correction, beside those without it, in bins of depth."""
    measures = ("shape_rms", 0, 3, 1e6, "um"), ("shape_max", 1, 4, 1e6, "um"), ("force_error", 2, 5, 100, "percent")
    for low, high, here in _bins(depth):
        for what, after, before, scale, unit in measures:
            value, null = (float(np.median(np.abs(errors[here, k])) * scale) for k in (after, before))
            name = f"{sensor}_friction_{friction:g}_corrected_{low:g}_to_{high:g}_{what}"
            of = f"{here.sum()} contacts of presses kept apart, median; null: uncorrected"
            yield row(name, value, unit, null=null, of=of)


_LEAST = 8  # contacts, below which a bin says nothing
