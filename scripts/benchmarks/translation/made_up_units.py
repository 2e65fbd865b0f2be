"""Measure what a finger unlike the typical one costs in error: its film, fluid and skin given, found, or not known.

The training's indenters press made-up units. The fast tier solves each contact with the core as close as the unit's
film is thin, and the whole conducting sheet (not the reduced one) reads it, with gains 10 % apart, which are never
given, and 1.5 counts of noise. Truth is the gel under the unit's own force, by the fast tier.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from tactile_core import accuracy, sensors
from tactile_core.accuracy import Row, row
from tactile_core.errors import TactileError
from tactile_core.geometry.indenters import Indenter
from tactile_core.mechanics.electrodes.biotac_sheet import biotac_sheet
from tactile_core.mechanics.fast.compliance import Compliance, compliance_of
from tactile_core.mechanics.fast.contact_state import Contact
from tactile_core.mechanics.fast.press import CorrectedPress
from tactile_core.mechanics.placement import DEPTH_LIMIT, Placement, pose_at, thickness_under
from tactile_core.mechanics.solve import Step, solve_path
from tactile_core.recordings import Recording
from tactile_core.recordings.assemble import assemble
from tactile_core.recordings.electrode_gains import ElectrodeGains
from tactile_core.recordings.signals import PrepareOptions
from tactile_core.sensors import COUNT_MAX, REST_COUNTS, SAMPLE_RATE, SOURCE, TARGET, divider
from tactile_core.sensors.readout import NOISE, converted
from tactile_core.simulation.pair_sampling import draw_place, paired
from tactile_core.simulation.scene import Scene, load_scene
from tactile_core.translation.translate import PreparedRows, translated
from tactile_core.translation.translator import Translation, Translator

from .test_set import GAIN

SCENE = Path(__file__).resolve().parents[3] / "scenes" / "training"
# Over the typical unit's: films and conductivities of five real units and some room (shared/design/finger.md),
# stiffnesses between the quartiles of real pressures over simulated ones (descriptor of the BioTac).
FILMS, CONDUCTIVITIES, STIFFNESSES = (0.35, 1.25), (0.45, 1.3), (0.58, 1.05)
UNITS, PRESSES, CONTACTS = 6, 10, 6  # 360 contacts
FORCES = 0.2, 2.0  # N, log-uniform: a typical skin's at the deepest contact of a press
HELD, STILL = 8, 6  # frames at the deepest contact, and without one before the next
AT_FIRST = 60  # frames without contact
SEED = 17
# Confidence is judged on other units than the 64 whose half it was fitted to, in bins of these edges that hold enough.
OTHERS, CHECKED, EDGES, FEWEST = 64, 24, (0.0, 0.5, 0.8, 0.9, 0.95, 0.98, 0.99, 1.0), 50


@dataclasses.dataclass(frozen=True)
class Unit:
    """A finger: thickness of its film, conductivity of its fluid, stiffness of its skin, each over a typical unit's."""

    film: float = 1.0
    conductivity: float = 1.0
    stiffness: float = 1.0

    def press(self, indenter: Indenter, place: Placement, friction: float) -> CorrectedPress:
        """Return the press of an indenter at a place on this finger. Its forces must be multiplied by the stiffness.
        friction : Coulomb's coefficient"""
        pose = pose_at(SOURCE, indenter, place)
        limit = DEPTH_LIMIT * thickness_under(SOURCE, indenter, pose)
        return CorrectedPress(_skin(self.film), indenter, pose, limit, friction)

    def rest(self) -> np.ndarray:
        """Return the counts (19,) at rest."""
        return self._counts(np.full(len(REST_COUNTS), 1 / self.film))

    def readings(self, contacts: Sequence[Contact]) -> np.ndarray:
        """Return the counts (T, 19), not rounded, that this finger reads in T contacts of ``press``."""
        skin, typical = _skin(self.film), biotac_sheet()
        sheet = dataclasses.replace(typical, film=self.film * typical.film)
        moved = ((each.sensing_gaps - skin.watch_gap)[skin.feet :] for each in contacts)
        found = np.stack([sheet.resistances(sheet.films_of(each)) for each in moved])
        return self._counts(found / typical.resistances(typical.film))

    def _counts(self, resistance: np.ndarray) -> np.ndarray:
        """Return counts (..., 19). resistance : (..., 19), of the film if its fluid were typical, over a typical unit's
        at rest"""
        film = divider.film_impedance(REST_COUNTS)
        series = COUNT_MAX / REST_COUNTS - 1 - film
        return COUNT_MAX / (1 + series + film * resistance / self.conductivity)

    def file(self) -> ElectrodeGains:
        """Return the unit as a file of `tactile adapt` has it, with gains of 1."""
        ones, rest = [1.0] * len(REST_COUNTS), self.rest().tolist()
        return ElectrodeGains("given", ones, [0.0] * len(ones), rest, film=self.film, stiffness=self.stiffness)


