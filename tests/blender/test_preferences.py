"""Preferences: the cache's size and its clearing, LLVM's verdict, the default calibration."""

import os

import bpy
import pytest

PACKAGE = "bl_ext.user_default.tactile"


@pytest.fixture
def preferences(extension):
    found = bpy.context.preferences.addons[PACKAGE].preferences
    yield found
    found.calibration = found.llvm = found.sensors = ""


def test_the_cache_lies_in_the_extension_s_folder_unless_it_is_named(monkeypatch, part, extension):
    own, named = bpy.utils.extension_path_user(PACKAGE, path="cache"), "elsewhere"
    for before, after in ((None, own), (named, named)):
        monkeypatch.delenv("TACTILE_CACHE", raising=False)
        if before:
            monkeypatch.setenv("TACTILE_CACHE", before)
        part("addon.settings.preferences").register()
        assert str(part("tactile_core.files.array_cache").cache_folder()) == after


def test_clearing_the_cache_removes_our_arrays_alone(monkeypatch, tmp_path, part):
    monkeypatch.setenv("TACTILE_CACHE", str(tmp_path))
    for name in ("compliance-digit-1", "mine"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "array.npy").write_bytes(b"1234")
    (tmp_path / "compliance-digit-1" / "sha256.json").write_text("{}")
    assert [
        part("addon.settings.preferences").size_of(each) for each in part("tactile_core.files.array_cache").entries()
    ] == [6]
    assert bpy.ops.tactile.clear_cache() == {"FINISHED"}
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine"]


def test_a_scene_without_calibration_takes_the_preferences(preferences, scene, part, tmp_path, capfd):
    settings = part("addon.settings.render_settings")
    own = tmp_path / "unit.toml"
    bpy.ops.tactile.add_sensor(sensor="DIGIT")
    bpy.data.lights["LED red"].energy *= 2
    bpy.ops.tactile.save_as_calibration(filepath=str(own))
    shipped = settings.calibration_of(scene, "digit")
    preferences.calibration = str(own)
    found = settings.calibration_of(scene, "digit").leds[0].radiance
    assert found == pytest.approx(2 * shipped.leds[0].radiance, rel=1e-5)
    # The gel's LEDs are still of the former unit, the rest of its picture is of this one.
    bpy.ops.tactile.set_up_render()
    scene.render.resolution_percentage = 10
    for mixed in (2, 0):
        capfd.readouterr()
        bpy.ops.render.render()
        bpy.ops.tactile.set_up_render()
        said = capfd.readouterr()
        words = f"camera are of {shipped.unit}, the rest of its picture of {shipped.unit}, changed"
        assert (said.out + said.err).count(words) == mixed
        bpy.ops.tactile.reset_to_calibration()


def test_own_sensors_are_told_until_the_folder_is_cleared(preferences, part, tmp_path):
    (tmp_path / "biotac_sp").mkdir()
    (tmp_path / "biotac_sp" / "locations.csv").write_text("")
    descriptor, held = part("tactile_core.sensors.descriptor"), part("addon.settings.preferences").sensors_in
    before = os.environ.get(descriptor.OWN)
    preferences.sensors = str(tmp_path)
    assert os.environ[descriptor.OWN] == str(tmp_path) and held(preferences.sensors) == ["biotac_sp"]
    assert held(str(tmp_path / "biotac_sp")) == []  # a sensor's own folder
    preferences.sensors = ""
    assert os.environ.get(descriptor.OWN) == before


def test_the_verdict_on_llvm_names_a_library_that_is_not_there(preferences, monkeypatch):
    pytest.importorskip("mitsuba")
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", "")
    preferences.llvm = "/nowhere/libLLVM.so"
    assert bpy.ops.tactile.check_llvm() == {"FINISHED"}
    assert "one ray at a time" in preferences.verdict and "/nowhere/libLLVM.so" in preferences.verdict
