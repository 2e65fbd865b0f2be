"""A whole training on tiny data: it learns, says what it did, gives the same bytes twice and after an interruption."""

import csv
import io
import os
import shutil
import signal
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from small_pairs import SMALL, bodies, frame, write_pairs

torch = pytest.importorskip("torch", reason="training needs torch")

from tactile_core.errors import TactileError  # noqa: E402
from tactile_core.simulation.pairs_file import read_pairs  # noqa: E402
from tactile_core.training.checkpoint import read  # noqa: E402
from tactile_core.training.options import Options  # noqa: E402
from tactile_core.training.stages import STAGES  # noqa: E402
from tactile_core.training.train import deterministic, train  # noqa: E402
from tactile_core.translation import card as cards  # noqa: E402
from tactile_core.translation import networks  # noqa: E402

SURFACES = {"bodies": bodies(), "frame": frame}
QUICK = Options(**SMALL, effort=0.04, checkpoint_seconds=0.0)


@pytest.fixture(scope="module")
def pairs(tmp_path_factory):
    return write_pairs(tmp_path_factory.mktemp("pairs") / "pairs.h5", presses=40)


@pytest.fixture(scope="module")
def quick(pairs, tmp_path_factory):
    """A short training that was not disturbed."""
    out = tmp_path_factory.mktemp("quick")
    train(pairs, out, 3, QUICK, **SURFACES)
    return out


@pytest.fixture
def undrawn(monkeypatch):
    """Leave out the picture of the losses, which takes two seconds: `quick` has one."""
    monkeypatch.setattr("tactile_core.training.train.draw_losses", lambda path, history: None)


def files(out):
    """Name -> bytes of everything in a result."""
    return {str(path.relative_to(out)): path.read_bytes() for path in sorted(out.rglob("*")) if path.is_file()}


def test_it_learns(pairs, tmp_path, undrawn):
    card = train(pairs, tmp_path, 0, Options(**SMALL), **SURFACES)
    rows = {row["name"]: row for row in card["errors"]}
    share = {name: row["value"] / row["baseline"] for name, row in rows.items() if row["baseline"]}
    # Few contacts, few steps, so that another processor's rounding leads elsewhere: .41 to .68 on an EPYC, .46 to
    # .69 on a Xeon. A net that is wired wrong gives 1.
    nets = ("MVB", "MVD", "S2MPN", "M2MPN", "chain", "D2B", "direct")
    assert not {name: share[f"{name}_rms_um"] for name in nets if share[f"{name}_rms_um"] >= 0.85}
    assert rows["silence_digit_max_um"]["value"] < 0.25 * rows["chain_max_um"]["baseline"]


