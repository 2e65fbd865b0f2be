"""Author: sensors, indenters, scenes and the simulation."""

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
SCENES = sorted(path.parent for path in (ROOT / "scenes").glob("*/scene.toml"))


@pytest.fixture(autouse=True)
def _packages(extension):
    """Only once the extension is there: in a real Blender they come with it."""
    for name in ("msgspec", "scipy"):
        pytest.importorskip(name)


@pytest.fixture
def sensors(opened):
    return opened("sensors", lambda: [bpy.ops.tactile.add_sensor(sensor=each) for each in ("BIOTAC", "DIGIT")])


@pytest.fixture
def gel_alone(opened):
    """A DIGIT: where a test is not about the BioTac, a worker need not read its 330 MB of matrices."""
    return opened("gel alone", lambda: bpy.ops.tactile.add_sensor(sensor="DIGIT"))


def _key(thing, frame, **values):
    for name, value in values.items():
        if name == "force":
            thing.tactile.force = value
            thing.keyframe_insert("tactile.force", frame=frame)
        else:
            thing.location["xyz".index(name)] = value
            thing.keyframe_insert("location", index="xyz".index(name), frame=frame)


def _straighten(part, thing):
    """Make its keys' curves lines, and return the first."""
    curves = [*part("addon.objects.curves").fcurves_of(thing)]
    for point in (point for curve in curves for point in curve.keyframe_points):
        point.interpolation = "LINEAR"
    return curves[0]


def _export(folder):
    bpy.ops.tactile.export_scene(filepath=str(folder / "scene.toml"))
    return folder / "scene.toml"


@pytest.mark.parametrize("shape", ["sphere", "cylinder", "lying_cylinder", "box", "ring", "edge"])
def test_an_indenter_looks_as_large_as_it_is(sensors, nodes_of, part, shape):
    bpy.ops.tactile.add_indenter(shape=shape)
    thing = bpy.context.object
    import msgspec

    spec = msgspec.json.decode(thing.tactile.spec, type=part("tactile_core.simulation.indenter_specs").IndenterSpec)
    low, high = spec.build().bounds()
    nodes = nodes_of(thing)
    # A hundredth of a body of some mm: the hull's corners lie on the body, its edges a little inside.
    np.testing.assert_allclose(nodes.min(axis=0), 1e3 * low, atol=0.1)
    np.testing.assert_allclose(nodes.max(axis=0), 1e3 * high, atol=0.1)


@pytest.mark.parametrize("folder", SCENES, ids=lambda path: path.name)
def test_shipped_scenes_come_back_exactly(scene, part, tmp_path, folder):
    load = part("tactile_core.simulation.scene").load_scene
    wanted = load(folder)[0]
    bpy.ops.tactile.import_scene(filepath=str(folder / "scene.toml"))
    if wanted.recording is None:
        assert sum(thing.tactile.role == "INDENTER" for thing in scene.objects) == len(wanted.indenters)
        return
    found = load(_export(tmp_path))[0]

    import msgspec

    def without_folders(spec):
        return msgspec.structs.replace(spec, file=Path(spec.file).name) if hasattr(spec, "file") else spec

    same = [msgspec.structs.replace(s, indenters=[without_folders(i) for i in s.indenters]) for s in (found, wanted)]
    assert same[0] == same[1]


def test_a_scene_file_is_not_laid_over_sensors_that_are_there(imported):
    """Simulate then pressed the first skin of the scene, a recording's, and its own stood still."""
    imported(frames="70:72")
    with pytest.raises(RuntimeError, match=r"BIOTAC: already in the scene, as BioTac skin.* Use a scene for each"):
        bpy.ops.tactile.import_scene(filepath=str(SCENES[0] / "scene.toml"))


