"""Measure translation where it is hard: unusual fingers (given, found or taken as typical), flat bodies, two contacts.

The error is that of the gel's displacement divided by that of no displacement, rms over nodes that move by more than a
tenth of the largest, mean over contacts. The forces' median error stands in a row of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from benchmarks.translation import body_rows, made_up_units, two_contact_rows
from benchmarks.translation.contact_rows import left_of_nothing
from benchmarks.translation.test_set import SEED, as_read
from tactile_core.accuracy import lengths, row
from tactile_core.training.step_errors import true_displacement
from tactile_core.translation.answer import Answer
from tactile_core.translation.translate import load_translator
from tactile_core.translation.translator import Translation, Translator

from .method import Method, best_ms
from .translation_methods import plain_signals

THIN = 0.5  # film of three real units over the typical one (shared/design/finger.md)
QUICK_PRESSES, QUICK_CONTACTS = 2, 30
UNITS = {
    "typical_unit": ("unknown", lambda _: made_up_units.Unit()),
    "typical_unit_found": ("found", lambda _: made_up_units.Unit()),
    "unit_given": ("given", made_up_units.unit_of),
    "unit_found": ("found", made_up_units.unit_of),
    "unit_unknown": ("unknown", made_up_units.unit_of),
    "thin_film_given": ("given", lambda _: made_up_units.Unit(film=THIN)),
    "thin_film_found": ("found", lambda _: made_up_units.Unit(film=THIN)),
    "weak_fluid_found": ("found", lambda _: made_up_units.Unit(conductivity=THIN)),  # rests as the thin film does
}  # how the finger is taken, and a number's unit of measurement
TWO_BALLS = {"two_balls_read_as_one": 1, "two_balls": 2}  # contacts that are looked for
NAMES = (*UNITS, "flat_bodies", *TWO_BALLS)
# What translates C contacts, to compare and to time; their gels (C, M, 3) m; force (C,) N, of all contacts of a frame
# together; the contacts in words.
Condition = tuple[Callable[[], Translation], np.ndarray, np.ndarray, str]


def measure(name: str, quick: bool) -> Method:
    """Measure one condition, such as "unit_found": CPU time to prepare and translate a frame, and errors.
    quick : on fewer contacts"""
    translated, gel, true_force, of = (
        _units(name, quick) if name in UNITS else _flat(quick) if name == "flat_bodies" else _two(name)
    )
    found = translated()
    ms = best_ms(translated, len(true_force), most=3)
    force = lengths(found.force) + np.nan_to_num(lengths(found.second_force))
    off = 100 * float(np.median(np.abs(force / true_force - 1)))
    more = row(f"conditions_{name}_force_error", off, "percent", baseline=100, of=of)
    left = float(left_of_nothing(found.displacement_digit, gel).mean())
    return Method("conditions", name, ms, None, left, "of no dent", 1.0, of, (more,))


def _units(name: str, quick: bool) -> Condition:
    taken, unit_of = UNITS[name]
    network, presses = load_translator(), QUICK_PRESSES if quick else made_up_units.PRESSES
    units = [unit_of(each) for each in range(1 if quick else made_up_units.UNITS)]
    made = [made_up_units.played(number, unit, presses) for number, unit in enumerate(units)]
    gel, force = (np.concatenate([getattr(each, of) for each in made]) for of in ("gel", "force"))
    of = f"{len(force)} contacts, {len({*units})} made-up units" if len({*units}) > 1 else f"{len(force)} contacts"
    return partial(made_up_units.translated_contacts, network, made, taken), gel, force, of


def _flat(quick: bool) -> Condition:
    pairs = body_rows.pairs_of(body_rows.flat_scene(), QUICK_CONTACTS if quick else body_rows.COUNT)
    signals = plain_signals(as_read(pairs.signal, SEED))
    gel = true_displacement(pairs, "digit", slice(None))
    of = f"{len(gel)} contacts of large balls, a plate and a cylinder"
    return partial(load_translator(), signals), gel, lengths(pairs.force), of


def _two(name: str) -> Condition:
    signal, gel, force = two_contact_rows.double_contacts()
    network = Translator(load_translator().nets, Answer(contacts=TWO_BALLS[name]))
    return partial(network, plain_signals(as_read(signal, SEED))), gel, force, f"{len(force)} contacts of two balls"
