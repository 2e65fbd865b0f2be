"""Reading and splitting the pairs file: what is wrong with it is said, and no press is in two parts."""

import numpy as np
import pytest

from tactile_core.errors import TactileError
from tactile_core.simulation.pairs_file import quantise, read_pairs, split_presses

h5py = pytest.importorskip("h5py", reason="pairs files need h5py")
from small_pairs import write_pairs  # noqa: E402


def test_whole_file(tmp_path):
    pairs = read_pairs(write_pairs(tmp_path / "pairs.h5", presses=5, steps=3))
    assert pairs.displacement_biotac.shape == (15, 63, 3)
    assert pairs.displacement_biotac.dtype == np.int16
    assert pairs.signal.shape == (15, 19)
    assert pairs.scale_digit == 1e-7


def test_what_int16_cannot_hold_is_refused_and_not_wrapped():
    assert quantise(np.array([3.2767e-3, -1e-7])).tolist() == [32767, -1]
    for displacement in (3.3e-3, np.nan):
        with pytest.raises(TactileError, match=r"at most 3\.27 mm"):
            quantise(np.array([displacement]))


def test_hash_is_of_the_content(tmp_path):
    first = write_pairs(tmp_path / "a.h5", presses=5, steps=3)
    second = tmp_path / "b.h5"
    with h5py.File(first) as source, h5py.File(second, "w") as copy:  # the same, chunked and compressed
        for name, data in source.items():
            copy.create_dataset(name, data=data[:], chunks=True, compression="gzip").attrs.update(data.attrs)
        copy.attrs.update(source.attrs)
    digest = read_pairs(first).sha256
    assert read_pairs(second).sha256 == digest
    assert first.read_bytes() != second.read_bytes()
    with h5py.File(second, "r+") as file:
        file["displacement_digit"][3, 2, 1] += 1
    assert read_pairs(second).sha256 != digest


def replace(name, values, **attributes):
    """A change of a file: another dataset in the place of one."""

    def change(file):
        old = dict(file[name].attrs)
        del file[name]
        file[name] = values(file) if callable(values) else values
        file[name].attrs.update(old | attributes)

    return change


def times(name, factor):
    """A change of a file: a dataset in another unit, or of the other sign."""
    return lambda file: file[name].write_direct((factor * file[name][:]).astype(file[name].dtype))


def poison(file):
    file["signal"][4, 2] = np.nan


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda file: file.attrs.update(format="tactile-pairs-9"),
            "format 'tactile-pairs-9'; expected format 'tactile-pairs-2'",
        ),
        (lambda file: file.attrs.pop("format"), "format ''"),
        (lambda file: file.attrs.update(electrodes="gap"), "electrodes: 'gap'; expected 'sheet'"),
        (lambda file: file.attrs.pop("digit_nodes_sha256"), "no attribute digit_nodes_sha256"),
        (lambda file: file.pop("signal"), "signal: no such dataset"),
        (replace("signal", np.zeros((15, 24), np.float32)), r"signal: shape \(15, 24\); expected \(C, 19\)"),
        (replace("signal", np.zeros((14, 19), np.float32)), "signal: 14 contacts; expected 15"),
        (replace("displacement_digit", np.zeros((15, 88), np.int16)), r"displacement_digit: shape \(15, 88\)"),
        (replace("displacement_digit", np.zeros((15, 0, 3), np.int16)), r"displacement_digit: shape \(15, 0, 3\)"),
        (
            replace("displacement_digit", np.zeros((15, 88, 3), np.float32)),
            "displacement_digit: dtype float32; expected int16",
        ),
        (replace("displacement_biotac", lambda file: file["displacement_digit"][:], scale=0.0), "scale 0.0"),
        (replace("force", np.zeros((15, 3), np.int32)), "force: dtype int32"),
        (poison, "signal, contact 4: NaN"),
        (times("force", 1000), r"force: a median of .*; expected 0\.001 to 20 N"),
        (times("pressure", 1e-3), "pressure: a median of .* Pa"),
        (times("signal", 3.3 / 4096), "signal: a median of .* counts"),
        (times("depth_biotac", 1000), "depth_biotac: a median of"),
        (times("displacement_digit", -1), "displacement_digit: a median of .* inward"),
        (times("displacement_biotac", 10), "displacement_biotac: a median of .* times the depth"),
        (lambda file: file.attrs.update(indenters="sphere"), "attribute indenters: Expecting value"),
        (lambda file: file.attrs.update(indenters="[" * 10_000), "a JSON list of names"),
        (lambda file: file.attrs.update(indenters='{"sphere": 0}'), "a JSON list of names"),
        (lambda file: file.attrs.update(indenters="[]"), "0 names for numbers 0 to 0"),
        (replace("indenter", np.full(15, -1, np.int16)), "1 names for numbers -1 to -1"),
    ],
)
def test_wrong_files(tmp_path, change, message):
    path = write_pairs(tmp_path / "pairs.h5", presses=5, steps=3)
    with h5py.File(path, "r+") as file:
        change(file)
    with pytest.raises(TactileError, match=message) as caught:
        read_pairs(path)
    assert str(path) in str(caught.value)


def test_truncated_missing_and_foreign_files(tmp_path):
    path = write_pairs(tmp_path / "pairs.h5", presses=5, steps=3)
    whole = path.read_bytes()
    for data in (whole[: len(whole) // 2], b"", b"timestamp,tdc\n"):
        path.write_bytes(data)
        with pytest.raises(TactileError, match="cannot be read"):
            read_pairs(path)
    with pytest.raises(TactileError, match="no such file"):
        read_pairs(tmp_path / "absent.h5")


@pytest.mark.parametrize("presses", [5, 12, 100])
def test_no_press_is_in_two_parts(presses):
    press = np.repeat(np.random.default_rng(0).permutation(presses), 7)
    split = split_presses(press, 3, "pairs.h5")
    parts = [set(press[rows]) for rows in (split.train, split.validation, split.test)]
    assert sum(map(len, parts)) == len(set.union(*parts)) == presses
    assert len(parts[1]) == len(parts[2]) == max(1, round(presses / 10))
    rows = np.concatenate([split.train, split.validation, split.test])
    np.testing.assert_array_equal(np.sort(rows), np.arange(len(press)))


def test_split_follows_the_seed():
    press = np.repeat(np.arange(50), 2)
    first, same, other = (split_presses(press, seed, "pairs.h5").test for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, same)
    assert not np.array_equal(first, other)


def test_too_few_presses():
    with pytest.raises(TactileError, match="4 presses; expected at least 5"):
        split_presses(np.repeat(np.arange(4), 10), 0, "pairs.h5")