def test_a_motion_friction_and_tilt_of_the_user_s_own_are_exported(sensors, part, tmp_path):
    bpy.ops.tactile.add_indenter(shape="sphere", radius=3.5)
    ball = bpy.context.object
    sensors.render.fps, sensors.frame_start, sensors.frame_end = 50, 1, 51
    ball.tactile.press_by, ball.tactile.friction, ball.tactile.tilt = "FORCE", 0.35, np.radians(12)
    _key(ball, 1, x=-8, y=0, force=0.0)
    _key(ball, 51, x=-10, y=2, force=0.4)
    _straighten(part, ball)
    recording = part("tactile_core.simulation.scene").load_scene(_export(tmp_path))[0].recording
    assert (recording.friction, recording.tilt_deg) == (0.35, 12.0)
    assert [(p.time_s, p.x_mm, p.z_mm, p.force_n) for p in recording.points] == [
        (0.0, -8.0, 0.0, 0.0), (1.0, -10.0, 2.0, 0.4),
    ]  # fmt: skip


@pytest.mark.parametrize("by", ["gel", "noise", "delta"])
def test_motion_that_keys_do_not_tell_is_sampled(sensors, part, tmp_path, by):
    """The path between two straight keys was taken for a line, whatever else moved the indenter or the gel."""
    bpy.ops.tactile.add_indenter(shape="sphere")
    ball = bpy.context.object
    sensors.frame_start, sensors.frame_end = 1, 11
    ball.tactile.press_by, ball.parent = "FORCE", None
    for frame, force in ((1, 0.0), (11, 0.4)):
        _key(ball, frame, x=-8, force=force)
    curve = _straighten(part, ball)
    moved = {"gel": sensors.objects["DIGIT gel"], "delta": ball}.get(by)
    for frame, x in ((1, 0), (6, 4), (11, 0)) if moved else ():
        path = "location" if by == "gel" else "delta_location"
        setattr(moved, path, (x, *getattr(moved, path)[1:]))
        moved.keyframe_insert(path, index=0, frame=frame)
    if by == "noise":
        curve.modifiers.new("NOISE").strength = 4
    points = part("tactile_core.simulation.scene").load_scene(_export(tmp_path))[0].recording.points
    x = [point.x_mm for point in points]
    assert len(x) == 11 and x[5] == pytest.approx({"gel": -12, "delta": -4}.get(by, x[5]), abs=0.01)
    assert np.ptp(x) > 0.5


@pytest.mark.parametrize(
    ("change", "words"),
    [
        # Keys baked at a frame are played at another then; an import sets it back.
        (lambda scene, ball: setattr(scene.render, "frame_map_new", 50), "time is stretched, 100 to 50; expected none"),
        (lambda scene, ball: setattr(scene, "frame_end", 1), "two frames or more"),
        (lambda scene, ball: setattr(ball, "scale", (2, 2, 2)), "turned or scaled"),
        (lambda scene, ball: setattr(ball, "hide_viewport", True), "sphere: hidden, so .*; expected an indenter that"),
        # It pressed as it was before it was edited.
        (lambda scene, ball: bpy.ops.object.mode_set(mode="EDIT"), "sphere: in Edit Mode; expected Object.* Press Tab"),
    ],
)
def test_what_cannot_be_simulated_is_refused(gel_alone, change, words):
    bpy.ops.tactile.add_indenter(shape="sphere")
    gel_alone.frame_end = 2
    change(gel_alone, bpy.context.object)
    bpy.context.view_layer.update()
    with pytest.raises(RuntimeError, match=words):
        bpy.ops.tactile.simulate()


def test_a_body_that_turns_later_is_refused(gel_alone, tmp_path):
    """It was looked at on the current frame alone, and pressed upright on all."""
    bpy.ops.tactile.add_indenter(shape="box")
    box = bpy.context.object
    box.tactile.press_by, gel_alone.frame_end = "FORCE", 5
    for frame, angle in ((1, 0.0), (5, 0.5)):
        box.rotation_euler.z = angle
        box.keyframe_insert("rotation_euler", frame=frame)
    gel_alone.frame_set(1)
    for spec in (box.tactile.spec, ""):  # "": with the mesh as it is
        box.tactile.spec = spec
        with pytest.raises(RuntimeError, match=r"box: turned or scaled against the sensor on frame [2-5];"):
            _export(tmp_path)


