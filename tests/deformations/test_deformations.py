"""Deformed meshes of others: one row a layout, then what is wrong with a file."""

from __future__ import annotations

import h5py
import numpy as np
import pytest

from tactile_core import deformations
from tactile_core.errors import TactileError


def nodes(trial, step, env, sensor):
    return np.arange(12.0).reshape(4, 3) * 1e-3 + trial + 10 * step + 100 * env + 1000 * (sensor == "digit")


def across(file):
    for trial, step, env in ((0, 2, 0), (0, 10, 0), (1, 2, 1)):
        for sensor in ("biotac", "digit"):
            group = f"trial_{trial}/step_{step}"
            file[f"{group}/nodal_coords_{sensor}/env_{env}"] = nodes(trial, step, env, sensor)
            file[f"{group}/net_force_vecs_{sensor}/env_{env}"] = [0.0, float(step), -1.0]
    return [(0, 2, 0, "biotac"), (0, 2, 0, "digit"), (0, 10, 0, "biotac"), (0, 10, 0, "digit"), (1, 2, 1, "biotac"),
            (1, 2, 1, "digit")]  # fmt: skip


def narang(file):
    for step in (2, 10):
        file[f"step_{step}/nodal_coords/env_0"] = nodes(0, step, 0, "biotac")
        file[f"step_{step}/net_force_vecs/env_0"] = [[0.0, step - 1.0, -1.0], [0.0, 1.0, 0.0]]
        file[f"step_{step}/elem_stresses/env_0"] = np.full(5, 1e3 * step)
    return [(0, 2, 0, "biotac"), (0, 10, 0, "biotac")]


@pytest.mark.parametrize(("layout", "stressed"), [(across, False), (narang, True)])
def test_layout_is_told_from_the_names_and_read_in_order(layout, stressed, tmp_path):
    with h5py.File(tmp_path / "a.hdf5", "w") as file:
        expected = layout(file)
    found = list(deformations.read(tmp_path / "a.hdf5"))
    assert [(one.trial, one.step, one.environment, one.sensor) for one in found] == expected
    for one, place in zip(found, expected, strict=True):
        np.testing.assert_array_equal(one.nodes, nodes(*place))
        np.testing.assert_array_equal(one.force, [0, one.step, -1])
        assert (one.stresses is not None) == stressed


def test_every_layout_has_a_row_here():
    assert [layout.__name__.rpartition(".")[2] for layout in deformations.layouts()] == ["across", "narang"]


@pytest.mark.parametrize(
    ("values", "told"),
    [
        (np.zeros((4, 2)), "shape"),
        (np.full((4, 3), np.nan), "not finite"),
        (np.array([b"x"]), "no array of numbers"),
        (None, "missing"),
    ],
)
def test_a_bad_frame_is_named(values, told, tmp_path):
    with h5py.File(tmp_path / "a.hdf5", "w") as file:
        narang(file)
        name = "step_10/net_force_vecs/env_0" if values is None else "step_10/nodal_coords/env_0"
        del file[name]
        if values is not None:
            file[name] = values
    with pytest.raises(TactileError, match=f"step_10.*{told}"):
        list(deformations.read(tmp_path / "a.hdf5"))


def test_a_huge_declared_shape_is_refused_unread(tmp_path):
    with h5py.File(tmp_path / "a.hdf5", "w") as file:
        narang(file)
        del file["step_2/nodal_coords/env_0"]
        file.create_dataset("step_2/nodal_coords/env_0", (10**9, 3), "f8", chunks=(1000, 3))
    with pytest.raises(TactileError, match="at most 3,000,000 numbers"):
        list(deformations.read(tmp_path / "a.hdf5"))


def test_a_name_that_is_no_text_is_passed_over(tmp_path):
    with h5py.File(tmp_path / "a.hdf5", "w") as file:
        expected = narang(file)
        file[b"\xff\xfe"] = 1
    assert len(list(deformations.read(tmp_path / "a.hdf5"))) == len(expected)


def test_other_files_are_refused(tmp_path):
    (tmp_path / "a").write_bytes(b"text")
    with h5py.File(tmp_path / "b", "w") as file:
        file["x"] = 1
    for name, told in (("a", "damaged HDF5"), ("b", "no known deformations"), ("c", "damaged HDF5")):
        with pytest.raises(TactileError, match=told):
            list(deformations.read(tmp_path / name))
