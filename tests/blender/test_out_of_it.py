"""Out of Blender: the picture's scene as Mitsuba's XML, sensors with their motion as Alembic and USD."""

import bpy
import numpy as np
import pytest

FRAMES = (72, 80)


def test_the_picture_s_scene_is_mitsuba_s(pressed_gel, part, needs, tmp_path):
    needs("OpenEXR")
    bpy.data.lights["LED red"].energy *= 0.5
    bpy.context.view_layer.update()
    pictures, write = part("addon.operators.pictures"), part("tactile_core.pictures.mitsuba.scene_file").write_scene
    shown, moved = pictures.shown_state(pressed_gel, bpy.context.evaluated_depsgraph_get())
    for name in ("blender", "core"):
        (tmp_path / name).mkdir()
    assert bpy.ops.tactile.export_mitsuba(filepath=str(tmp_path / "blender" / "gel.xml")) == {"FINISHED"}
    heights = part("tactile_core.pictures.height_map").height_map(moved, shown.unit.camera)
    part("addon.process.tracer_process").write_unit(tmp_path / "core", shown.unit)  # as Save As has it, rounded
    load = part("tactile_core.sensors.calibration_file").load_calibration
    write(tmp_path / "core" / "gel.xml", load(tmp_path / "core" / "unit.toml"), heights)
    for name in ("gel.xml", "gel.ply", "gel.camera.exr"):
        assert (tmp_path / "blender" / name).read_bytes() == (tmp_path / "core" / name).read_bytes()
    write(tmp_path / "core" / "gel.xml", load(), heights)
    assert (tmp_path / "blender" / "gel.xml").read_bytes() != (tmp_path / "core" / "gel.xml").read_bytes()
    (tmp_path / "mine.ply").write_text("a mesh of the user's own, which was replaced without a word")
    with pytest.raises(RuntimeError, match=r"mine\.ply: already there"):
        bpy.ops.tactile.export_mitsuba(filepath=str(tmp_path / "mine.xml"))


def alembic(path, start, end):
    rate = bpy.context.scene.render.fps
    bpy.ops.wm.alembic_export(filepath=path, start=start, end=end)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.context.scene.render.fps = rate  # Alembic holds seconds
    bpy.ops.wm.alembic_import(filepath=path)


def usd(path, start, end):
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = start, end
    bpy.ops.wm.usd_export(filepath=path, export_animation=True, export_shapekeys=False)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.ops.wm.usd_import(filepath=path)


@pytest.mark.usefixtures("pressed_gel")
@pytest.mark.parametrize(("ending", "through"), [("abc", alembic), ("usdc", usd)])
def test_sensors_and_their_motion_come_back(nodes_of, tmp_path, ending, through):
    if through.__name__ == "alembic" and "alembic_export" not in dir(bpy.ops.wm):
        pytest.skip("this Blender has no Alembic")

    def world(named):
        found = {}
        for frame in FRAMES:
            bpy.context.scene.frame_set(frame)
            things = [t for t in bpy.context.scene.objects if t.type == "MESH" and any(n in t.name for n in named)]
            for thing in things:
                turn = np.array(thing.matrix_world)
                name = next(n for n in named if n in thing.name)
                found[name, frame] = nodes_of(thing) @ turn[:3, :3].T + turn[:3, 3]
        return found

    named = ("DIGIT_gel", "BioTac_skin")
    for thing in bpy.context.scene.objects:
        thing.name = thing.name.replace(" ", "_")
    for thing in list(bpy.context.scene.objects):
        if thing.name not in named:
            bpy.data.objects.remove(thing)
    before = world(named)
    assert np.abs(before["DIGIT_gel", FRAMES[0]] - before["DIGIT_gel", FRAMES[1]]).max() > 0.1  # mm
    through(str(tmp_path / f"out.{ending}"), *FRAMES)
    after = world(named)
    assert after.keys() == before.keys()
    for key, nodes in before.items():
        assert len(after[key]) == len(nodes)
        scale = np.ptp(nodes) / np.ptp(after[key])  # USD is in metres
        np.testing.assert_allclose(after[key] * scale, nodes, atol=2e-3)