def test_result_is_complete_and_loads(quick, pairs):
    nets = {f"weights/{net}.safetensors" for net in (*cards.NETS, cards.PARTS, "signals")}
    assert set(files(quick)) == {"log.csv", "loss.png", "weights/card.json", *nets}
    loaded = networks.load(quick / "weights")
    card = loaded.card
    assert card["seed"] == 3
    assert len(card["pairs"]["sha256"]) == 64
    assert card["pairs"]["contacts"] == {"train": 256, "validation": 32, "test": 32}
    assert all(row["baseline"] is not None for row in card["errors"] if row["name"].endswith(("um", "counts", "_N")))
    cards.check_tables(card, "card.json")
    for net, entry in card["nets"].items():
        shapes = {name: list(array.shape) for name, array in loaded.tensors[net].items()}
        assert shapes == entry["shapes"]
    with open(quick / "log.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["stage"] for row in rows] == [stage.name for stage in STAGES for _ in range(QUICK.epochs(stage.name))]


def test_interrupted_anywhere_and_begun_beside_itself_it_gives_the_same_bytes(quick, pairs, tmp_path):
    seen = []

    def stop(share, text):
        if text not in seen:
            seen.append(text)
            with pytest.raises(TactileError, match="another process is writing it"):
                train(pairs, tmp_path, 3, QUICK, **SURFACES)
            if len(seen) % 3 == 0:  # not every time, so that it advances; in the middle of stages and at their ends
                raise KeyboardInterrupt

    for _ in range(len(STAGES) * 4):
        try:
            train(pairs, tmp_path, 3, QUICK, progress=stop, **SURFACES)
            break
        except KeyboardInterrupt:
            assert not (tmp_path / "weights" / "card.json").exists()
    assert len(seen) > 6
    assert files(tmp_path) == files(quick)


HERE = os.path.dirname(__file__)
KILLED = """
import os, signal, sys
sys.path[:0] = sys.argv[3:]
import test_train as t
from tactile_core.training import train as module
def die(*_): os.kill(os.getpid(), signal.SIGKILL)
midway = sys.argv[2] == "midway"
if not midway:
    module.draw_losses = die  # the weights and their card are written, the checkpoint is still there
module.train(sys.argv[1] + "/pairs.h5", sys.argv[1] + "/out", 3, t.QUICK,
             progress=lambda share, _: die() if midway and share > 0.5 else None, **t.SURFACES)
"""


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGKILL")
def test_a_killed_training_goes_on_to_the_same_bytes(quick, pairs, tmp_path):
    shutil.copy(pairs, tmp_path / "pairs.h5")
    for moment, card in (("midway", False), ("nearly done", True)):
        command = [sys.executable, "-c", KILLED, str(tmp_path), moment, HERE, *filter(None, sys.path)]
        assert subprocess.run(command, check=False, stderr=subprocess.DEVNULL).returncode == -signal.SIGKILL
        assert (tmp_path / "out" / "checkpoint.npz").exists()
        assert (tmp_path / "out" / "weights" / "card.json").exists() is card
    train(tmp_path / "pairs.h5", tmp_path / "out", 3, QUICK, **SURFACES)
    assert files(tmp_path / "out") == files(quick)


def test_stages_that_are_left_out_are_not_run_and_progress_ends_at_one(pairs, tmp_path, undrawn):
    left_out, shares = ("direct", "back", "error"), []
    short = replace(QUICK, left_out=left_out, effort=0.0)
    train(pairs, tmp_path, 3, short, lambda share, text: shares.append(share), **SURFACES)
    with open(tmp_path / "log.csv", newline="") as file:
        run = {row["stage"] for row in csv.DictReader(file)}
    assert run == {stage.name for stage in STAGES} - set(left_out)
    assert shares == sorted(shares) and shares[-1] == 1.0
    assert len(shares) == len(run) + 1  # and what tells two contacts apart


def interrupted(pairs, out, seed):
    """Leave a checkpoint behind."""

    def stop(share, text):
        if share > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(pairs, out, seed, QUICK, progress=stop, **SURFACES)
    return out / "checkpoint.npz"


def test_a_checkpoint_of_another_seed_or_other_options_or_a_damaged_one_is_refused(pairs, tmp_path):
    path, other = interrupted(pairs, tmp_path, 3), np.load(interrupted(pairs, tmp_path / "other", 4))
    with np.load(path) as first:
        assert any((first[name] != other[name]).any() for name in first if name.startswith("model/MVB."))
    with pytest.raises(TactileError, match=r"checkpoint\.npz: seed 3; expected seed 4"):
        train(pairs, tmp_path, 4, QUICK, **SURFACES)
    with pytest.raises(TactileError, match=r"options \{'beta': 0\.0001\}; expected options \{'beta': 0\.1\}"):
        train(pairs, tmp_path, 3, replace(QUICK, beta=0.1), **SURFACES)
    whole = path.read_bytes()
    said = [b"[" * 100_000, b"[]", b'{"identity": 1, "stage": 0, "epoch": 0, "log": []}']
    for data in (whole[:1000], b"", b"no archive", *map(archive, said)):
        path.write_bytes(data)
        with pytest.raises(TactileError, match="cannot be read"):
            read(path, {})


def archive(text: bytes) -> bytes:
    """A checkpoint that tells this."""
    file = io.BytesIO()
    np.savez(file, state=np.frombuffer(text, np.uint8))
    return file.getvalue()


def test_an_existing_result_is_kept(quick, pairs):
    before = files(quick)
    with pytest.raises(TactileError, match="already holds weights"):
        train(pairs, quick, 3, QUICK, **SURFACES)
    assert files(quick) == before


def test_unusable_output_folder(pairs, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(TactileError, match="cannot be made"):
        train(pairs, tmp_path / "file" / "out", 0, QUICK, **SURFACES)


def test_a_training_that_saves_nothing_leaves_no_folder(pairs, tmp_path):
    def stop(share, text):
        raise KeyboardInterrupt

    (tmp_path / "mine").mkdir()
    for name in ("new", "mine"):
        with pytest.raises(KeyboardInterrupt):
            train(pairs, tmp_path / name, 0, replace(QUICK, checkpoint_seconds=1e9), stop, **SURFACES)
    assert [folder.name for folder in tmp_path.rglob("*")] == ["mine"]


def test_pairs_of_another_surface_are_refused(pairs, tmp_path):
    with pytest.raises(TactileError, match="biotac_nodes_sha256"):
        train(pairs, tmp_path, 0, QUICK)


def test_settings_of_the_caller_survive():
    threads = torch.get_num_threads()
    with deterministic():
        assert torch.get_num_threads() == 1
        assert torch.are_deterministic_algorithms_enabled()
    assert torch.get_num_threads() == threads
    assert not torch.are_deterministic_algorithms_enabled()


def test_what_is_kept_apart_is_not_trained_on(pairs, tmp_path, undrawn):
    out = train(pairs, tmp_path, 3, replace(QUICK, without_below_x=-5e-3, effort=0.0), **SURFACES)
    whole = read_pairs(pairs)
    far = whole.place[:, 0] >= -5e-3
    assert sum(out["pairs"]["contacts"].values()) == far.sum() < len(far)
    assert out["options"]["without_below_x"] == -5e-3
    with pytest.raises(TactileError, match=r"indenters: no 'ball'; expected sphere"):
        train(pairs, tmp_path / "a", 3, replace(QUICK, without=("ball",)), **SURFACES)
    with pytest.raises(TactileError, match="nothing is left for train"):
        train(pairs, tmp_path / "b", 3, replace(QUICK, without=("sphere",)), **SURFACES)
