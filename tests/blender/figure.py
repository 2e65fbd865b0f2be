"""Make the figures of the pages under Cycles: both sensors on paper, and beside them the DIGIT's pictures.

.venv-bpy-4.5.15/bin/python tests/blender/figure.py [NAME ...] [--out FOLDER]  (`scripts/dev.py test-blender` makes it)

NAME: of FIGURES, or "previews", which are the styles' in the Asset Browser; all without one. Each takes less than three
minutes on two cores, with numba.
"""

import argparse
import dataclasses
import os
import sys
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = "bl_ext.user_default.tactile"
RECORDING, FRAMES = ROOT / "scenes" / "press_roll_slide" / "press_roll_slide.h5", "78:82"
SIZE, SAMPLES, QUALITY = (1120, 640), 16, 88
BACK = (150.0, -60.0, 105.0)  # mm, of the camera from the middle of the sensors
LENS, ASIDE, DOWN = 56.0, 0.12, 0.04  # mm of a sensor of 36; shifts of the view, which leave room for pictures, legends
GAP, LETTERS = 1.2, 2.0  # mm at the cards, 100 mm before the camera
INK, METAL = (0.03, 0.03, 0.035), (0.55, 0.56, 0.58)


@dataclasses.dataclass(frozen=True)
class Figure:
    """A contact, and the moments whose pictures are shown: scene frame -> words under its picture.

    scene : folder of the indenter that presses, empty for the shipped recording; poses : x, y (mm) and force (N) of
    each frame from 1 on; newton : mm of an arrow of 1 N; lifted : mm that the body is shown above its print
    """

    pictures: dict[int, str]
    scene: str = ""
    poses: tuple[tuple[float, float, float], ...] = ()
    newton: float = 9.0
    lifted: float = 9.0


FIGURES = {
    "figure": Figure({80: ""}),
    "press": Figure(
        {1: "0.3 N", 2: "1 N", 3: "3 N"}, "press", ((-8.0, 0.0, 0.3), (-8.0, 0.0, 1.0), (-8.0, 0.0, 3.0)), 3.0
    ),
    "slide": Figure(
        {1: "start", 2: "4 mm", 3: "8 mm"}, "slide", ((-12.0, 0.0, 1.5), (-8.0, 0.0, 1.5), (-4.0, 0.0, 1.5)), 6.0, 5.0
    ),
    "hex_nut": Figure(
        {1: "1 N", 2: "3 N", 3: "5 N"}, "hex_nut", ((-8.0, 0.0, 1.0), (-8.0, 0.0, 3.0), (-8.0, 0.0, 5.0)), 2.0
    ),
}
PREVIEWS = {"DISPLACEMENT": "DIGIT", "CONTACT_PATCH": "DIGIT", "ELECTRODES": "BIOTAC", "FORCE_ARROW": "DIGIT"}


