"""Changes that real fingers read in contact against the nearest simulated contact, by each law of the electrodes.

Grips are those of hard flat objects in the PHAC set (outside data), trials 04 and 05; rest is found in the soft ones'
trials 01 to 03. Slides are recordings without sample 7 of each material: they hold sizes without signs, and counts at
rest that nobody knows, so the sensors' typical one stands for them. Each law's changes are those of the very unit, by
its counts at rest (``sensors.divider``). Nothing is fitted to these recordings.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from tactile_core import recordings
from tactile_core.accuracy import Row, row
from tactile_core.mechanics.electrodes.biotac_sheet import sensing_films
from tactile_core.mechanics.electrodes.gap_law import signal_of_gaps
from tactile_core.mechanics.electrodes.reduced_sheet import reduced_sheet
from tactile_core.mechanics.fast.compliance import biotac_compliance
from tactile_core.mechanics.fast.contact import Contact, ContactProblem
from tactile_core.mechanics.placement import pose_at
from tactile_core.mechanics.thickness import DEPTH_LIMIT, thickness_under
from tactile_core.recordings.readers import each_finger
from tactile_core.sensors import REST_COUNTS, divider
from tactile_core.simulation.pair_sampling import draw_place
from tactile_core.simulation.scene import load_scene
from tactile_core.translation.unit_rest import find_rest

from . import grips, slide_set
from .slide_metrics import CONTACT

SCENE = Path(__file__).resolve().parents[3] / "scenes" / "training" / "scene.toml"
EVERY = 50  # frames of a slide between two that are judged
SIZE = 0.5  # a contact's change may be smaller or larger by this share of the real one, where its size is held


def rows(quick: bool, data: Path) -> Iterator[Row]:
    """Median cosines of each law, free and with the size held; baseline: electrodes shuffled. None without the data."""
    folders = data / "biotac_phac", data / "biotac_recordings"
    if not all(folder.exists() for folder in folders):
        return
    contacts = _training_contacts(200 if quick else 5000)
    laws = _laws(contacts)
    files = grips.find(folders[0])
    grip, rest = grip_changes(files, grips.hard_to_report(files))
    slide, _ = slide_changes(slide_set.reporting(folders[1]))
    typical = np.broadcast_to(REST_COUNTS, slide.shape)
    of = f"{len(contacts)} simulated contacts; baseline: electrodes shuffled"
    yield from _cosines("grip", grip, rest, laws, (0.92, 0.88), f"{len(grip)} grips, {of}")
    sizes = {name: lambda at_rest, law=law: np.abs(law(at_rest)) for name, law in laws.items() if name != "wrong_sign"}
    yield from _cosines("slide", slide, typical, sizes, (None, 0.95), f"{len(slide)} frames, {of}")


def _laws(contacts: list[Contact]) -> dict[str, Callable[[np.ndarray], np.ndarray]]:
    """Name -> what gives the changes (n, 19) of contacts on a unit that rests at counts (19,)."""
    gap = signal_of_gaps(np.stack([contact.electrode_gaps for contact in contacts]))
    growth = np.stack([reduced_sheet().growth(sensing_films(contact)) for contact in contacts])
    return {
        "wrong_sign": lambda at_rest: -gap,
        "gap": lambda at_rest: gap,
        "sheet": lambda at_rest: divider.reading(growth, at_rest) - at_rest,
    }


def _cosines(
    name: str, real: np.ndarray, rest: np.ndarray, laws: dict[str, Callable[[np.ndarray], np.ndarray]],
    targets: tuple[float | None, float], of: str,
) -> Iterator[Row]:  # fmt: skip
    """Rows of changes (n, 19) of units at rest counts (n, 19); the targets are the sheet's, the others stand beside."""
    shuffle = np.random.default_rng(0).permutation(real.shape[1])
    for word, law in laws.items():
        results = [nearest(change, law(at_rest)) for change, at_rest in zip(real, rest, strict=True)]
        baseline = [nearest(change[shuffle], law(at_rest)) for change, at_rest in zip(real, rest, strict=True)]
        for k, held in enumerate(("free", "size_held")):
            value, nothing = (float(np.median([one[k] for one in each])) for each in (results, baseline))
            target = targets[k] if word == "sheet" else None
            yield row(f"{name}_cosine_{word}_{held}", value, "1", target, baseline=nothing, of=of, at_least=True)


def nearest(change: np.ndarray, simulated: np.ndarray) -> tuple[float, float]:
    """Largest cosine of a change (19,) to simulated ones (n, 19): of all, and of those of its size; 0 without any."""
    size = np.linalg.norm(simulated, axis=1)
    cosine = simulated @ change / (size * np.linalg.norm(change) + 1e-9)
    alike = np.abs(size / np.linalg.norm(change) - 1) < SIZE
    return float(cosine.max()), float(cosine[alike].max(initial=0.0))


def grip_changes(files: list[Path], held: list[Path]) -> tuple[np.ndarray, np.ndarray]:
    """Change and rest (n, 19) counts of the grips ``held``, a finger each; rest is found in the soft of ``files``."""
    soft = grips.soft_to_choose_by(files)
    rest = [find_rest([recordings.read(f"{path}#{finger}") for path in soft]).counts for finger in (0, 1)]
    fingers = [(finger, recordings.read(one)) for path in held for finger, one in enumerate(each_finger(path))]
    at_rest = np.stack([rest[finger] for finger, _ in fingers])
    return np.stack([np.median(one.electrodes, axis=0) for _, one in fingers]) - at_rest, at_rest


def slide_changes(paths: list[Path]) -> tuple[np.ndarray, np.ndarray]:
    """Sizes (n, 19) counts and PDC (n,) counts of the frames surely in contact, every half second."""
    sizes, pdc = [], []
    for slide in (slide_set.load(path) for path in filter(slide_set.is_whole, paths)):
        touches = np.flatnonzero(slide.pressure > CONTACT)[::EVERY]
        sizes.append(np.abs(slide.electrodes[touches]))
        pdc.append(slide.pressure[touches])
    return np.concatenate(sizes), np.concatenate(pdc)


def _training_contacts(count: int) -> list[Contact]:
    """Contacts of the fast tier on the BioTac by the training scene's indenters at its places, always the same."""
    scene, _ = load_scene(SCENE)
    random = np.random.default_rng(0)
    found: list[Contact] = []
    while len(found) < count:
        indenter = scene.indenters[random.integers(len(scene.indenters))].build()
        pose = pose_at("biotac", indenter, draw_place(random, scene.pairs))
        limit = DEPTH_LIMIT * thickness_under("biotac", indenter, pose)
        contact = ContactProblem(biotac_compliance(), indenter, pose, limit).at_depth(limit * random.uniform())
        found += [contact] if contact.converged and len(contact.nodes) else []
    return found
