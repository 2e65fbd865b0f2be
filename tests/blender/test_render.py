"""The render engine: files as Blender people expect them, with the library's own pixels in them."""

import dataclasses
import importlib.util
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from mathutils import Vector

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def ready(pressed_gel):
    """A translated recording, set up to render."""
    bpy.ops.tactile.set_up_render()
    return bpy.context.scene


def _pixels(path):
    image = bpy.data.images.load(str(path))
    width, height = image.size
    values = np.empty(width * height * 4, np.float32)
    image.colorspace_settings.name = "Non-Color"
    image.pixels.foreach_get(values)
    return values.reshape(height, width, 4)[::-1, :, :3]


@pytest.fixture
def wanted(loaded, part):
    """``wanted(80)``: the library's picture of a frame."""

    def draw(frame=80):
        displacement = loaded("70:90").translation.displacement_digit[frame - 70]
        heights = part("tactile_core.pictures.height_map").height_map(displacement)
        return part("tactile_core.pictures.renderer").Renderer(preset="fast")(heights)

    return draw


@pytest.fixture
def left_out(ready, part):
    """``left_out()``: sentences on what of the scene the picture leaves out."""
    return lambda: part("addon.objects.digit_unit").left_out(ready, ready.objects["DIGIT gel"])


@pytest.fixture
def rendered(ready, tmp_path):
    """``rendered(file="frame.png", **options)``: renders frame 80 and reads the levels of the file."""

    def run(file="frame.png", **options):
        ready.render.filepath = str(tmp_path / "frame.png")
        bpy.ops.render.render(write_still=True, **options)
        return np.rint(255 * _pixels(tmp_path / file))

    return run


@pytest.mark.parametrize("view", ["Raw", "Standard"])
def test_a_frame_holds_the_library_s_own_pixels(ready, rendered, wanted, view):
    assert ready.view_settings.view_transform == "Raw"
    ready.view_settings.view_transform = view
    levels = rendered()
    assert levels.shape == (320, 240, 3)
    # A level: displacements of 30 mm coordinates are held in float32, and colour goes through sRGB's curve and back.
    assert np.abs(levels - wanted()).max() <= 1


def test_an_animation_writes_every_frame(ready, tmp_path):
    ready.frame_start, ready.frame_end = 78, 80
    ready.render.filepath = str(tmp_path) + "/"
    bpy.ops.render.render(animation=True)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["0078.png", "0079.png", "0080.png"]


def test_the_percentage_scales_the_picture(ready, rendered, wanted):
    ready.render.resolution_percentage = 200
    large = rendered()
    assert large.shape == (640, 480, 3)
    small = large.reshape(320, 2, 240, 2, 3).mean(axis=(1, 3))
    # The same view: means of four pixels against one, which differ at the dent's steep rim alone.
    assert np.abs(small - wanted()).mean() < 1


