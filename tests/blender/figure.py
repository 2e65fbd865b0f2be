"""Make the figure that opens docs/blender.md: the shipped recording on both sensors under Cycles, the picture inset.

.venv-bpy-4.5.15/bin/python tests/blender/figure.py [--out FILE.jpg]     (`scripts/dev.py test-blender` makes it)
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = "bl_ext.user_default.tactile"
RECORDING, FRAMES, FRAME = ROOT / "scenes" / "press_roll_slide" / "press_roll_slide.h5", "78:82", 80  # a firm press
SIZE, SAMPLES = (800, 430), 4
PLACE = (150.0, -60.0, 105.0)  # mm, of the camera from the middle of the sensors
LENS, ASIDE, DOWN = 54.0, 0.18, 0.05  # mm of a sensor of 36; shifts of the view, which leave room for card and legends


def recorded(bpy: Any) -> None:
    """The shipped recording's firmest moment, on the BioTac and translated to the DIGIT."""
    bpy.ops.tactile.import_recording(filepath=str(RECORDING), frames=FRAMES)
    bpy.ops.tactile.translate()
    bpy.context.scene.frame_set(FRAME)
    bpy.ops.tactile.set_style(style="DISPLACEMENT")
    bpy.ops.tactile.force_arrow(length=9.0)


def main(arguments: list[str]) -> int:
    """Build the scene and render it; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "blender_figure.jpg")
    options = parser.parse_args(arguments)
    os.environ["BLENDER_USER_RESOURCES"] = tempfile.mkdtemp(prefix="tactile-figure-")
    os.environ.setdefault("TACTILE_CACHE", str(Path.home() / ".cache" / "tactile"))
    import bpy  # before addon_utils, which it brings; after its user folder is known

    enable(bpy)
    try:
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        recorded(bpy)
        stage(bpy)
        bpy.context.scene.render.filepath = str(options.out.resolve())
        bpy.ops.render.render(write_still=True)
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


def stage(bpy: Any) -> None:
    """Paper, a soft sun, a camera that looks at the sensors, their picture as an inset, and Cycles."""
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
    back = Vector(PLACE)
    camera.location, camera.rotation_euler = middle + back, back.to_track_quat("Z", "Y").to_euler()
    camera.data.lens, camera.data.clip_end = LENS, 4000.0
    camera.data.shift_x, camera.data.shift_y = ASIDE, -DOWN
    scene.camera, render = camera, scene.render
    picture(bpy, camera)
    render.engine, (render.resolution_x, render.resolution_y) = "CYCLES", SIZE
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.seed = SAMPLES, True, 0
    scene.view_settings.view_transform = "Standard"
    render.image_settings.file_format, render.image_settings.quality = "JPEG", 88


def picture(bpy: Any, camera: Any) -> None:
    """The DIGIT's picture on a card that the camera carries at its right edge."""
    bpy.ops.mesh.primitive_plane_add(size=1.0)
    card = bpy.context.object
    wide = 36 / LENS * 100  # of the view at the card
    high = wide * SIZE[1] / SIZE[0]
    card.scale = (0.45 * high, 0.6 * high, 1.0)
    card.parent, card.rotation_euler = camera, (0, 0, 0)
    card.location = ((0.5 + ASIDE) * wide - 0.08 * high - card.scale.x / 2, -DOWN * wide, -100)
    card.visible_shadow = card.visible_diffuse = False
    material = bpy.data.materials.new("Picture")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    shown, glow, out = (nodes.new(f"ShaderNode{kind}") for kind in ("TexImage", "Emission", "OutputMaterial"))
    shown.image = bpy.data.images["DIGIT picture"]
    links.new(shown.outputs["Color"], glow.inputs["Color"])
    links.new(glow.outputs[0], out.inputs["Surface"])
    card.data.materials.append(material)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