def test_a_unit_that_changes_other_objects_is_said(scene, capfd):
    own = bpy.data.objects.new("robot", bpy.data.meshes.new("robot"))
    scene.collection.objects.link(own)
    bpy.ops.tactile.add_sensor(sensor="BIOTAC", millimetres=False)
    assert scene.unit_settings.scale_length == 1 and "millimetre" not in capfd.readouterr().out
    bpy.ops.tactile.add_sensor(sensor="DIGIT")
    assert "Warning: The scene's unit is a millimetre now, of its other objects too" in capfd.readouterr().out


def test_curved_motion_is_sampled(sensors, part, tmp_path):
    bpy.ops.tactile.add_indenter(shape="sphere")
    ball = bpy.context.object
    sensors.frame_start, sensors.frame_end = 1, 11
    ball.tactile.press_by = "FORCE"
    _key(ball, 1, x=-8, force=0.0)
    _key(ball, 11, x=-10, force=0.4)
    points = part("tactile_core.simulation.scene").load_scene(_export(tmp_path))[0].recording.points
    assert len(points) == 11 and points[5].x_mm == pytest.approx(-9, abs=0.01)
    assert points[2].x_mm > -8.4  # Bezier keys start slowly; a straight line would be there already


def test_simulating_bakes_what_the_command_line_computes(scene, nodes_of, part, tmp_path):
    folder = tmp_path / "short"
    folder.mkdir()
    text = (ROOT / "scenes" / "press" / "scene.toml").read_text()
    head = text[: text.index("points")]
    at = "x_mm = -8.0, z_mm = 0.0"
    points = f"points = [{{ time_s = 0.0, {at}, force_n = 0.0 }}, {{ time_s = 0.02, {at}, force_n = 0.3 }}]\n"
    (folder / "scene.toml").write_text(head + points)
    bpy.ops.tactile.import_scene(filepath=str(folder / "scene.toml"))
    assert bpy.ops.tactile.simulate(seed=3) == {"FINISHED"}
    command = [sys.executable, "-P", "-m", "tactile_core", "simulate", str(folder), "--seed", "3"]
    wanted = tmp_path / "wanted.h5"
    environment = part("addon.process.jobs")._environment()
    subprocess.run([*command, "--out", str(wanted)], env=environment, check=True, timeout=300)
    truth = part("addon.process.recording_reader").read(wanted).truth
    for frame in (0, 1, 2):
        scene.frame_set(frame)
        for role, surface, moved in (
            ("BIOTAC", part("tactile_core.sensors").biotac_surface(), truth.displacement_biotac),
            ("DIGIT", part("tactile_core.sensors").digit_surface(), truth.displacement_digit),
        ):
            sensor = next(thing for thing in scene.objects if thing.tactile.role == role)
            nodes = part("addon.objects.axes").to_blender(surface.rest + moved[frame], 1000)
            np.testing.assert_allclose(nodes_of(sensor), nodes, atol=1e-3)
    gel = scene.objects["DIGIT gel"]
    assert gel["force"][2] == pytest.approx(-truth.force[2, 1], rel=1e-4)
    # The twin stands in its dent: its lowest point is where the gel is deepest.
    low = (scene.objects["ball simulated"].matrix_world.translation - gel.matrix_world.translation).z
    assert low == pytest.approx(nodes_of(gel)[np.argmax(truth.displacement_digit[2, :, 1]), 2], abs=0.15)