@pytest.mark.parametrize("percent", [12, 33, 66, 67, 150])
def test_every_percentage_renders_the_same_view(ready, rendered, percent):
    whole = rendered()
    ready.render.resolution_percentage = percent
    part = rendered()
    assert part.shape == (320 * percent // 100, 240 * percent // 100, 3)
    # Of a mean of 100 levels: less than a pixel is cut at an edge, one of 28 pixels at 12 %.
    assert np.abs(part.mean((0, 1)) - whole.mean((0, 1))).max() < 1.5


@pytest.mark.parametrize("crop", [False, True])
def test_a_render_region_is_that_part_of_the_picture(ready, rendered, crop):
    whole, render = rendered(), ready.render
    render.use_border, render.use_crop_to_border = True, crop
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.25, 0.6, 0.3, 0.9
    part, region = rendered(), (slice(32, 224), slice(60, 144))  # rows are counted from the lower edge
    np.testing.assert_array_equal(part if crop else part[region], whole[region])
    assert crop or part.sum() == part[region].sum()


def test_each_view_layer_and_each_eye_has_the_picture(ready, rendered):
    whole = rendered()
    layer = ready.view_layers.new("second")
    np.testing.assert_array_equal(rendered(layer="second"), whole)
    ready.view_layers.remove(layer)
    ready.render.use_multiview = True
    for eye in "LR":
        np.testing.assert_array_equal(rendered(f"frame_{eye}.png"), whole)


def test_a_multilayer_exr_holds_what_the_pixels_see(ready, rendered, part, tmp_path):
    kind = ready.render.image_settings
    if bpy.app.version >= (5, 0, 0):
        kind.media_type = "MULTI_LAYER_IMAGE"
    kind.file_format, kind.exr_codec, kind.color_depth = "OPEN_EXR_MULTILAYER", "NONE", "32"
    ready.frame_set(80)
    bpy.data.images.remove(bpy.data.images["DIGIT gel contact patch"])  # as one that was unpacked and lost
    ready.render.filepath = str(tmp_path / "frame.exr")
    bpy.ops.render.render(write_still=True)
    found = _channels(tmp_path / "frame.exr")
    assert found["ViewLayer.Combined.A"].min() == 1
    gel, depsgraph = bpy.context.scene.objects["DIGIT gel"], bpy.context.evaluated_depsgraph_get()
    _, heights = part("addon.operators.pictures").draw(gel, depsgraph, "fast")
    height, contact = found["ViewLayer.Height.V"], found["ViewLayer.Contact.V"]
    # Of the middle, where perspective moves nothing; the unit's dome is flatter than the public mesh's.
    assert height[140:180, 100:140].max() == pytest.approx(1e3 * heights[140:180, 100:140].max(), abs=0.05)
    touched = contact > 0.5
    assert 0.005 < touched.mean() < 0.5
    up, moved = found["ViewLayer.Normal.Z"], found["ViewLayer.Displacement.Z"]
    assert moved[touched].mean() < 3 * moved[~touched].mean() < 0 and up.min() > 0
    length = sum(found[f"ViewLayer.Normal.{axis}"] ** 2 for axis in "XYZ")
    np.testing.assert_allclose(length, 1, atol=1e-5)


def _channels(path):
    """The channels (H, W) float32 of an uncompressed EXR of 32-bit floats, by name."""
    data = path.read_bytes()
    at, known = 8, {}
    while data[at]:
        name, kind = (data[at:].split(b"\0", 2))[:2]
        at += len(name) + len(kind) + 2
        size = int.from_bytes(data[at : at + 4], "little")
        known[name], at = data[at + 4 : at + 4 + size], at + 4 + size
    width, height = (np.frombuffer(known[b"dataWindow"], "<i4")[2:] + 1).tolist()
    names, rest = [], known[b"channels"]
    while rest[0]:
        name, rest = rest.split(b"\0", 1)
        names, rest = [*names, name.decode()], rest[16:]
    row = 2 + len(names) * width
    values = np.frombuffer(data, "<f4", height * row, at + 1 + 8 * height).reshape(height, row)[:, 2:]
    return dict(zip(names, values.reshape(height, len(names), width).swapaxes(0, 1), strict=True))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda scene, gel: setattr(scene.camera.data, "type", "ORTHO"), "DIGIT camera: type ORTHO"),
        (lambda scene, gel: setattr(scene.camera.data, "shift_x", 0.2), "shift 0.2 and 0"),
        (lambda scene, gel: setattr(scene.camera.data, "sensor_fit", "HORIZONTAL"), "sensor fit HORIZONTAL"),
        (lambda scene, gel: setattr(gel, "hide_render", True), "DIGIT gel: hidden in view layer ViewLayer"),
        (lambda scene, gel: setattr(scene.collection.children[0], "hide_render", True), "hidden in view layer"),
        (lambda scene, gel: setattr(scene.render, "resolution_x", 300), r"ratio of \d+ x \d+\. Set Up Render sets it"),
        (lambda scene, gel: setattr(scene.tactile_render, "calibration", str(ROOT / "README.md")), "README.md"),
        (lambda scene, gel: _edit(gel), "DIGIT gel: in Edit Mode, where it is at rest; expected Object Mode"),
    ],
)
def test_what_cannot_be_drawn_is_refused(ready, change, words):
    change(ready, ready.objects["DIGIT gel"])
    with pytest.raises(RuntimeError, match=words):
        bpy.ops.render.render()


