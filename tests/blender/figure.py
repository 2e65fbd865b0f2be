"""Make the figure that opens docs/blender.md: both sensors under Cycles, displacement in colours, the picture inset.

    .venv-bpy-4.5.15/bin/python tests/blender/figure.py [--out FILE.jpg] [--blend FILE.blend]

In the bpy wheel's environment (`scripts/dev.py test-blender` makes one), from the shipped recording; the .blend is
the scene it renders, as a user would have built it with the extension's operators.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
RECORDING = ROOT / "scenes" / "press_roll_slide" / "press_roll_slide.h5"
PACKAGE = "bl_ext.user_default.tactile"
FRAMES, FRAME = "60:100", 80  # of the recording: a press, and its firmest moment
SIZE, SAMPLES = (1400, 620), 24
INK = (0.02, 0.02, 0.02, 1.0)  # of legends, on paper


def main(arguments: list[str]) -> int:
    """Build the scene and render it; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "blender_figure.jpg")
    parser.add_argument("--blend", type=Path, help="keep the scene here too")
    options = parser.parse_args(arguments)
    os.environ["BLENDER_USER_RESOURCES"] = tempfile.mkdtemp(prefix="tactile-figure-")
    import bpy  # before addon_utils, which it brings; after its user folder is known

    enable(bpy)
    build(bpy)
    if options.blend:
        bpy.ops.wm.save_as_mainfile(filepath=str(options.blend.resolve()))
    bpy.context.scene.render.filepath = str(options.out.resolve())
    bpy.ops.render.render(write_still=True)
    sys.modules["addon_utils"].disable(PACKAGE)  # left on at the interpreter's exit, some Blenders hang
    return 0


def enable(bpy) -> None:
    """Switch the extension of this checkout on."""
    import addon_utils

    repository = next(r for r in bpy.context.preferences.extensions.repos if r.module == "user_default")
    linked = Path(repository.directory) / "tactile"
    linked.parent.mkdir(parents=True, exist_ok=True)
    linked.symlink_to(ROOT)
    addon_utils.enable(PACKAGE, default_set=True)


def build(bpy) -> None:
    """Import, translate, colour; then camera, light and the inset."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    bpy.ops.tactile.import_recording(filepath=str(RECORDING), frames=FRAMES)
    bpy.ops.tactile.translate()
    scene.frame_set(FRAME)
    bpy.ops.tactile.set_style(style="DISPLACEMENT")
    bpy.ops.tactile.force_arrow(length=11.0)
    for thing in scene.objects:
        if thing.tactile.role == "LEGEND" and "text" in thing:
            _darken(thing)
            thing.location.x += 9.0  # clear of the housing, seen from above
    gel = next(thing for thing in scene.objects if thing.tactile.role == "DIGIT")
    _inset(bpy, gel)
    _stage(bpy)


def _darken(legend) -> None:
    """Dark letters in place of light ones; the colour bar stays."""
    colours = legend.data.color_attributes["Tactile colour"].data
    for each in colours:
        if min(each.color[:3]) > 0.9:
            each.color = INK


def _inset(bpy, gel) -> None:
    """The DIGIT's picture on a card beside its housing, three quarters as wide as it is high."""
    image = bpy.data.images["DIGIT picture"]
    bpy.ops.mesh.primitive_plane_add(size=1.0)
    card = bpy.context.object
    card.name, card.scale = "Picture", (24.0, 32.0, 1.0)
    card.location = (-8.0, gel.location.y + 42.0, 2.5)
    card.rotation_euler = (1.2, 0.0, 1.5)
    material = bpy.data.materials.new("Picture")
    if material.node_tree is None:
        material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    shown, glow, out = (nodes.new(f"ShaderNode{kind}") for kind in ("TexImage", "Emission", "OutputMaterial"))
    shown.image = image
    links.new(shown.outputs["Color"], glow.inputs["Color"])
    links.new(glow.outputs[0], out.inputs["Surface"])
    card.data.materials.append(material)


def _stage(bpy) -> None:
    """Paper, a soft sun, a camera that looks at the sensors' bases from above, and Cycles."""
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_plane_add(size=2000.0, location=(0, 0, -14.0))
    bpy.context.object.is_shadow_catcher = True
    world = bpy.data.worlds.new("Paper")
    if world.node_tree is None:
        world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (1, 1, 1, 1)
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.7
    scene.world = world
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.data.angle, sun.rotation_euler = 1.2, 0.3, (0.5, 0.5, 0.0)
    scene.collection.objects.link(sun)
    camera = bpy.data.objects.new("Figure", bpy.data.cameras.new("Figure"))
    scene.collection.objects.link(camera)
    aim = bpy.data.objects.new("Aim", None)
    aim.location = (0.0, 37.0, -1.0)
    scene.collection.objects.link(aim)
    camera.location, camera.data.lens, camera.data.clip_end = (180.0, 5.0, 115.0), 66.0, 4000.0
    follow = camera.constraints.new("TRACK_TO")
    follow.target = aim
    scene.camera, render = camera, scene.render
    render.engine, (render.resolution_x, render.resolution_y) = "CYCLES", SIZE
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.seed = SAMPLES, True, 0
    scene.view_settings.view_transform = "Standard"
    render.image_settings.file_format, render.image_settings.quality = "JPEG", 90


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