def test_too_deep_a_press_is_reported_by_object_frame_and_depth(gel_alone):
    bpy.ops.tactile.add_indenter(shape="sphere", radius=3.5)
    gel_alone.render.fps, gel_alone.frame_start, gel_alone.frame_end = 100, 41, 43
    for frame, height in ((41, 9.3), (43, 8.3 - 3.5)):
        _key(bpy.context.object, frame, z=height)
    with pytest.raises(RuntimeError, match=r"sphere, frame 4[23]: .*\d\.\d\d mm below the gel.*Lift it") as caught:
        bpy.ops.tactile.simulate()
    assert "/tmp" not in str(caught.value) and "scene.toml" not in str(caught.value)


def test_an_indenter_beside_the_sensor_is_reported_by_object_and_frame(gel_alone):
    bpy.ops.tactile.add_indenter(shape="sphere", radius=3.5)
    gel_alone.frame_start, gel_alone.frame_end = 1, 2
    for frame, aside in ((1, 0.0), (2, 60.0)):
        _key(bpy.context.object, frame, y=aside)
    with pytest.raises(RuntimeError, match=r"sphere, frame 2: it passes the sensor by.* Move it over the sensor"):
        bpy.ops.tactile.simulate()


def test_a_duplicate_stands_in_the_scene_by_its_object_s_name(gel_alone, part):
    bpy.ops.tactile.add_indenter(shape="sphere")
    gel_alone.collection.objects.link(bpy.context.object.copy())
    found = part("addon.operators.scene_bridge").authored(bpy.context).scene
    assert [body.name for body in found.indenters] == ["sphere", "sphere_001"]
    assert found.recording.indenter == "sphere"


def test_an_indenter_that_touches_nothing_is_said(gel_alone, capfd):
    bpy.ops.tactile.add_indenter(shape="sphere", radius=3.5)
    gel_alone.frame_start, gel_alone.frame_end, bpy.context.object.location.z = 1, 2, 20.0
    assert bpy.ops.tactile.simulate() == {"FINISHED"}
    assert "sphere touched no sensor: press with it lower" in capfd.readouterr().out


def test_pressing_by_height_finds_the_force_and_names_its_stages(gel_alone, part, monkeypatch):
    bpy.ops.tactile.add_indenter(shape="sphere", radius=3.5)
    ball = bpy.context.object
    gel_alone.render.fps, gel_alone.frame_start, gel_alone.frame_end = 100, 1, 3
    touch = 8.3  # mm: the gel's top in the sensors' frame (docs/sources.md, Frame), where a ball's lowest point touches
    for frame, height in ((1, touch + 1), (3, touch - 0.5)):
        _key(ball, frame, z=height)
    job, seen = part("addon.process.jobs").Job, []
    poll = job.poll

    def polled(self, wait=0.0):
        over = poll(self, wait)
        seen.append(self.stage)
        return over

    monkeypatch.setattr(job, "poll", polled)
    assert bpy.ops.tactile.simulate() == {"FINISHED"}
    assert seen[-1] == "Solving the contacts, 3 of 3"
    gel_alone.frame_set(1)
    assert ball.tactile.force == 0
    # Lifted off, its twin is where its keys are; pressing, it is lower than they say by no more than the dent's slack.
    gel, twin = gel_alone.objects["DIGIT gel"], gel_alone.objects["sphere simulated"]
    assert (twin.matrix_world.translation - gel.matrix_world.translation).z == pytest.approx(touch + 1, abs=0.01)
    assert ball.display_type == "BOUNDS" and twin.color[3] < 1
    gel_alone.frame_set(3)
    assert (twin.matrix_world.translation - gel.matrix_world.translation).z == pytest.approx(touch - 0.5, abs=0.1)
    place = part("tactile_core.mechanics.placement").Placement(-8e-3, 0.0)
    ball_shape = part("tactile_core.geometry.indenters").Sphere(3.5e-3)
    wanted = part("tactile_core.mechanics.solve").solve("digit", ball_shape, place, depth=0.5e-3, friction=0.0)
    # 10 %: the top of the gel is known to 10 um, and force goes with depth to the power of 1.5.
    assert ball.tactile.force == pytest.approx(np.linalg.norm(wanted.force), rel=0.1)


