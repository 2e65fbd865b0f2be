"""Write an example .blend: the recording of this folder imported, translated, coloured and ready to be rendered.

    blender -b --python scenes/press_roll_slide/make_blend.py -- example.blend

In a Blender that has the extension; the file plays without it.
"""

import sys
from pathlib import Path

import bpy

RECORDING = Path(__file__).resolve().parent / "press_roll_slide.h5"


def write(path: Path) -> None:
    """Build the scene from an empty file and save it. Raises RuntimeError in the words of the operator that fails."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.ops.tactile.import_recording(filepath=str(RECORDING))
    bpy.ops.tactile.translate()
    bpy.ops.tactile.set_style(style="DISPLACEMENT")
    bpy.ops.tactile.force_arrow()
    bpy.ops.tactile.set_up_render()
    bpy.ops.wm.save_as_mainfile(filepath=str(path.resolve()), compress=True)


if __name__ == "__main__":
    write(Path(sys.argv[sys.argv.index("--") + 1] if "--" in sys.argv else "example.blend"))
