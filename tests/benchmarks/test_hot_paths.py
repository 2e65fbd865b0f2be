"""Times of what runs in every frame, for pytest-benchmark to compare; that they are right is tested elsewhere."""

from collections.abc import Callable

import numpy as np
import pytest

from tactile_core.geometry.indenters import Sphere
from tactile_core.mechanics.fast.compliance import compliance_of
from tactile_core.mechanics.fast.press import CorrectedPress
from tactile_core.mechanics.placement import FRICTION, Placement, pose_at
from tactile_core.pictures.height_map import gel_mapper
from tactile_core.pictures.presets import FAST
from tactile_core.pictures.renderer import Renderer
from tactile_core.translation import networks

BALL, PLACE = Sphere(3.5e-3), Placement(-8e-3, 1e-3)
QUICK = {"warmup_rounds": 1, "rounds": 3, "iterations": 1}  # a comparison, not a measurement: scripts/benchmark.py


@pytest.fixture(scope="module")
def nets() -> networks.Networks:
    return networks.load()


@pytest.mark.parametrize("frames", [1, 64])
def test_translation(nets: networks.Networks, benchmark: Callable, frames: int) -> None:
    change = np.random.default_rng(0).normal(0, 30, (frames, 19)).astype(np.float32)

    def translate() -> np.ndarray:
        biotac, digit = nets.likely_latents(nets.encode_signal(change))
        nets.decode_biotac(biotac)
        return nets.decode_digit(digit)

    assert np.isfinite(benchmark.pedantic(translate, **QUICK)).all()


@pytest.mark.parametrize("sensor", ["digit", "biotac"])
def test_fast_contact(benchmark: Callable, sensor: str) -> None:
    pose, compliance = pose_at(sensor, BALL, PLACE), compliance_of(sensor)

    def press() -> float:
        return CorrectedPress(compliance, BALL, pose, 1e-3, FRICTION).at_depth(0.4e-3).axial_force

    assert benchmark.pedantic(press, **QUICK) > 0


def test_height_map_and_fast_picture(nets: networks.Networks, benchmark: Callable) -> None:
    moved = nets.decode_digit(np.zeros((1, nets.sizes["MVD"]["latent"]), np.float32))[0]
    mapper, renderer = gel_mapper(), Renderer(preset=FAST)
    picture = benchmark.pedantic(lambda: renderer(mapper(moved)), **QUICK)
    assert picture.shape == (320, 240, 3)
