"""A whole training on tiny data: it learns, says what it did, gives the same bytes twice and after an interruption."""

from __future__ import annotations

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="training needs torch")

from tactile_core import networks, weights  # noqa: E402
from tactile_core.errors import TactileError  # noqa: E402
from tactile_core.training.checkpoint import read  # noqa: E402
from tactile_core.training.export import compliance  # noqa: E402
from tactile_core.training.options import Options  # noqa: E402
from tactile_core.training.stages import STAGES  # noqa: E402
from tactile_core.training.train import deterministic, train  # noqa: E402

SMALL = {"width": 32, "modes_biotac": 16, "modes_digit": 16, "latent_biotac": 6, "latent_digit": 8, "batch": 32}
QUICK = Options(**SMALL, effort=0.04, checkpoint_seconds=0.0)


@pytest.fixture(scope="module")
def pairs(make_pairs, tmp_path_factory):
    return make_pairs(tmp_path_factory.mktemp("pairs") / "pairs.h5", presses=40)


@pytest.fixture(scope="module")
def quick(pairs, rest_digit, tmp_path_factory):
    """A short training that was not disturbed."""
    out = tmp_path_factory.mktemp("quick")
    train(pairs, out, 3, QUICK, rest_digit=rest_digit)
    return out


def files(out):
    """Name -> bytes of everything in a result."""
    return {str(path.relative_to(out)): path.read_bytes() for path in sorted(out.rglob("*")) if path.is_file()}


def test_it_learns(pairs, rest_digit, tmp_path):
    card = train(pairs, tmp_path, 0, Options(**SMALL), rest_digit=rest_digit)
    rows = {row["name"]: row for row in card["errors"]}
    share = {name: row["value"] / row["null"] for name, row in rows.items() if row["null"]}
    # Few contacts, few steps: measured .41, .49, .43, .54, .58, .15. A net that is wired wrong gives 1.
    limits = {"MVB_rms": 0.6, "MVD_rms": 0.7, "S2MPN_rms": 0.65, "M2MPN_rms": 0.75, "chain_rms": 0.8, "force_rms": 0.4}
    assert not {name: share[name] for name, limit in limits.items() if share[name] >= limit}
    assert share["center"] < 0.7
    assert rows["silence_digit_max"]["value"] < 0.25 * rows["chain_max"]["null"]