def _cube(scene, size=6.0, **options):
    bpy.ops.mesh.primitive_cube_add(size=size, location=(-8, 0, 12))
    thing = bpy.context.object
    thing.parent = scene.objects["DIGIT gel"]
    thing.location = (-8, 0, 12)
    for name, value in options.items():
        setattr(thing, name, value)
    bpy.context.view_layer.update()
    return thing


def test_any_mesh_can_press_as_it_is_modifiers_and_scale_included(sensors, part, tmp_path):
    thing = _cube(sensors, scale=(1, 1, 0.5))
    bevel = thing.modifiers.new("round", "BEVEL")
    bevel.width, bevel.segments = 0.8, 3
    bpy.context.view_layer.update()
    bpy.ops.tactile.use_as_indenter()
    thing.tactile.press_by = "FORCE"
    sensors.frame_start, sensors.frame_end = 1, 2
    path = _export(tmp_path)
    spec = part("tactile_core.simulation.scene").load_scene(path)[0].indenters[0]
    corners = np.frombuffer(
        Path(spec.file).read_bytes()[84:], np.dtype([("n", "<f4", 3), ("c", "<f4", (3, 3)), ("s", "<u2")])
    )
    nodes = corners["c"].reshape(-1, 3)
    np.testing.assert_allclose(np.ptp(nodes, axis=0), [6, 6, 3], atol=1e-4)
    assert len(corners) > 100  # the bevel's faces, not the cube's twelve triangles


@pytest.mark.parametrize("scale", [(1, 1, -1), (0, 1, 1)])
def test_a_mirrored_mesh_is_refused(sensors, scale):
    thing = _cube(sensors, scale=scale)
    with pytest.raises(RuntimeError, match="negative or zero"):
        bpy.ops.tactile.use_as_indenter()
    assert thing.tactile.role == "NONE"


@pytest.mark.parametrize(("what", "expected"), [("open", "not closed"), ("huge", "0.2 to 100 mm")])
def test_an_open_or_huge_mesh_is_refused_by_the_simulation(gel_alone, what, expected):
    pytest.importorskip("trimesh")
    pytest.importorskip("rtree")
    thing = _cube(gel_alone, size=6.0 if what == "open" else 600.0)
    if what == "open":
        import bmesh

        shape = bmesh.new()
        shape.from_mesh(thing.data)
        shape.faces.ensure_lookup_table()
        bmesh.ops.delete(shape, geom=[shape.faces[0]], context="FACES")
        shape.to_mesh(thing.data)
        shape.free()
    bpy.ops.tactile.use_as_indenter()
    thing.tactile.press_by, thing.tactile.force = "FORCE", 0.1
    gel_alone.frame_start, gel_alone.frame_end = 1, 2
    before = len(bpy.data.objects)
    with pytest.raises(RuntimeError, match=expected):
        bpy.ops.tactile.simulate()
    assert len(bpy.data.objects) == before and gel_alone.objects["DIGIT gel"].data.shape_keys is None


def test_there_must_be_an_indenter_and_a_sensor(scene):
    with pytest.raises(RuntimeError, match="no indenter"):
        bpy.ops.tactile.simulate()
    with pytest.raises(RuntimeError, match="no sensor"):
        bpy.ops.tactile.add_indenter(shape="sphere")


def test_heights_have_no_forces_before_they_are_simulated(sensors, tmp_path):
    bpy.ops.tactile.add_indenter(shape="sphere")
    with pytest.raises(RuntimeError, match="Simulate first"):
        _export(tmp_path)