@functools.cache
def _skin(film: float) -> Compliance:
    """Return the compliance of a skin with the core as far below it as a film is thick. film : over a typical one"""
    skin = compliance_of(SOURCE)
    return dataclasses.replace(skin, watch_gap=film * skin.watch_gap)


@dataclasses.dataclass(frozen=True)
class Played:
    """A recording of a unit. frames : (C,), indices of its contacts; force : (C,) N, gel : (C, M, 3) m, their truth"""

    unit: Unit
    recording: Recording
    frames: np.ndarray
    force: np.ndarray
    gel: np.ndarray


def played(number: int, unit: Unit, presses: int = PRESSES) -> Played:
    """Press a unit ``presses`` times, with rest in between, and record it. number : the recording's own seed"""
    random, (scene, _) = np.random.default_rng([SEED, number, 1]), load_scene(SCENE)
    counts, frames, force, gel = [np.tile(unit.rest(), (AT_FIRST, 1))], [], [], []
    for _ in range(presses):
        read, sizes, gels = _one_press(unit, scene, random)
        start = sum(map(len, counts))
        frames.append(start + np.arange(len(read)))
        still = np.tile(unit.rest(), (STILL, 1))
        counts += [read, np.repeat(read[-1:], HELD, axis=0), read[-2::-1], still]
        force.append(sizes)
        gel.append(gels)
    every = np.concatenate(counts)
    gain = 1 + GAIN * random.standard_normal(every.shape[1])
    noisy = unit.rest() + gain * (every - unit.rest()) + NOISE * random.standard_normal(every.shape)
    stamps = np.arange(len(every)) / SAMPLE_RATE
    recording = assemble("unit.npz", "NPZ", electrodes=converted(noisy), stamps=stamps)
    return Played(unit, recording, *map(np.concatenate, (frames, force, gel)))