def main(arguments: list[str]) -> int:
    """Build the scenes and render them; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", default=[*FIGURES, "previews"])
    parser.add_argument("--out", type=Path, default=ROOT / "docs", help="folder (default: docs)")
    options = parser.parse_args(arguments)
    os.environ["BLENDER_USER_RESOURCES"] = tempfile.mkdtemp(prefix="tactile-figure-")
    os.environ.setdefault("TACTILE_CACHE", str(Path.home() / ".cache" / "tactile"))
    import bpy  # before addon_utils, which it brings; after its user folder is known

    enable(bpy)
    try:
        for name in options.names:
            bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
            if name == "previews":
                previews(bpy)
            else:
                draw(bpy, FIGURES[name], options.out.resolve() / f"blender_{name}.jpg")
    finally:
        sys.modules["addon_utils"].disable(PACKAGE)  # left on at the interpreter's exit, some Blenders hang
    return 0


def enable(bpy: Any) -> None:
    """Switch the extension of this checkout on."""
    import addon_utils

    repository = next(r for r in bpy.context.preferences.extensions.repos if r.module == "user_default")
    linked = Path(repository.directory) / "tactile"
    linked.parent.mkdir(parents=True, exist_ok=True)
    linked.symlink_to(ROOT)
    addon_utils.enable(PACKAGE, default_set=True)


def draw(bpy: Any, figure: Figure, path: Path) -> None:
    """Make the contact and the picture of it."""
    if figure.scene:
        simulated(bpy, figure)
    else:
        translated(bpy)
    bpy.context.scene.frame_set(max(figure.pictures))
    bpy.ops.tactile.set_style(style="DISPLACEMENT")
    bpy.ops.tactile.force_arrow(length=figure.newton)
    shown = pictures(bpy, figure)
    stage(bpy)
    for k, (words, image) in enumerate(zip(figure.pictures.values(), shown, strict=True)):
        card(bpy, k, len(shown), words, image)
    bpy.context.scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)


def previews(bpy: Any) -> None:
    """Draw what an Asset Browser shows of each style, where the extension has it."""
    from mathutils import Vector

    translated(bpy)
    stage(bpy)
    scene = bpy.context.scene
    camera, render = scene.camera, scene.render
    camera.data.shift_x = camera.data.shift_y = 0.0
    render.resolution_x = render.resolution_y = 256
    for style, role in PREVIEWS.items():
        if style == "FORCE_ARROW":
            bpy.ops.tactile.force_arrow(length=9.0)
        bpy.ops.tactile.set_style(style="NONE" if style == "FORCE_ARROW" else style)
        for thing in scene.objects:
            thing.hide_render |= "text" in thing  # a legend
        sensor = next(thing for thing in scene.objects if thing.tactile.role == role)
        camera.location = sensor.location + Vector((-7, 0, 0)) + 0.45 * Vector(BACK)
        render.filepath = str(ROOT / "addon" / "ui" / "previews" / f"{style.lower()}.jpg")
        bpy.ops.render.render(write_still=True)


def translated(bpy: Any) -> None:
    """Import and translate the shipped recording's firmest moment."""
    bpy.ops.tactile.import_recording(filepath=str(RECORDING), frames=FRAMES)
    bpy.ops.tactile.translate()
    bpy.context.scene.frame_set(80)


def simulated(bpy: Any, figure: Figure) -> None:
    """Press a scene's body into both sensors, once a frame."""
    bpy.ops.tactile.import_scene(filepath=str(ROOT / "scenes" / figure.scene / "scene.toml"))
    scene, body = bpy.context.scene, bpy.context.object
    body.animation_data_clear()
    scene.frame_start, scene.frame_end = 1, len(figure.poses)
    for frame, (x, y, force) in enumerate(figure.poses, 1):
        body.location[:2], body.tactile.force = (x, y), force
        body.keyframe_insert("location", frame=frame)
        body.keyframe_insert("tactile.force", frame=frame)
    bpy.ops.tactile.simulate()
    body.hide_render = True


def pictures(bpy: Any, figure: Figure) -> list[Any]:
    """Return the DIGIT's picture at each moment; the bodies that pressed then stand there, the last moment is shown."""
    scene, images, places = bpy.context.scene, [], []
    gel = next(thing for thing in scene.objects if thing.tactile.role == "DIGIT")
    draw = sys.modules[f"{PACKAGE}.addon.operators.pictures"].update  # no window, no live picture
    twin = next((thing for thing in scene.objects if thing.tactile.role == "TWIN"), None)
    for frame in figure.pictures:
        scene.frame_set(frame)
        seen = draw(gel, bpy.context.evaluated_depsgraph_get())
        images.append(bpy.data.images.new(f"Picture {frame}", *seen.size))
        images[-1].pixels = seen.pixels[:]
        if twin is not None:
            places = [other for other in places if (other.translation - twin.matrix_world.translation).xy.length > 1]
            places.append(twin.matrix_world.copy())
    for place in places:
        body = bpy.data.objects.new("Body", twin.data)
        scene.collection.objects.link(body)
        body.matrix_world = place
        body.location.z += figure.lifted
    if twin is not None:
        twin.hide_render = True
        twin.data.shade_smooth()
        twin.data.set_sharp_from_angle(angle=0.5)
        twin.data.materials.clear()
        twin.data.materials.append(bpy.data.materials.new("Body"))
        twin.data.materials[0].use_nodes = True
        shader = next(node for node in twin.data.materials[0].node_tree.nodes if node.type == "BSDF_PRINCIPLED")
        shader.inputs["Base Color"].default_value = (*METAL, 1.0)
        shader.inputs["Metallic"].default_value, shader.inputs["Roughness"].default_value = 1.0, 0.3
    return images


