"""Tell two contacts at once apart, and translate the weaker one. A network divides the signals into those of each
contact; the networks for one contact then read each part."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from .. import sensors
from .card import PARTS
from .gel_place import contact_center
from .layers import compress, in_blocks, residual
from .networks import Networks
from .posterior import touches

FINE = 5.0  # ratio of the networks' scale, 15 counts, to that of the second input of `parts`: 3 counts, as noise is
PARTED = 0.25  # unit of half the difference of both parts, over the signal's length (assumed)


class SecondContact(NamedTuple):
    """Second contacts, found in n of T frames of e electrodes. rows : (n,) int, indices of these frames
    skin, gel : (n, N, 3), (n, M, 3) m, displacements; predicted : (n, e) counts, the electrodes' changes by them
    center : (T, 2) = (x, z) m on the gel, NaN without one; force : (T, 3) N, zero without one"""

    rows: np.ndarray
    skin: np.ndarray
    gel: np.ndarray
    predicted: np.ndarray
    center: np.ndarray
    force: np.ndarray


def told_apart(nets: Networks, change: np.ndarray, unsigned: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Split change (T, e) counts into the stronger contact's part and the weaker's, both (T, e); in frames of a single
    contact they are the whole change and NaN. unsigned : (T,) bool, frames whose signs are lost, which are not split"""
    tensors, blocks = nets.tensors[PARTS], nets.sizes[PARTS]["blocks"]
    change = np.asarray(change, np.float32)
    seen = np.concatenate([compress(change), compress(np.float32(FINE) * change)], -1)
    found = in_blocks(lambda block: residual(block, tensors, "map", blocks), seen, seen.shape[1:], PARTS)
    half = found[:, :-1] * np.float32(PARTED) * np.sqrt(np.square(change).sum(-1, keepdims=True))
    both = np.stack([change / 2 + half, change / 2 - half])
    order = np.argsort(-np.square(both).sum(-1), axis=0, kind="stable")
    stronger, weaker = np.take_along_axis(both, order[..., None], axis=0)
    two = ((found[:, -1] > tensors["single"]) & ~unsigned)[:, None]
    return np.where(two, stronger, change), np.where(two, weaker, np.float32(np.nan))


def second_contact(
    nets: Networks, change: np.ndarray, silent: np.ndarray, mounted: Callable[[np.ndarray], np.ndarray], least: float,
    stiffness: float,
) -> SecondContact:  # fmt: skip
    """Translate the weaker of two contacts, each frame alone. change : (T, e) counts, by it; NaN if there is none
    silent : (T,) bool, frames without a first contact, which get no second
    mounted : function that moves gels (n, M, 3) m by the mount's shift
    least : m, displacement of the deepest node from which it counts as contact; stiffness : of the skin, 1 typical"""
    center, force = np.full((len(change), 2), np.nan, np.float32), np.zeros((len(change), 3), np.float32)
    rows = np.flatnonzero(np.isfinite(change).all(axis=1) & ~silent & (change.shape[1] > 0))
    if not len(rows):
        nothing = np.zeros((0, 1, 3), np.float32)
        return SecondContact(rows, nothing, nothing, nothing[..., 0], center, force)
    latent = nets.encode_signal(change[rows])
    state = nets.contact(latent)
    source, target = nets.latents(latent, state)
    gel = mounted(nets.decode_target(target))
    place = contact_center(gel, sensors.sensor_surface(nets.target).rest, least)
    felt = touches(state) & np.isfinite(place[:, 0])
    rows, place, source = rows[felt], place[felt], source[felt]
    center[rows], force[rows] = place, stiffness * nets.force_in(state[felt], source)
    return SecondContact(
        rows, nets.decode_source(source), gel[felt], nets.decode_signal(nets.m2s(source)), center, force
    )  # fmt: skip
