"""Bodies drawn at random: valid indenters, the same for the same seed, of many shapes and sizes."""

import msgspec
import numpy as np

from tactile_core.geometry.indenters import Several
from tactile_core.simulation.pair_sampling import press_rows
from tactile_core.simulation.random_bodies import random_body
from tactile_core.simulation.scene import load_scene

DOWN = np.array([0.0, 0.0, -1.0])
PLANE = np.stack(np.meshgrid(*[np.linspace(-10e-3, 10e-3, 41)] * 2, [0.0]), -1).reshape(-1, 3)


def drawn(count: int, seed: int = 0) -> list:
    random = np.random.default_rng(seed)
    return [random_body(random) for _ in range(count)]


def test_each_touches_the_plane_from_above():
    for body in drawn(200):
        assert abs(body.support(DOWN)[2]) < 1e-9
        assert body.distance(PLANE)[0].min() > -1e-9  # nothing of it lies below


def test_a_seed_draws_the_same_again():
    for one, other in zip(drawn(40), drawn(40), strict=True):
        assert repr(one) == repr(other)


def test_shapes_differ():
    shapes = {type(b.parts[0][0]) if isinstance(b, Several) and len(b.parts) == 1 else type(b) for b in drawn(200)}
    assert len(shapes) == 7


def test_a_share_of_the_presses_is_of_such_a_body():
    scene = load_scene("scenes/training")[0]
    for share in (0.0, 1.0):
        some = msgspec.structs.replace(scene, pairs=msgspec.structs.replace(scene.pairs, random_bodies=share))
        rows = press_rows(some, 0, 0)
        assert rows and all((row["indenter"] == len(scene.indenters)) == bool(share) for row in rows)