def stage(bpy: Any) -> None:
    """Paper, a soft sun, a camera that looks at the sensors, and Cycles."""
    from mathutils import Vector

    scene = bpy.context.scene
    bpy.ops.mesh.primitive_plane_add(size=4000.0, location=(0, 0, -30.0))
    bpy.context.object.is_shadow_catcher = True
    world = bpy.data.worlds.new("Paper")
    world.use_nodes = True
    paper = world.node_tree.nodes["Background"].inputs
    paper["Color"].default_value, paper["Strength"].default_value = (1, 1, 1, 1), 0.8
    scene.world = world
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.data.angle, sun.rotation_euler = 1.6, 0.3, (0.5, 0.5, 0.0)
    camera = bpy.data.objects.new("Figure", bpy.data.cameras.new("Figure"))
    for thing in (sun, camera):
        scene.collection.objects.link(thing)
    sensors = [thing for thing in scene.objects if thing.tactile.role in ("BIOTAC", "DIGIT")]
    middle = sum((thing.location for thing in sensors), Vector()) / len(sensors) + Vector((-7.5, 0, -4))
    back = Vector(BACK)
    camera.location, camera.rotation_euler = middle + back, back.to_track_quat("Z", "Y").to_euler()
    camera.data.lens, camera.data.clip_end = LENS, 4000.0
    camera.data.shift_x, camera.data.shift_y = ASIDE, -DOWN
    scene.camera, render = camera, scene.render
    render.engine, (render.resolution_x, render.resolution_y) = "CYCLES", SIZE
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.seed = SAMPLES, True, 0
    scene.cycles.denoising_prefilter = "NONE"  # a third of the denoiser's time
    scene.view_settings.view_transform = "Standard"
    render.image_settings.file_format, render.image_settings.quality = "JPEG", QUALITY


def card(bpy: Any, k: int, count: int, words: str, image: Any) -> None:
    """Hang a picture and its words at the right edge of the view, on cards that the camera carries."""
    camera = bpy.context.scene.camera
    wide = 36 / LENS * 100  # of the view at the cards
    high = wide * SIZE[1] / SIZE[0]
    tall = 0.6 * high if count == 1 else 0.94 * high / count - GAP
    right, top = (0.5 + ASIDE) * wide - 0.05 * high, -DOWN * wide + (count * (tall + GAP) - GAP) / 2
    bpy.ops.mesh.primitive_plane_add(size=1.0)
    shown = bpy.context.object
    shown.scale = (0.75 * tall, tall, 1.0)
    middle = top - k * (tall + GAP) - tall / 2
    words_curve = bpy.data.curves.new("Words", "FONT")
    words_curve.body, words_curve.size, words_curve.align_x, words_curve.align_y = words, LETTERS, "RIGHT", "CENTER"
    text = bpy.data.objects.new("Words", words_curve)
    bpy.context.scene.collection.objects.link(text)
    for thing, x in ((shown, right - 0.375 * tall), (text, right - 0.75 * tall - GAP)):
        thing.parent, thing.rotation_euler, thing.location = camera, (0, 0, 0), (x, middle, -100)
        thing.visible_shadow = thing.visible_diffuse = thing.visible_glossy = False
    for thing, source in ((shown, image), (text, None)):
        material = bpy.data.materials.new(thing.name)
        material.use_nodes = True
        nodes, links = material.node_tree.nodes, material.node_tree.links
        nodes.clear()
        glow, out = (nodes.new(f"ShaderNode{kind}") for kind in ("Emission", "OutputMaterial"))
        glow.inputs["Color"].default_value = (*INK, 1.0)
        if source is not None:
            seen = nodes.new("ShaderNodeTexImage")
            seen.image = source
            links.new(seen.outputs["Color"], glow.inputs["Color"])
        links.new(glow.outputs[0], out.inputs["Surface"])
        thing.data.materials.append(material)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