def _edit(gel):
    bpy.context.view_layer.objects.active = gel
    bpy.ops.object.mode_set(mode="EDIT")


def test_what_is_left_out_is_said(ready, part, capfd):
    ready.render.use_motion_blur = ready.camera.data.dof.use_dof = True
    ready.view_settings.view_transform, ready.view_settings.exposure = "Filmic", 1.0
    for name, kind in (("softbox", "AREA"), ("bulb", "POINT")):
        ready.collection.objects.link(bpy.data.objects.new(name, bpy.data.lights.new(name, kind)))
    ready.frame_set(5000)
    bpy.ops.render.render()
    said = capfd.readouterr()
    for words in (
        "softbox: no point lamp", "bulb: left out by the preset fast", "depth of field", "Motion blur",
        "Frame 5000: DIGIT gel stands still, it moves from 70 to 89",
        "View transform Filmic, Exposure change the levels",
    ):  # fmt: skip
        assert words in said.out + said.err


def test_colours_of_the_output_alone_are_seen_and_set_back(ready, wanted, left_out, tmp_path):
    """They override the scene's: by Standard the same levels are written, by an exposure others, which is said."""
    image = ready.render.image_settings
    image.color_management, image.view_settings.view_transform = "OVERRIDE", "Standard"
    ready.render.filepath = str(tmp_path / "frame.png")
    bpy.ops.render.render(write_still=True)
    picture = wanted(ready.frame_current)
    assert left_out() == []
    assert np.abs(np.rint(255 * _pixels(tmp_path / "frame.png")) - picture).max() <= 1
    image.view_settings.exposure, ready.view_settings.use_curve_mapping = 1.0, True
    image.color_mode = "BW"
    assert left_out() == ["Exposure, Color BW change the levels; Set Up Render sets Raw alone"]
    bpy.ops.tactile.set_up_render()
    assert left_out() == [] and image.color_management == "FOLLOW_SCENE"


@pytest.mark.skipif(bpy.app.version < (5, 0, 0), reason="before Blender 5 there is one working space")
def test_another_working_space_is_said(scene, part):
    """By Standard levels were up to 99 off."""
    bpy.ops.wm.set_working_color_space(working_space="ACEScg")
    bpy.ops.tactile.add_sensor(sensor="DIGIT")
    bpy.ops.tactile.set_up_render()
    assert re.match("Working space ACEScg", part("addon.objects.digit_unit").left_out(scene, bpy.context.object)[0])


def test_set_up_render_leaves_nothing_in_the_picture_s_place(ready, rendered, left_out):
    whole, render = rendered(), ready.render
    render.use_border, render.border_max_x, ready.view_layers[0].use = True, 0.5, False
    render.use_stamp = render.use_sequencer = True
    assert left_out() == ["Burn Into Image changes the levels; Set Up Render sets Raw alone"]
    bpy.ops.tactile.set_up_render()
    assert not render.use_sequencer
    np.testing.assert_array_equal(rendered(), whole)


def test_what_blender_draws_over_each_engine_s_picture_is_said(ready, left_out):
    """Strokes lay over the picture, and strips in its place, without a word."""
    since = bpy.app.version >= (4, 3, 0)
    (bpy.ops.object.grease_pencil_add if since else bpy.ops.object.gpencil_add)(type="STROKE")
    editor, long = ready.sequence_editor_create(), {"length" if bpy.app.version >= (5, 0, 0) else "frame_end": 90}
    strips = editor.strips if bpy.app.version >= (4, 4, 0) else editor.sequences
    white = strips.new_effect(name="white", type="COLOR", channel=1, frame_start=1, **long)
    ready.render.use_sequencer = white.mute = True
    assert left_out() == [f"Blender draws over the picture: {bpy.context.object.name}; hide it, or switch it off"]
    white.mute = False
    over = f"{bpy.context.object.name}, sequencer"
    assert left_out() == [f"Blender draws over the picture: {over}; hide it, or switch it off"]
    bpy.context.object.hide_render = True
    bpy.ops.tactile.set_up_render()
    assert left_out() == []


