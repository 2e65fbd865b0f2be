"""Run by a real Blender's window under Xvfb (`fetch_blender.py`): sets one stage up, photographs it, and ends.

STAGE: imported, translated, rendered or authored; OUT: picture to write; ZIP: extension to install
"""

from __future__ import annotations

import os
import subprocess
import traceback
from pathlib import Path

import bpy

ROOT = Path(__file__).resolve().parents[2]
NAME = "bl_ext.user_default.tactile"
RECORDING = ROOT / "scenes" / "press_roll_slide" / "press_roll_slide.h5"
SCENE = ROOT / "scenes" / "ring" / "scene.toml"
FRAME = {"authored": 95}  # of the ring's firmest press; the recording's is 80
TAB = ("1308", "250")  # where the sidebar's tab "Tactile" is drawn in a window of 1600 x 900
SETTLE = 5.0  # s that software OpenGL takes to draw


def set_up(stage: str) -> None:
    """What a user would have done."""
    bpy.context.preferences.view.show_splash = False
    bpy.ops.extensions.package_install_files(filepath=os.environ["ZIP"], repo="user_default", enable_on_install=True)
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    window = bpy.context.window_manager.windows[0]
    view = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    region = next(region for region in view.regions if region.type == "WINDOW")
    view.spaces.active.show_region_ui = True
    with bpy.context.temp_override(window=window, area=view, region=region):
        if stage == "authored":
            bpy.ops.tactile.import_scene(filepath=str(SCENE))
            bpy.ops.tactile.simulate()
        else:
            bpy.ops.tactile.import_recording(filepath=str(RECORDING))
        if stage in ("translated", "rendered"):
            bpy.ops.tactile.translate()
            _picture(window, stage)
        bpy.context.scene.frame_set(FRAME.get(stage, 80))
        look()


def _picture(window: bpy.types.Window, stage: str) -> None:
    """The picture in an Image Editor; the rendered one by the most usual of Mitsuba's presets."""
    scene = bpy.context.scene
    editor = next(area for area in window.screen.areas if area.type == "OUTLINER")
    editor.type = "IMAGE_EDITOR"
    scene.frame_set(80)
    bpy.ops.tactile.live_picture()
    if stage == "rendered":
        bpy.ops.tactile.set_up_render()
        scene.tactile_render.preset = "quality"
        bpy.ops.render.render()
        editor.spaces.active.image = bpy.data.images["Render Result"]
        properties = next(area for area in window.screen.areas if area.type == "PROPERTIES")
        properties.spaces.active.context = "RENDER"


def look() -> None:
    """From above and the side, at all sensors."""
    for thing in bpy.data.objects:
        thing.select_set(thing.type == "MESH" and thing.tactile.role != "NONE")
    bpy.ops.view3d.view_axis(type="FRONT")
    bpy.ops.view3d.view_orbit(angle=0.8, type="ORBITUP")
    bpy.ops.view3d.view_orbit(angle=0.4, type="ORBITLEFT")
    bpy.ops.view3d.view_selected()
    bpy.ops.object.select_all(action="DESELECT")


def begin() -> None:
    """Once the window stands."""
    try:
        set_up(os.environ["STAGE"])
    except Exception:
        traceback.print_exc()
        os._exit(1)
    bpy.app.timers.register(click, first_interval=SETTLE)


def click() -> None:
    """Close the splash, open the sidebar's tab."""
    moves = ["mousemove", "640", "300", "key", "Escape", "sleep", "2", "mousemove", *TAB, "sleep", "1", "click", "1"]
    # Not waited for: Blender has to take these in one by one.
    subprocess.Popen(["xdotool", *moves, "sleep", "1", "mousemove", "500", "700"])
    bpy.app.timers.register(photograph, first_interval=2 * SETTLE)


def photograph() -> None:
    """bpy.ops.screen.screenshot gives a black picture here (blender.md)."""
    done = subprocess.run(["import", "-window", "root", os.environ["OUT"]], check=False)
    os._exit(done.returncode)  # nothing to save, and some Blenders hang at exit


bpy.app.timers.register(begin, first_interval=3.0)
