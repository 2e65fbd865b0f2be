"""Judge grips of real fingers, the PHAC set: is a flat object felt over the electrodes that it squeezes?

Two fingers of a robot's gripper hold hard and soft objects. The hand never opens, so the electrodes' rest is found in
trials 01 to 03 of soft objects; judged are trials 04 and 05 of hard objects, by which nothing was chosen.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from tactile_core import recordings
from tactile_core.accuracy import Row, lengths, row
from tactile_core.errors import TactileError
from tactile_core.recordings import Recording
from tactile_core.recordings.flags import Flag
from tactile_core.recordings.polarity import TOUCHING
from tactile_core.recordings.preparer import Preparer
from tactile_core.recordings.readers import each_finger
from tactile_core.recordings.signals import Signals
from tactile_core.sensors import electrodes
from tactile_core.translation import adapt, networks, reference_signals
from tactile_core.translation.simulated_likeness import residual_shares, unlike
from tactile_core.translation.translate import pass_over
from tactile_core.translation.translator import Translator

PATTERN = "*_HOLD.mat"  # <object>_<number>_<trial>_HOLD.mat
HARD = ("acrylic", "steel_vase")
SOFT = "found in the soft objects"
CHOOSING, REPORTING = ("01", "02", "03"), ("04", "05")
SQUEEZED = np.array([6, 7, 8, 9, 16])  # E7 to E10 and E17 lie under a flat object (docs/sources.md, BioTac electrodes)
MARGIN, LARGEST_Z = 1.5e-3, 3e-3  # m, round the squeezed electrodes
EVERY = 20  # frames between two that are judged: a grip hardly changes


def find(folder: Path) -> list[Path]:
    """List the set's files in a folder, sorted; empty if the folder has none."""
    return sorted(folder.glob(PATTERN))


def hard_to_report(files: list[Path]) -> list[Path]:
    """Select the grips of hard flat objects in the trials that nothing was chosen by."""
    return [path for path in files if _trial(path) in REPORTING and path.name.startswith(HARD)]


def rows(folder: Path, network: Translator) -> list[Row]:
    """Return rows of the grips in a folder. Raises TactileError if the trials that rest is found in, or those that are
    judged, are missing."""
    files = find(folder)
    soft = [path for path in files if _trial(path) in CHOOSING and not path.name.startswith(HARD)]
    hard = hard_to_report(files)
    if not soft or not hard:
        raise TactileError(folder, f"{len(soft)} soft and {len(hard)} hard grips", "some of each, by their trials")
    sensor, _ = adapt.adapt_hand(soft, reference_signals.read(networks.WEIGHTS_FOLDER))
    shuffle = np.random.default_rng(0).permutation(len(electrodes()))
    loaded, known, judged, shuffled = [], [], [], []
    for finger, one in ((finger, one) for path in hard for finger, one in enumerate(each_finger(path))):
        recording = recordings.read(one)
        loaded.append(Preparer()(recording))
        known.append(Preparer(None, sensor.gains_for(one, f"finger{finger}", SOFT))(recording))
        judged.append(_judged(recording, known[-1], network, slice(None)))
        shuffled.append(_judged(recording, known[-1], network, shuffle))
    of = f"{len(judged)} grips of hard flat objects, trials 04 and 05; baseline: electrodes shuffled"
    inside, placed, beyond = zip(np.mean(judged, axis=0), np.mean(shuffled, axis=0), strict=True)
    loaded_of = f"{len(judged)} grips of hard flat objects, rest taken during the grip; baseline: with the unit's rest"
    doubted = unexplained(loaded), unexplained(known)
    return [
        row("grip_place_in_box", inside[0], "1", 0.95, baseline=inside[1], of=of, at_least=True),
        row("grip_place_found", placed[0], "1", 0.9, baseline=placed[1], of=of, at_least=True),
        row("grip_out_of_range", beyond[0], "1", 0.2, baseline=beyond[1], of=of),
        row("grip_unexplained", doubted[0], "1", 0.9, baseline=doubted[1], of=loaded_of, at_least=True),
    ]


def unexplained(several: list[Signals]) -> float:
    """Return the share of frames that are called unexplained, among all recordings' frames with a touch."""
    change = np.concatenate([each.typical for each in several])
    shares = residual_shares(change, np.zeros(len(change), bool))
    return float(unlike(shares, change)[lengths(change) >= TOUCHING].mean())


def _judged(
    recording: Recording, signals: Signals, network: Translator, order: np.ndarray | slice
) -> tuple[float, float, float]:
    """Return 1 if the median place of a grip lies in the box, else 0; the share of frames with a place; and that of
    frames flagged out of range. order : in which the electrodes are read, 19 indices or a slice"""
    signals = dataclasses.replace(signals, change=signals.change[:, order], rest=signals.rest[order])
    found = pass_over(network, signals, recording.time)(np.arange(0, len(recording), EVERY)).translation
    known = np.isfinite(found.contact_center[:, 0])
    within = known.any() and in_box(np.median(found.contact_center[known], axis=0))
    return float(within), float(known.mean()), float((found.flags & Flag.OUT_OF_RANGE > 0).mean())


def in_box(place: np.ndarray) -> bool:
    """Return true if a place (2,) m, (x, z), lies over the electrodes that a flat object squeezes."""
    x = electrodes()[SQUEEZED, 0]
    return bool(x.min() - MARGIN <= place[0] <= x.max() + MARGIN and abs(place[1]) <= LARGEST_Z)


def _trial(path: Path) -> str:
    return path.stem.split("_")[-2]
