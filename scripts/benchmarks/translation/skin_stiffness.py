"""The stiffness of the BioTac's skin, ``sensors.BIOTAC_SKIN``, as real fingers tell it.

Films over the electrodes tell how far the skin has moved, PDC what pressure that took. Real changes are held against
simulated ones of nearly their size and most like them; pressure grows with the skin's modulus at the same shape, so the
ratio of measured to simulated pressure is the factor that the modulus is off by. Only recordings that may be chosen by:
grips of hard flat objects in the PHAC set, trials 01 to 03, whose pressure is counted from the flour sack's, the lowest
(so that it is a little too small), and slides, sample 7, whose unit's counts at rest nobody knows.
"""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from tactile_core import recordings, sensors
from tactile_core.accuracy import Row, row
from tactile_core.mechanics.electrodes.law import signal_of
from tactile_core.mechanics.force_search import UnreachableError
from tactile_core.mechanics.penetration import PenetrationError
from tactile_core.mechanics.placement import pose_at
from tactile_core.mechanics.solve import Step, solve_path
from tactile_core.mechanics.thickness import DEPTH_LIMIT, depth_at
from tactile_core.recordings.readers import each_finger
from tactile_core.sensors import PRESSURE_PER_COUNT, REST_COUNTS, divider
from tactile_core.simulation.pair_sampling import draw_place
from tactile_core.simulation.scene import load_scene

from . import grips, slide_set
from .simulated_patterns import SCENE, grip_changes, slide_changes

LOWEST = "flour_sack"  # the softest of the objects that are held
SIZE, ALIKE = 0.25, 10  # contacts may differ in size by this share; of as many, the most alike, the median is taken


def rows(quick: bool, data: Path) -> Iterator[Row]:
    """Measured over simulated pressure, median and quartiles, in grips and slides; none without the data."""
    folders = data / "biotac_phac", data / "biotac_recordings"
    if not all(folder.exists() for folder in folders):
        return
    signal, pressure = _simulated(60 if quick else 600)
    for name, (changes, rests, measured) in {"grips": _grips(folders[0]), "slides": _slides(folders[1])}.items():
        ratio = [
            real / _pressure(np.abs(change) if name == "slides" else change, rest, signal, pressure, name == "slides")
            for change, rest, real in zip(changes, rests, measured, strict=True)
        ]
        low, middle, high = np.nanpercentile(ratio, [25, 50, 75])
        of = f"{len(ratio)} {name}, quartiles {low:.2f} and {high:.2f}; E {sensors.BIOTAC_SKIN.youngs / 1e6:g} MPa"
        yield row(f"skin_stiffness_ratio_{name}", float(middle), "1", of=of)


def _pressure(change: np.ndarray, rest: np.ndarray, signal: np.ndarray, pressure: np.ndarray, folded: bool) -> float:
    """Simulated pressure, Pa, at the size of a change (19,) of a unit at rest counts (19,); NaN of unheard sizes."""
    simulated = divider.of_unit(signal, rest)
    simulated = np.abs(simulated) if folded else simulated
    size, own = np.linalg.norm(simulated, axis=1), np.linalg.norm(change)
    cosine = np.where(np.abs(size / own - 1) < SIZE, simulated @ change / (size * own + 1e-9), -1)
    best = np.argsort(-cosine)[:ALIKE]
    return float(np.median(pressure[best] * own / size[best])) if cosine[best[0]] > -1 else np.nan


def _simulated(presses: int) -> tuple[np.ndarray, np.ndarray]:
    """Changes (n, 19) counts and pressures (n,) Pa of presses of the training scene on the BioTac, by the fast tier."""
    scene, _ = load_scene(SCENE)
    spec, random = scene.pairs, np.random.default_rng(0)
    found: list[tuple[np.ndarray, float]] = []
    for _ in range(presses):
        indenter = scene.indenters[random.integers(len(scene.indenters))].build()
        pose = pose_at("biotac", indenter, draw_place(random, spec))
        limit = depth_at(DEPTH_LIMIT, "biotac", indenter, pose)
        start = spec.force_min_n * spec.force_ratio ** random.uniform()
        steps = (Step(force=start * spec.force_ratio**step) for step in itertools.count())
        with contextlib.suppress(UnreachableError, PenetrationError):
            for contact in solve_path("biotac", indenter, pose, steps, friction=spec.friction, limit=limit):
                found.append((signal_of(contact), contact.pressure))
    return np.stack([signal for signal, _ in found]), np.array([pressure for _, pressure in found])


_Real = tuple[np.ndarray, np.ndarray, np.ndarray]  # changes and rests (n, 19) counts, pressures (n,) Pa


def _grips(folder: Path) -> _Real:
    files = grips.find(folder)
    lowest = [path for path in grips.soft_to_choose_by(files) if LOWEST in path.name]
    held = grips.hard_to_choose_by(files)
    zero = np.median([_pdc(path) for path in lowest], axis=0)
    measured = PRESSURE_PER_COUNT * np.concatenate([_pdc(path) - zero for path in held])
    return *grip_changes(files, held), measured


def _pdc(path: Path) -> list[float]:
    """Counts of each finger."""
    return [float(np.median(recordings.read(one).pdc)) for one in each_finger(path)]


def _slides(folder: Path) -> _Real:
    sizes, pdc = slide_changes([path for path in slide_set.find(folder) if path not in slide_set.reporting(folder)])
    return sizes, np.broadcast_to(REST_COUNTS, sizes.shape), PRESSURE_PER_COUNT * pdc
