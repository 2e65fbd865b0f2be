"""Run by a real Blender's window under Xvfb (`fetch_blender.py`): sets one stage up, photographs it, and ends.

STAGE: imported, translated, rendered or authored; OUT: picture to write; ZIP: extension to install
"""

import functools
import os
import shutil
import subprocess
import tempfile
import traceback
from collections.abc import Callable
from pathlib import Path

import bpy

ROOT = Path(__file__).resolve().parents[2]
SHIPPED = ROOT / "scenes" / "press_roll_slide" / "press_roll_slide.h5"
# Where it is imported from: the picture shows the path, which should not be that of a checkout.
RECORDING = Path(tempfile.gettempdir()) / "recordings" / SHIPPED.name
# Where the sidebar's tab "Tactile" is drawn in a window of 1280 x 800: alone, beside a picture, in the workspace.
TABS = {"imported": ("1043", "250"), "authored": ("705", "250")}
IN_WORKSPACE = ("881", "250")
SETTLE = 8.0  # s that software OpenGL takes to draw, beside other programs
BALL, KEYS = 4.0, ((1, -0.5), (6, -0.1), (12, 0.6))  # mm radius; frames and depths, mm, of the authored press


def steps(stage: str) -> list[Callable[[], None]]:
    """What a user would have done, each once the window has drawn what came before."""
    if stage == "authored":
        return [install, author, click]
    done = [install, import_recording]
    if stage in ("translated", "rendered"):
        done += [bpy.ops.tactile.translate, bpy.ops.tactile.open_workspace]
        done.append(colour if stage == "translated" else render)
    return [*done, click]


def install() -> None:
    """The extension, from its zip."""
    bpy.context.preferences.view.show_splash = False
    bpy.ops.extensions.package_install_files(filepath=os.environ["ZIP"], repo="user_default", enable_on_install=True)


def import_recording() -> None:
    """The recording that ships, from the folder of a user."""
    RECORDING.parent.mkdir(exist_ok=True)
    shutil.copyfile(SHIPPED, RECORDING)
    bpy.ops.tactile.import_recording(filepath=str(RECORDING))


def author() -> None:
    """A ball that presses both sensors."""
    for sensor in ("BIOTAC", "DIGIT"):
        bpy.ops.tactile.add_sensor(sensor=sensor)
    bpy.ops.tactile.add_indenter(shape="sphere", radius=BALL)
    ball, scene = bpy.context.object, bpy.context.scene
    scene.frame_end = KEYS[-1][0]
    for frame, depth in KEYS:
        bpy.ops.tactile.snap_to_gel(depth=depth)
        ball.keyframe_insert("location", frame=frame)
    bpy.context.area.spaces.active.show_region_ui = True
    scene.frame_set(scene.frame_end)
    bpy.ops.tactile.simulate()


def colour() -> None:
    """Displacement in colours, force as arrows."""
    bpy.ops.tactile.set_style(style="DISPLACEMENT")
    bpy.ops.tactile.force_arrow()


def render() -> None:
    """By the most usual of Mitsuba's presets, its lights in the panel."""
    bpy.ops.tactile.set_up_render()
    bpy.context.scene.tactile_render.preset = "quality"
    bpy.ops.render.render()
    editor = next(area for area in bpy.context.window.screen.areas if area.type == "IMAGE_EDITOR")
    editor.spaces.active.image = bpy.data.images["Render Result"]


def follow(left: list[Callable[[], None]]) -> None:
    """Take the next step in the window's 3D view, and come back for those that are left; the last one takes a photo."""
    if not left:
        photograph()
    try:
        window = bpy.context.window_manager.windows[0]
        view = next(area for area in window.screen.areas if area.type == "VIEW_3D")
        region = next(region for region in view.regions if region.type == "WINDOW")
        with bpy.context.temp_override(window=window, area=view, region=region):
            left[0]()
    except Exception:
        traceback.print_exc()
        os._exit(1)
    bpy.app.timers.register(functools.partial(follow, left[1:]), first_interval=SETTLE)


def click() -> None:
    """Open the sidebar's tab, which no script can in Blender 4.3; not waited for, as Blender has to take it in."""
    tab = TABS.get(os.environ["STAGE"], IN_WORKSPACE)
    away = ["mousemove", "300", "640"]
    moves = [*away, "key", "Escape", "sleep", "2", "mousemove", *tab, "sleep", "2", "click", "1", "sleep", "1", *away]
    subprocess.Popen(["xdotool", *moves])


def photograph() -> None:
    """bpy.ops.screen.screenshot gives a black picture here (blender.md)."""
    done = subprocess.run(["import", "-window", "root", os.environ["OUT"]], check=False)
    os._exit(done.returncode)  # nothing to save, and some Blenders hang at exit


bpy.app.timers.register(functools.partial(follow, steps(os.environ["STAGE"])), first_interval=3.0)
