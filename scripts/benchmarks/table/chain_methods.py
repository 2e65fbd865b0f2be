"""Measure the whole chain, from signals to pictures, against reference pictures of the true deformation."""

from __future__ import annotations

import dataclasses

import numpy as np

from benchmarks.measure_presets import QUICK_PASSES, changes, converge, rms
from benchmarks.translation.test_set import SEED, as_read
from tactile_core.jobs.frame_pass import CHUNK
from tactile_core.pictures.height_map import gel_mapper
from tactile_core.pictures.presets import FAST, REFERENCE
from tactile_core.sensors.calibration_file import load_calibration
from tactile_core.simulation.pairs_file import Pairs
from tactile_core.training.step_errors import true_displacement
from tactile_core.translation.translate import load_translator

from .method import Method, best_ms, peak_mb, test_contacts
from .pictures_methods import of_preset
from .translation_methods import plain_signals

NAMES = ("truth", FAST, "standard", "quality")
CONTACTS, QUICK_CONTACTS = 8, 3
PASSES = 16  # of the reference: its noise, 0.12 levels, is far below what is measured here
LEAST = 0.1e-3  # m, that a contact moves the gel: lighter ones are hardly seen
SEED_OF_CONTACTS = 5


def measure(name: str, quick: bool, truth: str) -> Method | None:
    """Measure the chain that ends in the preset ``name``, against pictures in the file ``truth``.

    quick : on fewer contacts. The method named "truth" writes that file, and returns None. Needs mitsuba."""
    unit, pairs = load_calibration(), _contacts(QUICK_CONTACTS if quick else CONTACTS)
    mapper = gel_mapper(unit.camera)
    if name == "truth":
        _draw_truth(unit, mapper, pairs, QUICK_PASSES if quick else PASSES, truth)
        return None
    translator, (renderer, label) = load_translator(), of_preset(unit, name)
    change = as_read(pairs.signal, SEED)
    frames = np.resize(change, (CHUNK, change.shape[1]))
    found = translator(plain_signals(change)).displacement_digit
    height = mapper(found[0])
    ms = best_ms(lambda: translator(plain_signals(frames)), CHUNK)
    ms += best_ms(lambda: mapper(found[0])) + best_ms(lambda: renderer(height))
    mb = peak_mb()
    with np.load(truth, allow_pickle=False) as file:
        true = file["pictures"]
    of = f"{len(true)} test contacts, signal to picture, against the reference picture of the true deformation"
    return Method("chain", label, ms, mb, rms(changes(renderer, mapper(found)), true), "levels", rms(true), of)


def _contacts(count: int) -> Pairs:
    """Return ``count`` test contacts in the camera's view, the same ones in every run."""
    pairs, camera = test_contacts(quick=False), load_calibration().camera
    deep = np.abs(pairs.displacement_digit[..., 1]).max(axis=1) * pairs.scale_digit > LEAST
    row, column = camera.to_pixel(pairs.contact_center[:, 0], pairs.contact_center[:, 1])
    seen = deep & (row >= 0) & (row < camera.height) & (column >= 0) & (column < camera.width)
    rows = np.random.default_rng(SEED_OF_CONTACTS).permutation(np.flatnonzero(seen))[:count]
    return pairs.select_rows(np.sort(rows))


def _draw_truth(unit, mapper, pairs, passes, file) -> None:  # noqa: ANN001
    heights = list(mapper(true_displacement(pairs, "digit", np.arange(len(pairs.press)))))
    drawn = converge(unit, heights, dataclasses.replace(REFERENCE, passes=passes), seed=0)
    np.savez(file, pictures=[full for _, full in drawn])