def test_a_compositor_that_changes_the_picture_is_said(ready, left_out):
    if bpy.app.version >= (5, 0, 0):
        tree = ready.compositing_node_group = bpy.data.node_groups.new("nodes", "CompositorNodeTree")
        tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        kind = "NodeGroupOutput"
    else:
        ready.use_nodes, kind = True, "CompositorNodeComposite"
        tree = ready.node_tree
        assert left_out() == []  # as Blender begins
        tree.nodes.clear()
    layers, between, end = (tree.nodes.new(name) for name in ("CompositorNodeRLayers", "NodeReroute", kind))
    tree.links.new(layers.outputs["Image"], between.inputs[0])
    assert "compositor" in left_out()[0]
    tree.links.new(between.outputs[0], end.inputs[0])
    assert left_out() == []
    layers.scene = bpy.data.scenes.new("another")
    assert "compositor" in left_out()[0]
    layers.scene = ready
    tree.links.new(between.outputs[0], between.inputs[0])  # a circle, in place of what is rendered
    assert "compositor" in left_out()[0]
    ready.render.use_compositing = False
    tree.links.clear()
    assert left_out() == []


def test_a_gel_that_is_moved_as_an_object_does_not_stand_still(ready, left_out, part):
    gel = ready.objects["DIGIT gel"]
    gel.animation_data.action = None
    for frame in (1, 10):
        gel.keyframe_insert("location", frame=frame)
    assert left_out() == []
    ready.frame_set(5)
    assert left_out() == ["Frame 5: DIGIT gel stands still, it moves from 70 to 89"]
    curve = part("addon.objects.curves").fcurves_of(gel.data.shape_keys).find("eval_time")
    curve.modifiers.new("CYCLES")
    assert left_out() == []


def test_hidden_leds_and_meshes_in_the_housing_are_told(ready, part, capfd):
    gel = ready.objects["DIGIT gel"]
    bpy.ops.mesh.primitive_cube_add(size=2, location=gel.matrix_world @ Vector((-3, 0, 2)))
    for thing in part("addon.objects.digit_body").leds_of(gel).values():
        thing.hide_render = True
    bpy.ops.render.render()
    said = capfd.readouterr()
    for words in ("its LEDs are hidden or deleted", "reach into DIGIT gel's housing: 1, left out by the preset fast"):
        assert words in said.out + said.err


def test_ways_of_light_that_are_left_out_are_said(ready, part, left_out):
    bpy.ops.object.light_add(type="POINT")
    bpy.context.object.light_linking.receiver_collection = bpy.data.collections.new("none of these")
    said = [f"{bpy.context.object.name}: its light linking is left out"]
    red = part("addon.objects.digit_body").leds_of(ready.objects["DIGIT gel"])["red"]
    if hasattr(red.data, "normalize"):
        red.data.normalize, said = False, [f"{red.name}: drawn as if Normalize were on", *said]
    assert left_out() == said


@pytest.mark.parametrize("kind", ["OPEN_EXR", "HDR", "DPX"])
def test_linear_light_by_raw_says_how_to_look_at_it(ready, left_out, kind):
    if kind not in ready.render.image_settings.bl_rna.properties["file_format"].enum_items:
        pytest.skip("this Blender has no such files")
    assert left_out() == []
    ready.render.image_settings.file_format = kind
    (words,) = left_out()
    assert "view transform Standard" in words


def test_a_fault_of_our_own_ends_the_render_too(ready, part, monkeypatch, tmp_path):
    monkeypatch.setattr(part("addon.operators.pictures"), "fields", lambda *_: 1 / 0)
    ready.render.filepath = str(tmp_path / "images") + "/"
    ready.frame_start, ready.frame_end = 78, 80
    with pytest.raises(RuntimeError, match="division by zero"):
        bpy.ops.render.render(animation=True)
    assert not (tmp_path / "images").exists()