def test_forces_of_an_earlier_motion_are_not_exported(gel_alone, tmp_path):
    bpy.ops.tactile.add_indenter(shape="sphere", radius=3.5)
    ball = bpy.context.object
    gel_alone.render.fps, gel_alone.frame_start, gel_alone.frame_end = 100, 1, 3
    for frame, depth in ((1, 0.0), (3, 0.3)):
        bpy.ops.tactile.snap_to_gel(depth=depth)
        ball.keyframe_insert("location", frame=frame)
    bpy.ops.tactile.simulate()
    ball.parent.location.x += 90
    _export(tmp_path)  # the same press elsewhere
    gel_alone.frame_start = 2
    _export(tmp_path)  # a part of it
    gel_alone.frame_end = 4
    with pytest.raises(RuntimeError, match=r"sphere: .*or they end before"):
        _export(tmp_path)
    gel_alone.frame_end = 3
    gel_alone.frame_set(3)
    bpy.ops.tactile.snap_to_gel(depth=0.6)
    ball.keyframe_insert("location", frame=3)
    with pytest.raises(RuntimeError, match=r"sphere: moved since its forces were found.* Simulate again"):
        _export(tmp_path)


def test_an_unwritable_folder_is_reported(scene, tmp_path):
    bpy.ops.tactile.import_scene(filepath=str(ROOT / "scenes" / "press" / "scene.toml"))
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(RuntimeError, match="cannot be written"):
        bpy.ops.tactile.export_scene(filepath=str(tmp_path / "file" / "scene.toml"))


def test_a_worker_that_dies_is_reported(part, tmp_path):
    jobs, error = part("addon.process.jobs"), part("tactile_core.errors").TactileError
    job = jobs.Job("no such job", tmp_path)
    with pytest.raises(error, match="KeyError"):
        while not job.poll(0.1):
            pass


def test_a_cancelled_worker_is_gone(part, tmp_path):
    jobs = part("addon.process.jobs")
    (tmp_path / "scene.toml").write_text((ROOT / "scenes" / "press" / "scene.toml").read_text())
    job = jobs.Job("simulate", tmp_path, seed=0)
    job.cancel()
    assert job._process.poll() is not None


def _outputs(scene, part):
    return part("addon.operators.simulate")._outputs(part("addon.operators.scene_bridge").sensors_for(scene, None))


def test_an_authored_press_leaves_an_imported_recording_alone(imported, scene, nodes_of):
    skin = imported(frames="70:90")
    bpy.ops.tactile.add_sensor(sensor="DIGIT")
    gel = bpy.context.object
    gel.location = (0, 90, 0)
    _press(scene)
    ball = bpy.context.object
    bpy.context.view_layer.objects.active = skin
    bpy.ops.tactile.translate()
    bpy.ops.tactile.set_up_render()
    recorded = skin, next(thing for thing in skin.users_collection[0].objects if thing.tactile.role == "DIGIT")
    assert scene.camera.parent == recorded[1] != gel
    before = [nodes_of(thing) for thing in recorded]
    bpy.context.view_layer.objects.active = ball
    assert bpy.ops.tactile.simulate() == {"FINISHED"}
    assert ball.parent == gel == scene.objects["sphere simulated"].parent
    bpy.context.view_layer.update()
    assert all((nodes_of(thing) == nodes).all() for thing, nodes in zip(recorded, before, strict=True))
    scene.frame_set(3)
    assert gel["force"][2] == pytest.approx(-0.1, rel=0.05)


def test_an_imported_recording_is_not_pressed_over(imported, scene):
    """Its electrodes, trust and flags stayed, as if they were the simulation's."""
    imported(frames="70:90")
    _press(scene)
    with pytest.raises(RuntimeError, match=r"BioTac skin: plays an imported recording.* Use a scene for each"):
        bpy.ops.tactile.simulate()


