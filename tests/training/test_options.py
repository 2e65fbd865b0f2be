"""Networks on another device than the contacts: no step mixes the two, and a GPU that is not there is said."""

import numpy as np
import pytest
from small_pairs import BASES, frame, write_pairs

torch = pytest.importorskip("torch", reason="training needs torch")

from tactile_core.errors import TactileError  # noqa: E402
from tactile_core.simulation.pairs_file import read_pairs, split_presses  # noqa: E402
from tactile_core.training.data import Contacts  # noqa: E402
from tactile_core.training.options import Options, device_of, label  # noqa: E402
from tactile_core.training.stages import STAGES, Model  # noqa: E402
from tactile_core.training.surface_codec import SurfaceCodec  # noqa: E402

OPTIONS = Options(**BASES, width=16, latent_biotac=6, latent_digit=7, mirrored=0)
ELSEWHERE = torch.device("meta")  # holds no numbers, and refuses to be mixed with the processor's as a GPU does


@pytest.fixture(scope="module")
def elsewhere(tmp_path_factory):
    """Contacts whose batches go elsewhere, and a model there."""
    path = write_pairs(tmp_path_factory.mktemp("pairs") / "pairs.h5")
    pairs, frames = read_pairs(path), {name: frame(name, 3) for name in ("biotac", "digit")}
    split, generator = split_presses(pairs.press, 0, path), torch.Generator().manual_seed(0)
    contacts = Contacts(pairs, split, OPTIONS, frames, generator, ELSEWHERE)
    return contacts, Model(OPTIONS, contacts, generator).to(ELSEWHERE)


def unread(monkeypatch):
    """Let the steps that read numbers back give numbers of the right shape: elsewhere there are none."""
    cells = SurfaceCodec._at_cells
    monkeypatch.setattr(
        SurfaceCodec, "_at_cells", lambda self, rows, _: cells(self, rows, torch.zeros(len(rows), 2).long())
    )
    monkeypatch.setattr(SurfaceCodec, "field", lambda self, modes, _: torch.zeros(len(modes), self.data.shape[1], 3))


@pytest.mark.parametrize("stage", STAGES, ids=lambda stage: stage.name)
def test_no_loss_mixes_devices(elsewhere, stage, monkeypatch):
    contacts, model = elsewhere
    unread(monkeypatch)
    rows = contacts.with_silence(contacts.split.train[:8])
    batch = contacts.batch(rows, contacts.read(rows, np.random.default_rng(0), 0.5))
    loss = stage.loss(model, contacts, batch, OPTIONS, torch.Generator())
    assert loss.device == ELSEWHERE and loss.shape == ()
    loss.backward()
    nets = [model.get_submodule(net) for net in stage.nets]
    assert any(parameter.grad is not None for net in nets for parameter in net.parameters())


def test_the_stand_in_refuses_to_be_mixed():
    with pytest.raises(RuntimeError):
        torch.ones(2, device=ELSEWHERE) + torch.ones(2)


def test_a_gpu_is_used_where_there_is_one_and_told_where_there_is_none(monkeypatch):
    assert label(device_of("cpu")) == "cpu"
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    assert [device_of(name).type for name in ("auto", "cpu", "cuda")] == ["cuda", "cpu", "cuda"]
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    assert device_of("auto").type == "cpu"
    with pytest.raises(TactileError, match="sees none"):
        device_of("cuda")
    with pytest.raises(TactileError, match="auto, cpu, cuda"):
        device_of("tpu")
