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
from tactile_core.recordings.electrode_gains import ElectrodeGains, SensorFile
from tactile_core.recordings.flags import Flag
from tactile_core.recordings.polarity import TOUCHING
from tactile_core.recordings.preparer import Preparer
from tactile_core.recordings.readers import each_finger
from tactile_core.recordings.signals import Signals
from tactile_core.sensors import digit_surface, electrodes, shape_of
from tactile_core.simulation.pairs_file import Pairs
from tactile_core.translation import adapt, networks, reference_signals
from tactile_core.translation.gel_place import contact_center
from tactile_core.translation.simulated_likeness import residual_shares, unlike
from tactile_core.translation.translate import pass_over
from tactile_core.translation.translator import Translator

from .test_set import as_read

PATTERN = "*_HOLD.mat"  # <object>_<number>_<trial>_HOLD.mat
HARD = ("acrylic", "steel_vase")
SOFT = "found in the soft objects"
CHOOSING, REPORTING = ("01", "02", "03"), ("04", "05")
SQUEEZED = np.array([6, 7, 8, 9, 16])  # E7 to E10 and E17 lie under a flat object (docs/sources.md, BioTac electrodes)
MARGIN, LARGEST_Z = 1.5e-3, 3e-3  # m, round the squeezed electrodes
DEEP = 0.3e-3  # m on the BioTac: lighter simulated contacts than grips are
SEED = 7  # of the simulated readings' noise
EVERY = 20  # frames between two that are judged: a grip hardly changes


def find(folder: Path) -> list[Path]:
    """List the set's files in a folder, sorted; empty if the folder has none."""
    return sorted(folder.glob(PATTERN))


def soft_to_choose_by(files: list[Path]) -> list[Path]:
    """Select the grips of soft objects in the trials that rest is found in."""
    return [path for path in files if _trial(path) in CHOOSING and not path.name.startswith(HARD)]


def hard_to_report(files: list[Path]) -> list[Path]:
    """Select the grips of hard flat objects in the trials that nothing was chosen by."""
    return [path for path in files if _trial(path) in REPORTING and path.name.startswith(HARD)]


def rows(folder: Path, network: Translator, simulated: Pairs) -> list[Row]:
    """Return rows of the grips in a folder, and of the place of ``simulated`` contacts. Raises TactileError if the
    trials that rest is found in, or those that are judged, are missing."""
    files = find(folder)
    soft = soft_to_choose_by(files)
    hard = hard_to_report(files)
    if not soft or not hard:
        raise TactileError(folder, f"{len(soft)} soft and {len(hard)} hard grips", "some of each, by their trials")
    sensor, _ = adapt.adapt_hand(soft, reference_signals.read(networks.WEIGHTS_FOLDER))
    held = [(one, finger) for path in hard for finger, one in enumerate(each_finger(path))]
    prepared = [
        Preparer(None, sensor.gains_for(one, f"finger{finger}", SOFT))(recordings.read(one)) for one, finger in held
    ]
    found = [*_place_rows(hard, network, sensor), _simulated_place_row(network, simulated)]
    return [*found, _unexplained_row(held, prepared)]


def _unexplained_row(held: list[tuple[str, int]], known: list[Signals]) -> Row:
    """Return a row of the share of frames called unexplained in the grips ``held``, (file, finger), if rest is wrongly
    taken during the grip; baseline: in ``known``, the same grips' signals with the unit's own rest."""
    loaded = [Preparer()(recordings.read(one)) for one, _ in held]
    of = f"{len(held)} grips of hard flat objects, rest taken during the grip; baseline: with the unit's rest"
    return row("grip_unexplained", unexplained(loaded), "1", 0.9, baseline=unexplained(known), of=of, at_least=True)


def unexplained(several: list[Signals]) -> float:
    """Return the share of frames that are called unexplained, among all recordings' frames with a touch."""
    change = np.concatenate([each.typical for each in several])
    shares = residual_shares(change, np.zeros(len(change), bool))
    return float(unlike(shares, change)[lengths(change) >= TOUCHING].mean())


def _place_rows(hard: list[Path], network: Translator, sensor: SensorFile) -> list[Row]:
    """Return rows on every finger in the grips' files ``hard``; baseline: with its electrodes in a random order."""
    shuffle = np.random.default_rng(0).permutation(len(electrodes()))
    results, baseline = [], []
    for path in hard:
        for finger, one in enumerate(each_finger(path)):
            unit = sensor.gains_for(one, f"finger{finger}", SOFT)
            results.append(_judged(recordings.read(one), unit, network))
            baseline.append(_judged(recordings.read(one), unit, network, shuffle))
    of = f"{len(results)} grips of hard flat objects, trials 04 and 05; baseline: electrodes shuffled"
    metrics = [np.array([one[k] for one in results]) for k in range(3)]
    shuffled = [np.array([one[k] for one in baseline]) for k in range(3)]
    return [
        row("grip_place_in_box", metrics[0].mean(), "1", 0.95, baseline=shuffled[0].mean(), of=of, at_least=True),
        row("grip_place_found", metrics[1].mean(), "1", 0.9, baseline=shuffled[1].mean(), of=of, at_least=True),
        row("grip_out_of_range", metrics[2].mean(), "1", 0.2, baseline=shuffled[2].mean(), of=of),
    ]


def _simulated_place_row(network: Translator, pairs: Pairs) -> Row:
    """Return a row of the error of place on simulated contacts, read with noise; baseline: their middle place."""
    nets = network.nets
    deep = (pairs.depth_biotac > DEEP) & ~pairs.slide.any(axis=1) & (pairs.place[:, 0] > shape_of("digit").tip_x)
    gel = nets.decode_target(nets.likely_latents(nets.encode_signal(as_read(pairs.signal[deep], SEED)))[1])
    found = contact_center(gel, digit_surface().rest, network.silent("digit_m"))
    scale = np.float32(pairs.scale_digit)
    true = contact_center(pairs.displacement_digit[deep] * scale, digit_surface().rest, 0.0)
    away, nothing = (1e3 * np.linalg.norm(each - true, axis=1) for each in (found, np.median(true, axis=0)))
    lost = np.isnan(away).sum()
    of = f"{deep.sum()} test contacts deeper than {1e3 * DEEP:g} mm, {lost} lost; baseline: their middle"
    away[np.isnan(away)] = np.inf  # a contact that is not found is not near
    return row("simulated_place_error", float(np.median(away)), "mm", 0.6, baseline=float(np.median(nothing)), of=of)


def _judged(
    recording: Recording, unit: ElectrodeGains, network: Translator, order: np.ndarray | slice = slice(None)
) -> tuple[float, float, float]:
    """Return 1 if the median place of a grip lies in the box, else 0; the share of frames with a place; and that of
    frames flagged out of range. order : in which the electrodes are read, 19 indices or a slice"""
    signals = Preparer(None, unit)(recording)
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
