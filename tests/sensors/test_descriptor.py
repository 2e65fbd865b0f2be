"""Sensors' descriptors: what ships is sound, and what is wrong in one is said in words."""

import re
import shutil

import numpy as np
import pytest

from tactile_core import sensors
from tactile_core.errors import TactileError
from tactile_core.sensors import descriptor
from tactile_core.sensors.about import about
from tactile_core.sensors.electrodes import read_places
from tactile_core.sensors.gel_shape import GelShape
from tactile_core.sensors.profiles import read_radii


def changed(folder, old, new, name="biotac"):
    """A copy of a shipped sensor whose descriptor has other words in one place."""
    shutil.copytree(descriptor.FOLDER / name, folder / name)
    file = folder / name / descriptor.FILE
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new, 1), encoding="utf-8")
    return folder / name


@pytest.mark.parametrize("name", descriptor.names())
def test_what_ships_is_read_and_names_its_sources(name):
    found = descriptor.describe(name)
    assert found.sources and found.title


def test_decimals_are_shifted_before_they_are_rounded():
    assert 1e-3 * -20.06 != -20.06e-3
    assert sensors.shape_of("digit").tip_x == -20.06e-3


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("youngs_mpa = 4.1", "youngs_pa = 4.1e6", "material: youngs_pa; expected youngs_mpa"),
        ("thickness_mm = 1.58", "thickness = 1.58", "skin: thickness; expected thickness_mm"),
        ("thickness_mm = 1.58", "", "skin: thickness_mm missing"),
        ("[skin]", "[skin]\ncolour = 1", "skin: unknown colour"),
        ("[fluid]", "[liquid]", "top level: unknown liquid"),
        ("poisson = 0.48", "poisson = 0.5", "material, poisson: 0.5; expected above 0 and below 0.5"),
        ("poisson = 0.48", "poisson = nan", "material, poisson: NaN; expected a finite number above 0 and below 0.5"),
        ("thickness_mm = 1.58", "thickness_mm = 1580", "skin, thickness_mm: 1580; expected above 0.05 and below 200"),
        ("youngs_mpa = 4.1", "youngs_mpa = 4.1e6", "material, youngs_mpa: 4.1E+6; expected above 0.0001 and below 100"),
        ("shift_x_mm = 13.97", "shift_x_mm = inf", "frame, shift_x_mm: Infinity; expected a finite number"),
        ("lateral_sign = 1", "lateral_sign = 0", "frame, lateral_sign: 0; expected 1 or -1"),
        ("tip_x_mm = -14.0", "tip_x_mm = 14.0", "skin, along x: -21.3, -19.725, 14, 1.2, 5.08, 6.65 mm; expected"),
        ("bits = 12", "bits = 12.5", "readout, bits"),
        ("inner_poles_mm = [-19.725, 5.08]", "inner_poles_mm = [5.08]", "a list of 2"),
        ('polarity = "falls"', 'polarity = "down"', "falls or rises"),
        ('kind = "fluid"', 'kind = "solid"', "fluid or gel"),
        ('kind = "fluid"', "kind = []", "fluid or gel"),
        ('profile = "profile.csv"', 'profile = "../profile.csv"', "a file beside this one"),
        ("rate_hz = 100", f"rate_hz = {10**400}", "readout, rate_hz"),
        ("tip_rows = 18", "tip_rows = 100000", "lattice, tip_rows: 100000; expected above 1 and below 300"),
        ("tactile-sensor-1", "tactile-sensor-9", "format"),
        ("[skin]", "[skin", "sensor.toml"),
        (
            "corner_radius_mm = 1.15",
            "corner_radius_mm = 3",
            "window_z_mm: [-6.6, 6.6]; expected even about 0, below 6.17",
        ),
        ("window_z_mm = [-6.6, 6.6]", "window_z_mm = [-6.6, 6.5]", "window_z_mm: [-6.6, 6.5]; expected even about 0"),
        ("window_x_mm = [-16.2, 1.2]", "window_x_mm = [-16.2, 5]", "window_x_mm: [-16.2, 5]; expected growing"),
        ("window_x_mm = [-16.2, 1.2]", "window_x_mm = [-19, 1.2]", "corners inside the round tip"),
        ("corner_radius_mm = 1.15", "corner_radius_mm = 20", "corner_radius_mm: 20; expected below half_width_mm"),
        (
            "height_zero_y_mm = -8.301",
            "height_zero_y_mm = 0",
            "camera, height_zero_y_mm: 0; expected -8.2965, back_y_mm less thickness_mm, within 0.2",
        ),
        ("half_width_mm = 9.17", "half_width_mm = 0.00917", "half_width_mm: 0.00917; expected above 0.05"),
        ("rim_base = 6", "rim_base = 5", "60 rows and 47 columns"),
    ],
)
def test_what_is_wrong_in_a_descriptor_is_said(tmp_path, old, new, words):
    name = next(each for each in ("biotac", "digit") if old in (descriptor.FOLDER / each / descriptor.FILE).read_text())
    with pytest.raises(TactileError) as refusal:
        descriptor.read(changed(tmp_path, old, new, name))
    assert words in str(refusal.value) and descriptor.FILE in str(refusal.value)


def test_a_name_that_is_no_sensor_is_refused_with_those_that_are():
    with pytest.raises(TactileError, match="biotac, biotac_sp, digit"):
        descriptor.describe("biotak")
    with pytest.raises(TactileError, match="kind fluid"):
        descriptor.of_kind("biotac", descriptor.GelSensor)


