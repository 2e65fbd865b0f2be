"""Fine-tuning on a labelled recording: made here, in the layout of Narang et al., from contacts of the test set."""

import numpy as np
import pytest
from labelled_recording import BALANCED, HELD, PAIRS, labelled_arrays, write_labelled

torch = pytest.importorskip("torch", reason="training needs torch")
h5py = pytest.importorskip("h5py")

from tactile_core.cli.main import main  # noqa: E402
from tactile_core.errors import TactileError  # noqa: E402
from tactile_core.simulation.pairs_file import read_pairs  # noqa: E402
from tactile_core.training import fine_tune as fine_tuning  # noqa: E402
from tactile_core.training.fine_tune import fine_tune, read_labelled  # noqa: E402
from tactile_core.translation import networks  # noqa: E402
from tactile_core.translation.gel_place import on_gel  # noqa: E402


@pytest.fixture(scope="module")
def arrays():
    return labelled_arrays()


def test_it_learns_the_sensor(arrays, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(fine_tuning, "EPOCHS", 6)  # of thirty
    path = write_labelled(tmp_path / "labelled.hdf5", arrays)
    assert main(["train", "s2mpn", "--real", str(path), "--out", str(tmp_path / "tuned")]) == 0
    said = capsys.readouterr()
    assert "real_force_percent" in said.out and "warning: real_" not in said.err
    assert f"next: tactile convert touch.csv --out results --weights {tmp_path / 'tuned' / 'weights'}" in said.err
    before, after = networks.load(), networks.load(tmp_path / "tuned" / "weights")
    rows = {(row["name"], row["set"].rsplit(" ", 1)[1]): row for row in after.card["fine_tuned"]["errors"]}
    # Measured: places 1.8 -> 1.0 mm, forces 30 -> 9 %; forty contacts are kept to tell.
    for name, share in (("real_position_mm", 0.75), ("real_force_percent", 1.0)):
        assert rows[name, "after"]["value"] < share * rows[name, "before"]["value"]
        assert rows[name, "after"]["value"] < 0.6 * rows[name, "after"]["baseline"]
    assert after.card["fine_tuned"]["weights_sha256"] == before.sha256
    for net in (net for net in networks.NETS if net != "S2MPN"):
        for name, tensor in before.tensors[net].items():
            np.testing.assert_array_equal(tensor, after.tensors[net][name])


def test_same_bytes_again(arrays, tmp_path, monkeypatch):
    monkeypatch.setattr(fine_tuning, "EPOCHS", 1)
    path = write_labelled(tmp_path / "labelled.hdf5", {name: values[:600] for name, values in arrays.items()})
    for name in ("a", "b"):
        fine_tune(path, tmp_path / name)
    first, second = ((tmp_path / name / "weights" / "card.json").read_bytes() for name in ("a", "b"))
    assert first == second
    with pytest.raises(TactileError, match="already holds weights"):
        fine_tune(path, tmp_path / "a")


def test_places_are_unrolled_onto_the_gel(arrays, tmp_path):
    """They come back to where the contacts were simulated, but for the rounding to the skin's nodes, 0.6 mm apart."""
    frame = networks.load().frames["MVD"]
    found = read_labelled(write_labelled(tmp_path / "labelled.hdf5", arrays), frame, 0)
    pairs = read_pairs(PAIRS)
    true = np.repeat(pairs.contact_center[pairs.press < BALANCED], HELD, 0)
    away = np.linalg.norm(on_gel(frame, found.place) - true, axis=1)
    assert np.percentile(away, 95) < 0.6e-3


def changed(arrays, **values):
    return {name: values.get(name, array) for name, array in arrays.items() if values.get(name, array) is not None}


def test_metres_read_as_millimetres(arrays, tmp_path):
    frame = networks.load().frames["MVD"]
    first = read_labelled(write_labelled(tmp_path / "mm.hdf5", arrays), frame, 0)
    metres = changed(arrays, contact_loc=1e-3 * arrays["contact_loc"])
    second = read_labelled(write_labelled(tmp_path / "m.hdf5", metres), frame, 0)
    np.testing.assert_array_equal(first.place, second.place)
    assert not set(first.split.train) & set(first.split.test)


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda a: changed(a, force_vec=None), "no forces"),
        (lambda a: changed(a, contact_loc=None), "no contact places"),
        (lambda a: changed(a, contact_loc=a["contact_loc"] + 30), "off the skin"),
        (lambda a: changed(a, contact_loc=np.full_like(a["contact_loc"], np.nan)), "usable frames"),
        (lambda a: changed(a, force_vec=0 * a["force_vec"]), "usable frames"),
        (lambda a: changed(a, force_vec=102 * a["force_vec"]), "cannot be a finger's force in newtons"),  # gf
        (lambda a: {name: values[:300] for name, values in a.items()}, "usable frames"),
    ],
)
def test_refusals(arrays, tmp_path, spoil, said):
    with pytest.raises(TactileError, match=said):
        fine_tune(write_labelled(tmp_path / "labelled.hdf5", spoil(arrays)), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_labels_that_no_network_could_mean_are_doubted(arrays, tmp_path, capsys, monkeypatch):
    """Places of the finger's other side are learnt as well as true ones; one wild place is no other unit."""
    monkeypatch.setattr(fine_tuning, "EPOCHS", 1)
    mirrored = 1e-3 * arrays["contact_loc"] * [1, -1, 1]  # m
    mirrored[np.linalg.norm(arrays["force_vec"], axis=1).argmax()] = 0.9
    heavy = 9.81 * arrays["force_vec"]
    heavy[np.linalg.norm(heavy, axis=1).argmin()] = 200.0  # N; one glitch is no other unit either
    path = write_labelled(tmp_path / "labelled.hdf5", changed(arrays, contact_loc=mirrored, force_vec=heavy))
    assert main(["train", "s2mpn", "--real", str(path), "--out", str(tmp_path / "tuned")]) == 0
    said = capsys.readouterr().err
    for what in ("position_mm", "force_percent"):
        assert f"warning: real_{what} of kept presses, before is no better than one answer for all" in said
    assert "left out: 1 contacts that are not on the pad" in said


def test_options_that_do_not_fit(tmp_path, capsys):
    for words in (["s2mpn"], ["s2mpn", "--real", "x", "--effort", "2"], ["pairs.h5", "--real", "x"]):
        assert main(["train", *words, "--out", str(tmp_path / "out")]) == 2
        assert "--" in capsys.readouterr().err
