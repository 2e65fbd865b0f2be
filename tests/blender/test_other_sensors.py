"""Sensors beside the BioTac and the DIGIT: any gel to translate to, weights of other sensors, what a scene holds."""

import shutil
from pathlib import Path

import bpy
import numpy as np
import pytest
from coarse_sensors import copy_mini

ROOT = Path(__file__).resolve().parents[2]
SENSORS = ROOT / "tactile_core" / "sensors"
GEL, SP = "coarse_mini", "biotac_sp"
WEIGHTS = ROOT / "tactile_core" / "data" / "weights"


@pytest.fixture(scope="module")
def own_sensors(tmp_path_factory):
    """A GelSight Mini of nodes 1 mm apart, whose compliance takes seconds, and the places of an SP's electrodes."""
    own = tmp_path_factory.mktemp("own")
    copy_mini(own)
    (own / SP).mkdir()
    rows = [f"E{k + 1},{x:.2f},0,-5,3000" for k, x in enumerate(np.linspace(-6, 6, 24))]  # on a line under the pad
    (own / SP / "locations.csv").write_text("\n".join(["name,x_mm,y_mm,z_mm,rest_counts", *rows, "X1,0,0,-4,"]) + "\n")
    return own


@pytest.fixture(autouse=True)
def known(own_sensors, monkeypatch):
    monkeypatch.setenv("TACTILE_SENSORS", str(own_sensors))


@pytest.fixture
def on_both(imported, needs, opened):
    """The recording's press on a DIGIT, and on the other gel behind it."""
    needs("scipy")

    def make():
        imported(frames="55:85:6")
        bpy.ops.tactile.translate()
        bpy.ops.tactile.set_style(style="DISPLACEMENT")
        bpy.ops.tactile.translate(to=GEL.upper())

    scene = opened("two gels", make)
    return [next(t for t in scene.objects if t.tactile.role == "DIGIT" and t.tactile.sensor == sensor)
            for sensor in ("digit", GEL)]  # fmt: skip


def test_the_menus_list_the_sensors_that_are_there_the_usual_pair_first(part):
    items = part("addon.settings.properties").sensor_items
    assert [name for name, _, _ in items()][:2] == ["BIOTAC", "DIGIT"]
    assert {"BIOTAC_SP", "GELSIGHT_MINI", GEL.upper()} <= {name for name, _, _ in items()}
    gels = [name for name, _, _ in items(gels_only=True)]
    assert gels[0] == "DIGIT" and "GELSIGHT_MINI" in gels and "BIOTAC_SP" not in gels


def test_another_gel_is_solved_under_the_contact_that_the_networks_find(on_both, nodes_of, loaded, part):
    scene, (digit, mini) = bpy.context.scene, on_both
    found = loaded("55:85:6").translation
    arrays = {name: getattr(found, name) for name in ("displacement_digit", "contact_center", "force", "flags")}
    wanted = part("tactile_core.jobs.solved_gel").solved(arrays, GEL, "digit")["displacement_digit"]
    scene.frame_set(79)
    rest = part("tactile_core.sensors").sensor_surface(GEL).rest
    to_blender = part("addon.objects.axes").to_blender
    np.testing.assert_allclose(nodes_of(mini), to_blender(rest + wanted[4], 1000), atol=1e-3)
    assert np.linalg.norm(wanted[4], axis=1).max() > 100e-6
    assert abs(mini.location.x - digit.location.x) > 40  # it stands beside the first
    assert part("addon.objects.styles").style_of(mini) == "DISPLACEMENT"  # as its skin
    words, _ = part("addon.ui.panels").trust_of(scene.objects["BioTac skin"], mini)
    assert "error not known" in words


def test_each_gel_has_its_own_picture_camera_and_lights(on_both, part):
    scene, (digit, mini) = bpy.context.scene, on_both
    assert tuple(bpy.data.images["Coarse Mini picture"].size) == (320, 240)
    assert tuple(bpy.data.images["DIGIT picture"].size) == (240, 320)
    for gel, size in ((mini, (320, 240)), (digit, (240, 320))):
        bpy.context.view_layer.objects.active = gel
        bpy.ops.tactile.set_up_render()
        assert (scene.render.resolution_x, scene.render.resolution_y) == size and scene.camera.parent == gel
        assert part("addon.settings.properties").gel_of(scene) == gel  # what F12 draws
    unit = part("tactile_core.sensors.calibration_file").load_calibration(None, GEL)
    shown = part("addon.objects.digit_unit").shown_unit(mini, bpy.context.evaluated_depsgraph_get(), unit)
    assert shown.unit == unit and not shown.around


def test_a_calibration_of_one_gel_leaves_the_other_its_own(on_both, part, tmp_path):
    scene, (digit, mini) = bpy.context.scene, on_both
    shutil.copy(SENSORS / "digit" / "default.toml", tmp_path / "unit.toml")
    of = part("addon.settings.render_settings").calibration_of
    scene.tactile_render.calibration = str(tmp_path / "unit.toml")
    assert (of(scene, "digit").camera.sensor, of(scene, GEL).camera.sensor) == ("digit", GEL)
    bpy.data.objects.remove(digit)
    bpy.context.view_layer.objects.active = mini
    with pytest.raises(RuntimeError, match=r"unit\.toml.*calibration file of a Coarse Mini"):
        bpy.ops.tactile.set_up_render()