def test_a_second_fluid_sensor_has_a_skin_of_its_own(tmp_path, monkeypatch):
    changed(tmp_path, "thickness_mm = 1.58", "thickness_mm = 1.5").rename(tmp_path / "my_biotac")
    lines = (tmp_path / "my_biotac" / "profile.csv").read_text().splitlines()
    wider = [
        f"{x},{angle},{float(outer) + 0.1:.4f},{more}"
        for x, angle, outer, more in (at.split(",", 3) for at in lines[1:])
    ]
    (tmp_path / "my_biotac" / "profile.csv").write_text("\n".join([lines[0], *wider]))
    monkeypatch.setenv(descriptor.OWN, str(tmp_path))
    assert not sensors.is_gel("my_biotac") and sensors.thickness("my_biotac") == 1.5e-3
    mine, theirs = (sensors.sensor_surface(name).rest[:, 1].min() for name in ("my_biotac", "biotac"))
    assert mine == pytest.approx(theirs - 0.1e-3, abs=1e-6)
    np.testing.assert_array_equal(sensors.electrodes("my_biotac"), sensors.electrodes())


def test_an_open_profile_is_refused(tmp_path):
    lines = (descriptor.FOLDER / "biotac" / "profile.csv").read_text().splitlines()
    at = next(k for k, line in enumerate(lines) if k > 72 * 30 and ",0," in line)
    x, theta, _, inner, core = lines[at].split(",")
    path = tmp_path / "profile.csv"
    path.write_text("\n".join([*lines[:at], f"{x},{theta},nan,{inner},{core}", *lines[at + 1 :]]))
    with pytest.raises(TactileError, match="open profile"):
        read_radii(path)
    path.write_text("\n".join(lines[:-1]))
    with pytest.raises(TactileError, match="close round the axis"):
        read_radii(path)


@pytest.mark.parametrize(
    ("name", "table"), [("biotac", "profile.csv"), ("biotac", "electrodes.csv"), ("biotac", "contact_patterns.npy")]
)
def test_a_table_that_is_none_is_named(tmp_path, monkeypatch, name, table):
    mine = f"no_{table.split('.')[0]}"
    folder = changed(tmp_path, "poisson = 0.48", "poisson = 0.4", name).rename(tmp_path / mine)
    monkeypatch.setenv(descriptor.OWN, str(tmp_path))
    (folder / table).write_bytes(b"\xff\x00")
    with pytest.raises(TactileError, match=table):
        about(mine)
        sensors.contacts_of(mine)


@pytest.mark.parametrize(
    ("name", "file", "old", "new", "said"),
    [
        ("digit", "profile.csv", r"(?m)^(-8\.00,-7\.93),.*", r"\1,nan,nan", "x_mm -8, z_mm -7.93: an open profile"),
        ("gelsight_mini", "profile.csv", r"(?s)^((?:[^\n]*\n){5}).*", r"\1", r"4 heights .*determine \d of 6 coeff"),
        ("gelsight_mini", "profile.csv", r"(?m)^(-?\d.*),.*,.*", r"\1", "of 2 numbers; expected numbers under x_mm"),
        ("gelsight_mini", descriptor.FILE, "margin_mm = 0.4", "margin_mm = 40", "0 heights inside margin_mm, .* of 6"),
        ("digit", descriptor.FILE, "profile.csv", "other.csv", r"other\.csv: cannot be read .*No such file"),
    ],
)
def test_a_table_of_heights_that_is_none_is_refused(tmp_path, name, file, old, new, said):
    folder = shutil.copytree(descriptor.FOLDER / name, tmp_path / name)
    text = (folder / file).read_text(encoding="utf-8")
    (folder / file).write_text(re.sub(old, new, text), encoding="utf-8")
    with pytest.raises(TactileError, match=said):
        GelShape(descriptor.read(folder)).dome_height(np.zeros(1), np.zeros(1))


def test_where_own_sensors_lie_is_said_where_it_is_odd(tmp_path, monkeypatch):
    mine = changed(tmp_path, "poisson = 0.48", "poisson = 0.4", "digit")
    for own, words in ((tmp_path / "none", "which is no folder"), (mine, "a sensor's own folder")):
        monkeypatch.setenv(descriptor.OWN, str(own))
        with pytest.raises(TactileError, match=words):
            descriptor.describe("my_gel")
    monkeypatch.setenv(descriptor.OWN, str(tmp_path))
    assert f"not read: {mine}" in about("digit") and "not read" not in about("gelsight_mini")


def test_a_descriptor_whose_calibration_is_another_gel_s_is_refused(tmp_path, monkeypatch):
    changed(tmp_path, "poisson = 0.48", "poisson = 0.4", "gelsight_mini").rename(tmp_path / "my_mini")
    monkeypatch.setenv(descriptor.OWN, str(tmp_path))
    with pytest.raises(TactileError, match=r"default\.toml, sensor: 'gelsight_mini'; expected 'my_mini'"):
        about("my_mini")


def test_electrodes_outside_the_body_are_refused(tmp_path):
    every = np.concatenate([sensors.electrodes(), sensors.excitation_electrodes()])
    sensors.skin_of("biotac").check_inside(every)
    for axis, by in ((1, -4e-3), (2, -8e-3), (0, 30e-3)):
        moved = every.copy()
        moved[3, axis] += by
        with pytest.raises(TactileError, match="outside the body"):
            sensors.skin_of("biotac").check_inside(moved)


@pytest.mark.parametrize("row", ["E1,1,2,3", "E1,1,2,up,3000"])
def test_a_row_of_electrodes_that_is_none_is_named(tmp_path, row):
    path = tmp_path / "electrodes.csv"
    path.write_text(f"name,x_mm,y_mm,z_mm,rest_counts\n{row}\n")
    with pytest.raises(TactileError, match="row 2"):
        read_places(path)