def test_without_leds_it_is_dark(ready, rendered):
    for thing in [thing for thing in ready.objects if thing.tactile.role == "LED"]:
        bpy.data.objects.remove(thing)
    assert rendered().max() == 0


@pytest.mark.parametrize(("kind", "name"), [("OPEN_EXR", "frame.exr"), ("HDR", "frame.hdr")])
def test_linear_light_holds_the_same_in_float(ready, part, wanted, tmp_path, kind, name):
    ready.frame_set(80)
    ready.render.image_settings.file_format = kind
    ready.render.filepath = str(tmp_path / name)
    bpy.ops.render.render(write_still=True)
    linear = _pixels(tmp_path / name)
    picture = part("addon.operators.render_engine").to_linear(wanted())[..., :3]
    assert np.abs(linear - picture).max() < 0.01  # a grey level is at most 0.009 of linear light


def test_lights_change_their_own_colour(ready, rendered):
    levels = rendered()
    bpy.data.lights["LED red"].energy *= 0.2
    change = np.abs(levels - rendered()).max(axis=(0, 1)) / 255
    # A unit's LEDs leak into the other colours: the shipped response has at most 0.26 of the red one, in a corner.
    assert change[0] > 0.1 and change[0] > 3 * max(change[1], change[2])


def test_the_camera_looks_at_what_the_picture_shows(ready, part):
    from bpy_extras.object_utils import world_to_camera_view
    from mathutils import Vector

    unit = part("tactile_core.sensors.calibration_file").load_calibration().camera
    gel = bpy.context.scene.objects["DIGIT gel"]
    bpy.context.view_layer.update()
    height_zero = part("tactile_core.sensors.camera").HEIGHT_ZERO_Y
    for row, column in ((0, 0), (319, 239), (100, 60)):
        x, z = unit.to_gel(row, column)
        place = part("addon.objects.axes").to_blender(np.array([x, height_zero, z]), 1000)
        seen = world_to_camera_view(bpy.context.scene, ready.camera, gel.matrix_world @ Vector(place.tolist()))
        assert seen.x * 240 - 0.5 == pytest.approx(column, abs=0.05)
        assert (1 - seen.y) * 320 - 0.5 == pytest.approx(row, abs=0.05)


def test_output_panels_are_shown_for_the_engine_and_given_back(extension):
    import bl_ui.properties_output as output

    part = sys.modules["bl_ext.user_default.tactile.addon.operators.render_engine"]
    assert part.ID in output.RENDER_PT_format.COMPAT_ENGINES
    assert part.ID in output.RENDER_PT_output.COMPAT_ENGINES


def test_a_saved_file_renders_headless(ready, tmp_path):
    """What users type: `blender -b file.blend -a`, here with whatever Blender runs these tests."""
    ready.frame_start, ready.frame_end = 79, 80
    ready.render.filepath = str(tmp_path / "images") + "/"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    if not bpy.app.binary_path:
        pytest.skip("the wheel has no command line; tests of real Blenders have")
    options = ["--background", "--addons", "bl_ext.user_default.tactile", str(tmp_path / "a.blend")]
    subprocess.run([bpy.app.binary_path, *options, "-E", "TACTILE_DIGIT", "-a"], check=True, timeout=120)
    assert sorted(path.name for path in (tmp_path / "images").iterdir()) == ["0079.png", "0080.png"]


TRACED = importlib.util.find_spec("mitsuba") is not None


@pytest.mark.skipif(not TRACED, reason="mitsuba is missing")
def test_a_preset_of_mitsuba_draws_nearly_the_same(ready, rendered, wanted):
    ready.tactile_render.preset = "standard"
    assert np.sqrt(np.mean((rendered() - wanted()) ** 2)) < 5  # grey levels: fast and standard differ by one or two


@pytest.fixture
def at_rest(part):
    """Unit, surroundings and heights (H, W) m of a resting gel."""
    unit = part("tactile_core.sensors.calibration_file").load_calibration()
    nothing = part("tactile_core.pictures.mitsuba.gel_scene").NOTHING
    return unit, nothing, part("tactile_core.pictures.height_map").rest_height_map(unit.camera)