def test_a_simulation_keeps_the_frames_it_began_with(gel_alone, part, monkeypatch):
    assert _outputs(gel_alone, part) == ["displacement_digit"]
    _press(gel_alone)
    before = bpy.data.objects.new("sphere simulated", gel_alone.objects["sphere"].data)  # of a simulation before
    gel_alone.collection.objects.link(before)
    before.tactile.role = "TWIN"
    job = part("addon.process.jobs").Job
    wait = job.wait

    def change_meanwhile(self):
        gel_alone.frame_start, gel_alone.frame_end, gel_alone.render.fps = 20, 250, 24
        gel_alone.objects["sphere"].name = "mine"
        wait(self)

    monkeypatch.setattr(job, "wait", change_meanwhile)
    assert bpy.ops.tactile.simulate() == {"FINISHED"}
    gel = gel_alone.objects["DIGIT gel"]
    assert part("addon.objects.motion").played(gel) == (1, 3) and before.name == "mine simulated"
    gel_alone.frame_set(2)
    assert gel["force"][2] == pytest.approx(-0.05, rel=0.05)


def test_a_result_waits_for_the_scene_that_it_is_of(scene, part):
    """As ``modal`` is called by a window's timer."""
    base, said, done = part("addon.operators.job_operator").JobOperator, [], []
    job = SimpleNamespace(poll=lambda: True, share=1.0, stage="Solving")
    operator = SimpleNamespace(_job=job, _scene=scene.session_uid, finish=done.append, cancel=lambda context: None)
    for seen, returned in ((bpy.data.scenes.new("other"), "RUNNING_MODAL"), (scene, "FINISHED")):
        context = SimpleNamespace(
            scene=seen,
            window_manager=bpy.context.window_manager,
            workspace=SimpleNamespace(status_text_set=said.append),
        )
        assert base.modal(operator, context, SimpleNamespace(type="TIMER")) == {returned}
    assert "go back to it" in said[0] and done == [context]


@pytest.fixture(scope="module")
def solved():
    """Files that a worker has written."""
    return {}


@pytest.fixture
def solved_once(part, monkeypatch, solved):
    """Simulate a BioTac's ``_press`` in a worker once for all these tests: what is kept of it is what they look at."""
    operator, job = part("addon.operators.simulate"), part("addon.process.jobs").Job

    def start(kind, folder, **options):
        if not solved:
            job(kind, folder, **options).wait()
            solved.update({name: (folder / name).read_bytes() for name in ("result.npz", "recording.h5")})
        for name, content in solved.items():
            (folder / name).write_bytes(content)
        solved["recording.h5"] += b"."  # another file each time, which HDF5 reads alike
        return SimpleNamespace(wait=lambda: None, cancel=lambda: None)

    monkeypatch.setattr(operator, "Job", start)


@pytest.mark.usefixtures("solved_once")
def test_a_file_that_was_never_saved_keeps_its_recording_until_it_is(scene, part, tmp_path):
    (tmp_path / "copies").mkdir()
    bpy.ops.tactile.add_sensor(sensor="BIOTAC")
    _press(scene)
    skin = scene.objects["BioTac skin"]
    bpy.ops.tactile.simulate()
    assert Path(skin.tactile.recording).is_file()
    bpy.ops.tactile.translate()
    assert part("addon.ui.panels").trust_of(skin, scene.objects["DIGIT gel"])[0]  # whose force is not the simulated one
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "copies" / "press.blend"), copy=True)
    assert Path(skin.tactile.recording).is_file() and (tmp_path / "copies/tactile_simulations/sphere.h5").is_file()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "press.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "press.blend"))
    skin = bpy.context.scene.objects["BioTac skin"]
    assert skin.tactile.recording == "//tactile_simulations/sphere.h5"
    bpy.ops.tactile.translate()