def test_a_gel_is_simulated_alone(scene, needs, nodes_of):
    needs("scipy", "h5py", "msgspec")
    bpy.ops.tactile.add_sensor(sensor=GEL.upper())
    bpy.ops.tactile.add_indenter(shape="sphere", radius=4.0)
    scene.frame_end, ball, gel = 2, bpy.context.object, scene.objects["Coarse Mini gel"]
    rest = nodes_of(gel)
    for frame, depth in ((1, -0.5), (2, 0.4)):
        bpy.ops.tactile.snap_to_gel(depth=depth)
        ball.keyframe_insert("location", frame=frame)
    assert bpy.ops.tactile.simulate() == {"FINISHED"}
    scene.frame_set(2)
    assert (rest - nodes_of(gel))[:, 2].max() == pytest.approx(0.4, abs=0.1)  # mm; nodes are 1 mm apart


def test_a_second_fluid_sensor_stands_with_its_core(scene, nodes_of):
    bpy.ops.tactile.add_sensor(sensor="BIOTAC_SP")
    skin, core = nodes_of(scene.objects["BioTac SP skin"]), nodes_of(scene.objects["BioTac SP core"])
    assert np.isfinite(core).all() and (core > skin.min(axis=0)).all() and (core < skin.max(axis=0)).all()


@pytest.fixture
def recording(tmp_path):
    """A BioTac SP's, which is quiet and then squeezed."""
    change = -np.clip(np.arange(150) - 60, 0, 60)[:, None] * np.linspace(3, 1, 24)
    counts = np.rint(3000 + change + np.random.default_rng(7).normal(0, 1, (150, 24)))
    header = ",".join(f"ff_e{k}" for k in range(1, 25))
    np.savetxt(tmp_path / "touch.csv", counts, fmt="%d", delimiter=",", header=header, comments="")
    return tmp_path / "touch.csv"


def test_a_recording_names_the_sensor_that_is_imported(imported, recording, part):
    skin = imported(filepath=str(recording), frames="100:110")
    scene = bpy.context.scene
    assert skin.name == "BioTac SP skin" and skin.tactile.sensor == SP
    assert sum(thing.tactile.role == "ELECTRODE" for thing in scene.objects) == len(skin["electrodes"]) == 24
    assert bpy.ops.tactile.set_style(style="ELECTRODES") == {"FINISHED"}
    assert bpy.ops.tactile.translate() == {"FINISHED"}
    gel = next(t for t in scene.objects if t.tactile.role == "DIGIT")
    assert gel.tactile.sensor == "digit"  # as the weights say
    assert part("addon.ui.panels").trust_of(skin, gel)[0]


def test_without_a_table_of_places_no_electrodes_are_shown(imported, recording, monkeypatch, tmp_path):
    monkeypatch.setenv("TACTILE_SENSORS", str(tmp_path))
    skin = imported(filepath=str(recording), frames="100:104")
    assert len(skin["electrodes"]) == 24
    assert not any(thing.tactile.role == "ELECTRODE" for thing in bpy.context.scene.objects)


def test_what_are_no_weights_is_said(imported, tmp_path):
    with pytest.raises(RuntimeError, match=r"card\.json.*cannot be read"):
        imported(weights=str(tmp_path))
    assert not bpy.context.scene.objects


def test_a_recording_of_another_sensor_than_the_weights_is_refused_in_words(scene, recording):
    with pytest.raises(RuntimeError, match=r"touch\.csv.*24"):
        bpy.ops.tactile.import_recording(filepath=str(recording), weights=str(WEIGHTS))
    assert not scene.objects


def test_the_command_line_takes_a_gel_and_weights(part, needs, recording, tmp_path):
    needs("scipy")
    main = part("addon.process.command_line").main
    words = ["--to", GEL, "--weights", str(WEIGHTS / SP), "--frames", "115:117", "--out", str(tmp_path / "out")]
    assert main(["convert", str(recording), *words]) == 0
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out" / "touch" / "touch.blend"))
    sensors = {thing.tactile.role: thing.tactile.sensor for thing in bpy.context.scene.objects if thing.tactile.sensor}
    assert sensors == {"BIOTAC": SP, "DIGIT": GEL}
    assert bpy.context.scene.render.resolution_x == 320


def test_a_file_of_a_former_version_holds_the_usual_pair(imported, part):
    skin = imported(frames="70:72")
    bpy.ops.tactile.translate()
    for thing in bpy.context.scene.objects:
        thing.tactile.sensor = ""
    bpy.context.view_layer.objects.active = skin
    bpy.ops.tactile.translate()
    assert sum(thing.tactile.role == "DIGIT" for thing in bpy.context.scene.objects) == 1
