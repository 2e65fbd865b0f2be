"""The network that tells two contacts apart learns to, on made-up signals."""

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="training needs torch")

from tactile_core.mechanics.electrodes.biotac_sheet import rest_counts  # noqa: E402
from tactile_core.sensors import SOURCE, electrodes  # noqa: E402
from tactile_core.simulation.pairs_file import split_presses  # noqa: E402
from tactile_core.training.options import Options  # noqa: E402
from tactile_core.training.two_contacts import Presses, train_parts  # noqa: E402
from tactile_core.translation.layers import compress, residual  # noqa: E402
from tactile_core.translation.second_contact import FINE  # noqa: E402

OPTIONS = Options(parts_steps=60, mirrored=0.0, unit=0.0)


def pressed(places):
    """Signals (C, 19) of contacts over places (C, 2) m: the nearest electrodes fall."""
    away = np.square(places[:, None] - electrodes(SOURCE)[:, [0, 2]]).sum(-1)
    return (-200 * np.exp(-away / 3e-3**2)).astype(np.float32)


def test_two_contacts_are_told_from_one():
    random = np.random.default_rng(0)
    place = random.uniform([-16e-3, -5e-3], [0, 5e-3], (600, 2))
    presses = Presses(pressed(place), place, np.ones(len(place)))
    split = split_presses(np.arange(len(place)) // 2, 0, "made up")
    given = presses, split, OPTIONS, rest_counts(SOURCE), SOURCE, 0
    said = []
    tensors = train_parts(*given, lambda share, text: said.append(share))
    assert said == [1.0]
    again = train_parts(*given, lambda share, text: None)
    assert all(np.array_equal(tensors[name], again[name]) for name in tensors)
    first, second = np.float32([[-14e-3, 0.0]] * 9), np.float32([[-2e-3, z] for z in np.linspace(-3e-3, 3e-3, 9)])
    alone, both = pressed(second), pressed(first) + pressed(second)
    likely = [
        residual(np.concatenate([compress(each), compress(FINE * each)], -1), tensors, "map", 3)[:, -1]
        for each in (alone, both)
    ]
    assert likely[0].max() < likely[1].min()
