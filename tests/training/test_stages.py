"""What shapes which network: each is trained, rectified signals shape SVB by its own loss and R2MPN, nothing else."""

from __future__ import annotations

import numpy as np
import pytest
from small_pairs import frame, write_pairs

torch = pytest.importorskip("torch", reason="training needs torch")

from tactile_core.paired_contacts import read_pairs, split_presses  # noqa: E402
from tactile_core.training.data import Contacts  # noqa: E402
from tactile_core.training.options import Options  # noqa: E402
from tactile_core.training.stages import STAGES, Model, chain_loss, r2mpn_loss  # noqa: E402

SIZES = {"wide_biotac": 4, "near_biotac": 4, "half_biotac": 3, "wide_digit": 4, "near_digit": 4, "half_digit": 3}
OPTIONS = Options(**SIZES, width=16, latent_biotac=6, latent_digit=7, mirrored=0)


@pytest.fixture(scope="module")
def contacts(tmp_path_factory):
    path = write_pairs(tmp_path_factory.mktemp("pairs") / "pairs.h5")
    pairs, frames = read_pairs(path), {name: frame(name, 3) for name in ("biotac", "digit")}
    return Contacts(pairs, split_presses(pairs.press, 0, path), OPTIONS, frames, torch.Generator().manual_seed(0))


def shaped(contacts, loss, rectified):
    """The networks that a batch of so many rectified signals gives a gradient."""
    model = Model(OPTIONS, contacts, torch.Generator().manual_seed(0))
    rows = contacts.split.train[:16]
    batch = contacts.batch(rows, contacts.read(rows, np.random.default_rng(0), rectified))
    value = loss(model, contacts, batch, OPTIONS, torch.Generator().manual_seed(0))
    value.backward()
    assert torch.isfinite(value)
    return {
        name
        for name, net in model.named_children()
        if any(each.grad is not None and each.grad.abs().max() > 0 for each in net.parameters())
    }


def test_every_network_is_trained(contacts):
    model = Model(OPTIONS, contacts, torch.Generator().manual_seed(0))
    assert {net for stage in STAGES for net in stage.nets} == {name for name, _ in model.named_children()}


def test_rectified_signals_shape_no_map_but_r2mpn(contacts):
    assert shaped(contacts, chain_loss, rectified=0.0) == {"SVB", "MVB", "MVD", "S2MPN", "M2MPN"}
    assert shaped(contacts, chain_loss, rectified=1.0) == {"SVB", "MVB", "MVD", "M2MPN"}  # all but SVB: by the meshes
    assert "R2MPN" in shaped(contacts, r2mpn_loss, rectified=1.0)
    last = [stage.name for stage in STAGES if "R2MPN" in stage.nets]
    assert last == ["R2MPN"] and [stage.nets for stage in STAGES if stage.name == "R2MPN"] == [("R2MPN",)]