def _one_press(unit: Unit, scene: Scene, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Draw a press; return counts (C, 19), force (C,) N and gels (C, M, 3) m of its contacts, deeper and deeper. It is
    drawn again if one is not found."""
    spec = paired(scene)
    while True:
        indenter = scene.indenters[int(random.integers(len(scene.indenters)))].build()
        place, deepest = draw_place(random, spec), float(np.exp(random.uniform(*np.log(FORCES))))
        sizes = deepest * np.arange(1, CONTACTS + 1) / CONTACTS
        try:
            press = unit.press(indenter, place, spec.friction)
            contacts = [press.at_force(each) for each in sizes]
            steps = [Step(force=unit.stiffness * each) for each in sizes.tolist()]
            gels = list(solve_path(TARGET, indenter, place, steps, friction=spec.friction))
        except TactileError:  # an edge sinks in, or no such force
            continue
        known = [each for each in contacts if each is not None]
        if len(known) == CONTACTS and all(each.converged and each.contact_patch.any() for each in gels):
            force = unit.stiffness * np.array([np.linalg.norm(each.force) for each in known])
            return unit.readings([each.linear for each in known]), force, np.stack([each.displacement for each in gels])


# How a unit is taken -> options and the unit's file, of what is given.
TAKEN: dict[str, Callable[[Unit], tuple[PrepareOptions | None, ElectrodeGains | None]]] = {
    "given": lambda unit: (None, unit.file()),
    "found": lambda unit: (None, None),
    "unknown": lambda unit: (PrepareOptions(film=1.0), None),
}


def rows(network: Translator, units: int = UNITS, presses: int = PRESSES) -> list[Row]:
    """Return rows of median errors on random units that are given, found or taken as typical; baseline: the errors on
    typical units. units : their number; presses : number on each. "Found" is found in the recording, as `tactile
    convert` does, which does not find the stiffness."""
    drawn = [unit_of(number) for number in range(units)]
    made, typical = ([played(*each, presses) for each in enumerate(every)] for every in (drawn, [Unit()] * units))
    beside = _errors(network, typical, "unknown")
    of = f"{sum(len(each.frames) for each in made)} contacts of {units} units; baseline: of a typical unit"
    return [
        row(f"unit_{taken}_{name}", value, metric, baseline=beside[name], of=of)
        for taken in TAKEN
        for (name, value), metric in zip(_errors(network, made, taken).items(), ("%", "mm", "1", "ms"), strict=True)
    ]


def unit_of(number: int) -> Unit:
    """Return a random unit; number : its own seed"""
    random = np.random.default_rng([SEED, number, 0])
    return Unit(*(float(np.exp(random.uniform(*np.log(each)))) for each in (FILMS, CONDUCTIVITIES, STIFFNESSES)))


def reliability(network: Translator, units: int = CHECKED, presses: int = PRESSES) -> list[Row]:
    """Return a row per bin of confidence: the share of contacts whose largest node error is below its bound, which
    should equal the confidence. units : their number; presses : number on each"""
    made = [played(OTHERS + each, unit_of(OTHERS + each), presses) for each in range(units)]
    gel, rows = np.concatenate([each.gel for each in made]), []
    found = [translated_contacts(network, made, taken) for taken in TAKEN]
    error = np.concatenate([accuracy.lengths(each.displacement_digit - gel).max(axis=1) for each in found])
    confidence, expected, bound = (
        np.concatenate([getattr(each, name) for each in found])
        for name in ("confidence", "expected_error_digit", "error_bound_digit")
    )
    for low, high in itertools.pairwise(EDGES):
        here = (confidence > low) & (confidence <= high)
        if here.sum() < FEWEST:
            continue
        share, mean = (error < bound)[here].mean(), f"{confidence[here].mean():.3f} in the mean"
        of = f"{here.sum()} contacts of {units} other units, {mean}; baseline: below the expected error"
        below = (error < expected)[here].mean()
        rows.append(row(f"confidence_to_{high:g}", share, "1", low, baseline=below, of=of, at_least=True))
    return rows


def translated_contacts(network: Translator, made: Sequence[Played], taken: str) -> Translation:
    """Return the joined translation of the recordings' contacts. taken : how units are treated, a key of TAKEN"""
    answers = []
    for each in made:
        options, unit = TAKEN[taken](each.unit)
        prepared = PreparedRows(each.recording, each.frames, network.answer, options, unit)
        answers.append(translated(network, prepared, each.frames))
    return Translation.joined(answers)


def _errors(network: Translator, made: list[Played], taken: str) -> dict[str, float]:
    """Return median errors of force, %, and place, mm, the gel's error over that of no dent, and CPU ms per contact.
    made : recordings; taken : how units are treated, a key of TAKEN"""
    began = time.process_time()
    found = translated_contacts(network, made, taken)
    spent = time.process_time() - began
    force, place, gel = found.force, found.contact_center, found.displacement_digit
    true_force, true_gel = (np.concatenate([getattr(each, name) for each in made]) for name in ("force", "gel"))
    away = accuracy.lengths(place - accuracy.dent_center(true_gel, sensors.digit_surface().rest))
    return {
        "force": float(np.median(100 * np.abs(accuracy.lengths(force) / true_force - 1))),
        "place": 1e3 * float(np.median(np.where(np.isfinite(away), away, np.inf))),  # a lost contact is not near
        "gel": float(np.linalg.norm(gel - true_gel) / np.linalg.norm(true_gel)),
        "ms": 1e3 * spent / len(force),
    }