@pytest.fixture
def traced(part, at_rest):
    """A worker as Mitsuba's presets use it, with the one that needs no Mitsuba; and what draws a gel's heights."""
    unit, nothing, heights = at_rest
    tracer = part("addon.process.tracer_process").Tracer("fast")

    def draw(heights, stopped=lambda: False, unit=unit, better=lambda picture: None):
        return tracer.draw(unit, nothing, heights, stopped, better)

    yield tracer, draw, heights
    tracer.close()


def test_a_worker_draws_what_the_library_draws(traced, part):
    _, draw, heights = traced
    raised = heights.copy()
    raised[150:170, 100:120] += 2e-4
    renderer = part("tactile_core.pictures.renderer").Renderer(preset="fast")
    for height in (heights, raised):
        np.testing.assert_array_equal(draw(height), renderer(height))


def test_a_worker_takes_another_unit(traced, at_rest, part):
    (_, draw, heights), unit = traced, at_rest[0]
    off = dataclasses.replace(unit, leds=(dataclasses.replace(unit.leds[0], radiance=0.0), *unit.leds[1:]))
    renderer = part("tactile_core.pictures.renderer").Renderer(off, "fast")
    draw(heights)
    np.testing.assert_array_equal(draw(heights, unit=off), renderer(heights))


def test_a_worker_gets_ready_before_its_first_picture_and_ends_after_an_idle_minute(at_rest, part, monkeypatch):
    process = part("addon.process.tracer_process")
    process.prepare("fast", *at_rest[:2])
    ready = process._kept["fast"]
    picture = process.draw("fast", *at_rest, lambda: False, lambda picture: None)
    assert process._kept["fast"] is ready
    np.testing.assert_array_equal(picture, part("tactile_core.pictures.renderer").Renderer(preset="fast")(at_rest[2]))
    worker = ready._job._process
    process.close_idle()
    assert worker.poll() is None
    monkeypatch.setattr(process, "_IDLE", -1.0)
    process.close_idle()
    assert worker.poll() is not None and not process._kept


def test_another_file_ends_the_workers(part):
    process = part("addon.process.tracer_process")
    process._kept["fast"] = process.Tracer("fast")
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    assert not process._kept


def test_esc_stops_a_worker(traced, part):
    with pytest.raises(part("addon.process.tracer_process").Stopped):
        traced[1](traced[2], lambda: True)


def test_a_worker_that_aborts_leaves_blender_alive(traced, part):
    tracer, draw, heights = traced
    tracer._job._process.kill()
    with pytest.raises(part("tactile_core.errors").TactileError, match="ended"):
        draw(heights)


def test_the_panel_names_the_preset_that_a_bound_picks(ready, part):
    said = []
    layout = SimpleNamespace(prop=lambda *_, **__: None, label=lambda text, icon: said.append((text, icon)))
    draw, context = part("addon.operators.render_setup").draw_error, SimpleNamespace(scene=ready)
    draw(layout, context)
    assert not said
    for bound in ("1levels", "1e-9levels"):
        ready.tactile_render.error = bound
        draw(layout, context)
    (chosen, ticked), (refused, marked) = said
    names = [preset.title() for preset in part("tactile_core.pictures.presets").measured()["presets"]]
    assert chosen.removeprefix("Preset chosen: ") in names and ticked == "CHECKMARK"
    assert "Largest Error" in refused and marked == "ERROR"


def test_a_bound_on_pictures_picks_the_preset(ready, part):
    settings, scene = part("addon.settings.render_settings"), bpy.context.scene
    table = part("tactile_core.pictures.presets").measured()["presets"]
    scene.tactile_render.preset = "standard"
    assert settings.preset_of(scene) == "standard"
    for preset in ("fast", "quality"):
        bound = f"9um,{table[preset]['error']}levels"
        scene.tactile_render.error = bound
        assert settings.preset_of(scene) == preset
    scene.tactile_render.error = "1e-9levels"
    with pytest.raises(part("tactile_core.errors").TactileError, match="or more, which"):
        settings.preset_of(scene)