def test_result_is_complete_and_loads(quick, pairs):
    nets = {f"weights/{net}.safetensors" for net in networks.NETS}
    assert set(files(quick)) == {"log.csv", "loss.png", "weights/card.json", *nets}
    loaded = networks.load(quick / "weights")
    card = loaded.card
    assert card["seed"] == 3
    assert len(card["pairs"]["sha256"]) == 64
    assert card["pairs"]["contacts"] == {"train": 256, "validation": 32, "test": 32}
    assert card["force"]["kept"] == min(card["force"]["validation_rms_N"], key=card["force"]["validation_rms_N"].get)
    assert all(row["null"] is not None for row in card["errors"])
    for net, entry in card["nets"].items():
        shapes = {name: list(array.shape) for name, array in loaded.tensors[net].items()}
        assert shapes == entry["shapes"]
    for name in ("mahalanobis", "residual", "largest"):
        assert (np.diff(card["distance"][name]) >= 0).all()
        assert len(card["distance"][name]) == len(card["distance"]["levels"])
    for name in ("biotac_m", "digit_m", "force_N"):
        assert (np.diff(card["silence"][name]) >= 0).all()
        assert len(card["silence"][name]) == len(card["silence"]["levels"])
    with open(quick / "log.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["stage"] for row in rows] == [stage.name for stage in STAGES for _ in range(QUICK.epochs(stage.name))]


def test_same_bytes_again(quick, pairs, rest_digit, tmp_path):
    train(pairs, tmp_path, 3, QUICK, rest_digit=rest_digit)
    assert files(tmp_path) == files(quick)


def test_other_seed_other_weights(quick, pairs, rest_digit, tmp_path):
    train(pairs, tmp_path, 4, QUICK, rest_digit=rest_digit)
    assert files(tmp_path)["weights/MVB.safetensors"] != files(quick)["weights/MVB.safetensors"]


def test_interrupted_anywhere_gives_the_same_bytes(quick, pairs, rest_digit, tmp_path):
    seen = []

    def stop(share, text):
        if text not in seen:
            seen.append(text)
            if len(seen) % 3 == 0:  # not every time, so that it advances; in the middle of stages and at their ends
                raise KeyboardInterrupt

    for _ in range(len(STAGES) * 4):
        try:
            train(pairs, tmp_path, 3, QUICK, progress=stop, rest_digit=rest_digit)
            break
        except KeyboardInterrupt:
            assert not (tmp_path / "weights" / "card.json").exists()
    assert len(seen) > 6
    assert files(tmp_path) == files(quick)


def test_progress_ends_at_one(pairs, rest_digit, tmp_path):
    shares = []
    train(pairs, tmp_path, 0, replace(QUICK, effort=0.0), lambda share, text: shares.append(share), rest_digit)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert len(shares) == len(STAGES)


def interrupted(pairs, rest_digit, out):
    """Leave a checkpoint behind."""

    def stop(share, text):
        if share > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(pairs, out, 3, QUICK, progress=stop, rest_digit=rest_digit)
    return out / "checkpoint.npz"


def test_a_foreign_or_damaged_checkpoint_is_refused(pairs, rest_digit, tmp_path):
    path = interrupted(pairs, rest_digit, tmp_path)
    with pytest.raises(TactileError, match=r"checkpoint\.npz: seed 3; expected seed 4"):
        train(pairs, tmp_path, 4, QUICK, rest_digit=rest_digit)
    with pytest.raises(TactileError, match="options"):
        train(pairs, tmp_path, 3, replace(QUICK, beta=0.1), rest_digit=rest_digit)
    whole = path.read_bytes()
    for data in (whole[:1000], b"", b"no archive"):
        path.write_bytes(data)
        with pytest.raises(TactileError, match="cannot be read"):
            read(path, {})


def test_an_existing_result_is_kept(quick, pairs, rest_digit):
    before = files(quick)
    with pytest.raises(TactileError, match="already holds weights"):
        train(pairs, quick, 3, QUICK, rest_digit=rest_digit)
    assert files(quick) == before


def test_unusable_output_folder(pairs, rest_digit, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(TactileError, match="cannot be made"):
        train(pairs, tmp_path / "file" / "out", 0, QUICK, rest_digit=rest_digit)


def test_pairs_of_another_surface_are_refused(pairs, tmp_path):
    with pytest.raises(TactileError, match="digit_nodes_sha256"):
        train(pairs, tmp_path, 0, QUICK)


def test_settings_of_the_caller_survive():
    threads = torch.get_num_threads()
    with deterministic():
        assert torch.get_num_threads() == 1
        assert torch.are_deterministic_algorithms_enabled()
    assert torch.get_num_threads() == threads
    assert not torch.are_deterministic_algorithms_enabled()


def test_compliance_finds_a_linear_law():
    rng = np.random.default_rng(0)
    law = rng.standard_normal((16, 3))
    modes = rng.standard_normal((200, 16))

    class Fake:
        """As much of `Contacts` as the fit looks at."""

        biotac = type("Surface", (), {"modes": torch.from_numpy(modes)})
        pairs = type("Pairs", (), {"force": modes @ law})
        split = type("Split", (), {"train": np.arange(150), "validation": np.arange(150, 200)})

    np.testing.assert_allclose(compliance(Fake), law, atol=1e-6)  # the smallest ridge tried is 1e-8


def test_card_is_readable_json(quick):
    text = (quick / "weights" / "card.json").read_text()
    assert json.loads(text)["format"] == weights.CARD_FORMAT
    assert "NaN" not in text