@pytest.mark.usefixtures("solved_once")
def test_each_version_of_a_blend_keeps_its_own_recording(scene, tmp_path):
    """The next simulation replaced the file that an earlier .blend of the folder, or an undo, was translated by."""
    bpy.ops.tactile.add_sensor(sensor="BIOTAC")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "one.blend"))
    skin, kept = scene.objects["BioTac skin"], []
    _press(scene)
    for name in ("one.blend", "two.blend"):
        bpy.ops.tactile.simulate()
        kept.append(Path(bpy.path.abspath(skin.tactile.recording)).read_bytes())
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / name))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "one.blend"))
    skin = bpy.context.scene.objects["BioTac skin"]
    assert kept[0] != kept[1] and Path(bpy.path.abspath(skin.tactile.recording)).read_bytes() == kept[0]


@pytest.mark.usefixtures("solved_once")
def test_a_biotac_alone_is_simulated_without_a_digit(scene, part, tmp_path, capfd):
    """Beside its .blend no folder can be made for the recording, which is then not kept, nor an earlier one's."""
    (tmp_path / "tactile_simulations").touch()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "press.blend"))
    bpy.ops.tactile.add_sensor(sensor="BIOTAC")
    bpy.context.object.tactile.recording = "//earlier.h5"
    assert _outputs(scene, part) == ["electrodes", "displacement_biotac"]
    _press(scene)
    assert bpy.ops.tactile.simulate() == {"FINISHED"}
    scene.frame_set(3)
    skin = scene.objects["BioTac skin"]
    assert np.linalg.norm(skin["force"]) == pytest.approx(0.1, rel=0.05)
    assert "recording to translate is not kept" in capfd.readouterr().out and not skin.tactile.recording


def test_an_indenter_of_a_biotac_alone_presses_a_gel_that_comes_later(scene):
    bpy.ops.tactile.add_sensor(sensor="BIOTAC")
    bpy.ops.tactile.add_indenter(shape="sphere")
    ball = bpy.context.object
    bpy.ops.tactile.add_sensor(sensor="DIGIT")
    bpy.context.view_layer.objects.active = ball
    assert bpy.ops.tactile.snap_to_gel(depth=0.1) == {"FINISHED"}
    assert ball.parent == scene.objects["DIGIT gel"]


def test_a_bound_picks_the_tiers_or_is_refused(scene):
    bpy.ops.tactile.add_sensor(sensor="DIGIT")
    _press(scene)
    scene.tactile_render.error = "500um"  # far above any tier's error
    assert bpy.ops.tactile.simulate() == {"FINISHED"}
    for bound, words in (("0.001um", "reference tier has"), ("much", "5um,0.6levels")):
        scene.tactile_render.error = bound
        with pytest.raises(RuntimeError, match=words):
            bpy.ops.tactile.simulate()


def _press(scene):
    bpy.ops.tactile.add_indenter(shape="sphere", radius=3.5)
    ball = bpy.context.object
    ball.tactile.press_by = "FORCE"
    scene.render.fps, scene.frame_start, scene.frame_end = 100, 1, 3
    for frame, force in ((1, 0.0), (3, 0.1)):
        _key(ball, frame, force=force)


@pytest.mark.parametrize("shape", ["sphere", "box"])
def test_an_indenter_snaps_to_the_gel_and_its_depth_is_read(sensors, part, shape):
    bpy.ops.tactile.add_indenter(shape=shape)
    thing, depth = bpy.context.object, part("addon.operators.snap_to_gel").depth_of
    assert depth(bpy.context, thing) < 0
    for wanted in (0.0, 0.4):
        assert bpy.ops.tactile.snap_to_gel(depth=wanted) == {"FINISHED"}
        # A micrometre: float32 locations of some tens of millimetres.
        assert 1e3 * depth(bpy.context, thing) == pytest.approx(wanted, abs=1e-3)


def test_an_exported_scene_can_be_paired(sensors, part, tmp_path):
    _press(sensors)
    path = _export(tmp_path)
    job, names, _ = part("tactile_core.jobs.pairs").plan(path, 2, 0, tmp_path / "pairs.h5")
    assert names == ["sphere"] and [each.path for each in job.inputs] == [str(path)]
