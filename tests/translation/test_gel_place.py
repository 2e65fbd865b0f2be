"""Contact patches of gels that are hardly dented, and of silence."""

import dataclasses

import numpy as np
import pytest

from tactile_core import recordings, sensors
from tactile_core.translation import gel_place, translate


@pytest.fixture(scope="module")
def gel():
    return sensors.digit_surface()


WIDTH = 1.5e-3  # m, of a Gaussian dent


def away(gel):
    return np.linalg.norm(gel.rest[:, [0, 2]] - [-8e-3, 1e-3], axis=1)


def dent(gel, depth):
    moved = np.zeros((1, *gel.rest.shape))
    moved[0, :, 1] = depth * np.exp(-0.5 * (away(gel) / WIDTH) ** 2)
    return moved


def test_the_patch_of_a_dent_is_where_it_bends_inward(gel):
    """A Gaussian dent bends inward within sqrt(2) of its width from its middle: its Laplacian changes sign there."""
    patch, radius = gel_place.contact_patch(dent(gel, 0.4e-3), gel)[0], np.sqrt(2) * WIDTH
    cell = 0.35e-3  # between nodes: the edge is known no better, and the smoothing widens it by less
    assert patch[away(gel) < radius - 1.5 * cell].all()
    assert not patch[away(gel) > radius + 1.5 * cell].any()


@pytest.mark.parametrize(("depth", "touched"), [(0, False), (0.9, False), (1.2, True)])
def test_a_dent_is_a_contact_from_an_absolute_depth_on(gel, depth, touched):
    patch = gel_place.contact_patch(dent(gel, depth * gel_place.FLOOR), gel)
    assert patch.any() == touched


def test_what_the_networks_make_of_noise_alone_shows_no_contact(shipped, gel):
    """Three seconds of an untouched sensor: the shipped recording with nothing but noise in it, followed as always."""
    signals = recordings.prepare(shipped)
    noise = np.random.default_rng(5).normal(scale=1.5, size=signals.change.shape)  # counts: docs/sources.md, read-out
    silent = dataclasses.replace(signals, change=noise.astype(signals.change.dtype))
    followed = translate.pass_over(translate.load_translator(), silent, shipped.time)
    moved = followed(np.arange(len(shipped))).translation.displacement_digit
    assert not gel_place.contact_patch(moved, gel).any()
