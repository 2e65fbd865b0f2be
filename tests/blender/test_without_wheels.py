"""Blender with numpy alone: what the extension promises without its wheels."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import bpy
import pytest

ROOT = Path(__file__).resolve().parents[2]

CODE = """
import os, sys
import bpy, addon_utils
from pathlib import Path
repository = next(r for r in bpy.context.preferences.extensions.repos if r.module == "user_default")
folder = Path(repository.directory)
folder.mkdir(parents=True, exist_ok=True)
(folder / "tactile").symlink_to(os.environ["ROOT"])
name = "bl_ext.user_default.tactile"
try:
    assert addon_utils.enable(name, default_set=True)
    lacking = sys.modules[name + ".addon.settings.reports"].missing("h5py", "scipy", "mitsuba", "msgspec")
    assert lacking == ["h5py", "scipy", "mitsuba", "msgspec"], lacking
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.ops.tactile.import_recording(filepath=os.environ["CSV"])
    bpy.ops.tactile.translate()
    bpy.ops.tactile.live_picture()
    assert bpy.data.images["DIGIT picture"].size[0] == 240
    try:
        bpy.ops.tactile.import_recording(filepath=os.environ["H5"])
    except RuntimeError as error:
        assert "h5py missing" in str(error) and "zip" in str(error), error
    else:
        raise AssertionError("an HDF5 file was read without h5py")
finally:
    addon_utils.disable(name)
print("works")
"""


@pytest.mark.skipif(bool(bpy.app.binary_path), reason="a real Blender's packages cannot be hidden from it")
def test_it_imports_translates_and_draws_with_numpy_alone(tmp_path, slide_csv):
    bare = tmp_path / "bare"
    bare.mkdir()
    for name in ("bpy", "numpy", "numpy.libs"):
        spec = importlib.util.find_spec(name)
        found = Path(spec.origin).parent if spec and spec.origin else Path(bpy.__file__).parent.parent / name
        if found.exists():
            (bare / name).symlink_to(found)
    known = {
        "PYTHONPATH": str(bare), "BLENDER_USER_RESOURCES": str(tmp_path / "user"), "ROOT": str(ROOT),
        "CSV": str(slide_csv()), "H5": str(ROOT / "scenes" / "press_roll_slide" / "press_roll_slide.h5"),
    }  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-S", "-c", CODE], env=os.environ | known, capture_output=True, text=True, timeout=120
    )
    assert "works" in done.stdout, done.stdout + done.stderr
