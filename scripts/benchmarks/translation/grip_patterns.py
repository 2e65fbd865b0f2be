"""Changes that real fingers read in grips against the nearest simulated contact, by each law of the electrodes.

The grips are those of hard flat objects in the PHAC set (outside data), trials 04 and 05; rest is found in the soft
objects' trials 01 to 03. The sheet's resistances become counts of the very unit: each electrode's impedance Z grows by
the factor of its resistance, and a divider reads E = 4095 / (1 + Z / load) (SynTouch, BioTac SP manual), so that rest
counts alone tell the change, whatever load and conductivity are. Nothing is fitted to the grips.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from tactile_core import recordings
from tactile_core.accuracy import Row, row
from tactile_core.mechanics.electrodes.biotac_sheet import biotac_sheet
from tactile_core.mechanics.electrodes.gap_law import signal_of_gaps
from tactile_core.mechanics.electrodes.reduced_sheet import reduced_sheet
from tactile_core.mechanics.fast.compliance import biotac_compliance
from tactile_core.mechanics.fast.contact import Contact, ContactProblem
from tactile_core.mechanics.placement import pose_at
from tactile_core.mechanics.thickness import DEPTH_LIMIT, thickness_under
from tactile_core.recordings.readers import each_finger
from tactile_core.sensors import COUNT_MAX
from tactile_core.simulation.pair_sampling import draw_place
from tactile_core.simulation.scene import load_scene
from tactile_core.translation.unit_rest import find_rest

from ..mechanics.electrode_law import watched_films
from . import grips

SCENE = Path(__file__).resolve().parents[3] / "scenes" / "training" / "scene.toml"
SIZE = 0.5  # a contact's change may be smaller or larger by this share of the real one, where its size is held


def rows(quick: bool, data: Path) -> Iterator[Row]:
    """Median cosines of each law, free and with the size held; null: electrodes shuffled. None without the data."""
    folder = data / "biotac_phac"
    if not folder.exists():
        return
    real, rest = _grips(grips.find(folder))
    contacts = _training_contacts(200 if quick else 2000)
    gap = signal_of_gaps(np.stack([contact.electrode_gaps for contact in contacts]))
    growth = np.stack([reduced_sheet().resistances(films) for films in watched_films(contacts)])
    growth /= reduced_sheet().resistances(biotac_sheet().film)
    laws = {
        "wrong_sign": lambda at_rest: -gap,
        "gap": lambda at_rest: gap,
        "sheet": lambda at_rest: COUNT_MAX / (1 + (COUNT_MAX / at_rest - 1) * growth) - at_rest,
    }
    shuffle = np.random.default_rng(0).permutation(real.shape[1])
    of = f"{len(real)} grips, {len(contacts)} simulated contacts; null: electrodes shuffled"
    for name, law in laws.items():
        told = [nearest(change, law(at_rest)) for change, at_rest in zip(real, rest, strict=True)]
        null = [nearest(change[shuffle], law(at_rest)) for change, at_rest in zip(real, rest, strict=True)]
        for k, (held, target) in enumerate((("free", 0.92), ("size_held", 0.88))):
            values = (float(np.median([one[k] for one in each])) for each in (told, null))
            value, nothing = values
            yield row(f"grip_cosine_{name}_{held}", value, "1", target, null=nothing, of=of, at_least=True)


def nearest(change: np.ndarray, simulated: np.ndarray) -> tuple[float, float]:
    """Largest cosine of a change (19,) to simulated ones (n, 19): of all, and of those of its size; 0 without any."""
    size = np.linalg.norm(simulated, axis=1)
    cosine = simulated @ change / (size * np.linalg.norm(change) + 1e-9)
    alike = np.abs(size / np.linalg.norm(change) - 1) < SIZE
    return float(cosine.max()), float(cosine[alike].max(initial=0.0))


def _grips(files: list[Path]) -> tuple[np.ndarray, np.ndarray]:
    """Change (n, 19) of the hard objects' grips, a finger each, and the unit's rest (n, 19), counts."""
    soft = grips.soft_to_choose_by(files)
    rest = [find_rest([recordings.read(f"{path}#{finger}") for path in soft]).counts for finger in (0, 1)]
    held = [(finger, recordings.read(one)) for path in grips.hard_to_report(files)
            for finger, one in enumerate(each_finger(path))]  # fmt: skip
    at_rest = np.stack([rest[finger] for finger, _ in held])
    return np.stack([np.median(one.electrodes, axis=0) for _, one in held]) - at_rest, at_rest


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
