"""frames.h5: what is kept and nothing else, as other programs read it: netCDF's rules, xarray, pandas."""

import json

import h5py
import numpy as np
import pytest

from tactile_core.jobs.frames_file import ALWAYS, FramesFile
from tactile_core.recordings import flags

FRAMES = 5
SHAPES = {"electrodes": (19,), "force": (3,), "contact_center": (2,), "contact_normal": (3,)}


@pytest.fixture
def frames(tmp_path):
    """A file with every attribute that a conversion writes, written in two parts; latents are not kept."""
    arrays = {name: np.arange(FRAMES * np.prod(SHAPES.get(name, ()), dtype=int), dtype=float) for name in ALWAYS}
    arrays = {name: values.reshape(FRAMES, *SHAPES.get(name, ())) for name, values in arrays.items()}
    arrays |= {"flags": np.zeros(FRAMES, np.uint16), "frame": np.arange(FRAMES, dtype=np.int32)}
    arrays |= {"marker_motion": np.zeros((FRAMES, 6, 2)), "height_map": np.ones((FRAMES, 4, 3))}
    arrays["latent_signal"] = np.ones((FRAMES, 8))
    path, about = tmp_path / "frames.h5", {"recording": "touch", "simulated": np.True_}
    with FramesFile(path, FRAMES, ("marker_motion", "height"), about) as file:
        for start in (0, 3):
            file.write(start, {name: values[start : start + 3] for name, values in arrays.items()})
        file.annotate("time", start_time=1.5)
        file.annotate("electrodes", rest=np.ones(19), kind="raw")
        file.annotate("marker_motion", rest=np.ones((6, 2)))
    return path


def test_it_holds_what_is_kept_with_units_and_nothing_else(frames):
    with h5py.File(frames) as file:
        assert set(file) == {*ALWAYS, "marker_motion", "height_map"}
        assert all(dataset.attrs["unit"] and dataset.attrs["description"] for dataset in file.values())
        assert json.loads(file["flags"].attrs["names"]) == flags.names()
        assert file["flags"].dtype == np.uint16 and file["height_map"].dtype == np.float32
        assert (file["height_map"][:] == 1).all() and file["time"].attrs["start_time"] == 1.5


def test_no_attribute_or_dataset_breaks_netcdf_rules(frames):
    with h5py.File(frames) as file:
        every = [(name, key, value) for name, item in [("/", file), *file.items()] for key, value in item.attrs.items()]
        assert ("/", "simulated", 1) in every
        for name, key, value in every:
            kind = np.asarray(value)
            assert kind.ndim <= 1 and (isinstance(value, str) or kind.dtype.kind in "iuf"), (name, key)
        assert {data.dtype.kind for data in file.values()} <= set("iuf")


@pytest.mark.filterwarnings("ignore:The 'phony_dims' kwarg")  # axes have no names
@pytest.mark.parametrize("engine", ["h5netcdf", "netcdf4"])
def test_xarray_opens_it_and_writes_netcdf_and_pandas(engine, frames, tmp_path):
    xarray = pytest.importorskip("xarray", reason="xarray is absent: pip install xarray h5netcdf netCDF4 pandas")
    pytest.importorskip({"netcdf4": "netCDF4"}.get(engine, engine), reason=f"{engine} is absent: pip install it")
    with xarray.open_dataset(frames, engine=engine) as found:
        found.to_netcdf(tmp_path / "frames.nc", engine=engine)
        table = found["force"].to_pandas()
    with xarray.open_dataset(tmp_path / "frames.nc", engine=engine) as again, h5py.File(frames) as file:
        for name, data in file.items():
            np.testing.assert_array_equal(again[name], data)
        np.testing.assert_array_equal(table, file["force"])
