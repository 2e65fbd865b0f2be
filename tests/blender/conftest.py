"""The extension under test inside Blender (the bpy wheel, or a real one): enabled once, a fresh scene for each test."""

import importlib.util
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

ROOT = Path(__file__).resolve().parents[2]
RECORDING = ROOT / "scenes" / "press_roll_slide" / "press_roll_slide.h5"
PACKAGE = "bl_ext.user_default.tactile"

HERE = "bpy" in sys.modules or importlib.util.find_spec("bpy") is not None
collect_ignore_glob = [] if HERE else ["test_*.py"]

if HERE and "bpy" not in sys.modules:
    # A user folder of its own, before Blender starts: the tests neither see nor change the developer's settings.
    os.environ["BLENDER_USER_RESOURCES"] = tempfile.mkdtemp(prefix="tactile-blender-")
# What takes minutes to compute is kept between runs, as the command line does.
os.environ.setdefault("TACTILE_CACHE", str(Path.home() / ".cache" / "tactile"))


@pytest.fixture(scope="session", autouse=True)
def extension() -> Iterator[ModuleType]:
    """The add-on, installed from the zip in TACTILE_ZIP or linked from the checkout, and switched off at the end.

    Left on at the interpreter's exit, bpy 4.2 crashes and 4.5 hangs (blender.md).
    """
    import addon_utils
    import bpy

    packed = os.environ.get("TACTILE_ZIP")
    if packed:
        bpy.ops.extensions.package_install_files(filepath=packed, repo="user_default", enable_on_install=True)
    else:
        repository = next(r for r in bpy.context.preferences.extensions.repos if r.module == "user_default")
        linked = Path(repository.directory) / "tactile"
        linked.parent.mkdir(parents=True, exist_ok=True)
        if not linked.exists():
            linked.symlink_to(ROOT)
    try:
        assert addon_utils.enable(PACKAGE, default_set=True) is not None
        yield sys.modules[PACKAGE]
    finally:
        addon_utils.disable(PACKAGE)


@pytest.fixture(autouse=True)
def scene(extension: ModuleType):
    """An empty scene; the add-on stays on."""
    import bpy

    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    if bpy.context.scene is None:
        pytest.fail("Blender gave no scene")
    return bpy.context.scene


@pytest.fixture
def part(extension: ModuleType):
    """``part("addon.objects.axes")``: a module of the extension as Blender imported it."""
    return lambda name: importlib.import_module(f"{PACKAGE}.{name}")


@pytest.fixture
def needs(extension: ModuleType):
    """``needs("h5py")``: skips a test where a package is missing; imports none, as h5py's own does not work in each."""

    def check(*names):
        for name in names:
            if importlib.util.find_spec(name) is None:
                pytest.skip(f"{name} is missing")

    return check


@pytest.fixture
def imported(scene):
    """``imported(motion="MESH_CACHE")``: the shipped recording's frames 40 to 140, as the skin object."""
    import bpy

    def run(**options):
        options = {"filepath": str(RECORDING), "frames": "40:140"} | options
        assert bpy.ops.tactile.import_recording(**options) == {"FINISHED"}
        return bpy.context.object

    return run


@pytest.fixture(scope="session")
def opened(tmp_path_factory):
    """``opened("name", make)``: the scene that ``make`` makes, which is opened in a tenth of the time from then on.

    As File > New does it: to Blender the file was never saved.
    """
    import bpy

    folder = tmp_path_factory.mktemp("opened")

    def run(name, make):
        file = folder / f"{name}.blend"
        if not file.exists():
            make()
            bpy.ops.wm.save_as_mainfile(filepath=str(file), copy=True)
        bpy.ops.wm.read_homefile(filepath=str(file))
        return bpy.context.scene

    return run


@pytest.fixture
def translated(imported, opened):
    """``translated("40:140")``: the gel translated from those frames of the shipped recording, on frame 80."""
    import bpy

    def run(frames):
        def make():
            imported(frames=frames)
            assert bpy.ops.tactile.translate() == {"FINISHED"}
            bpy.context.scene.frame_set(80)

        return opened(f"translated {frames}".replace(":", " "), make).objects["DIGIT gel"]

    return run


@pytest.fixture
def pressed_gel(translated):
    """The gel of frames 70 to 90."""
    return translated("70:90")


@pytest.fixture
def draw(part):
    """``draw(gel)``: its picture (H, W, 3) float as the scene is now."""
    import bpy

    def run(gel, preset="fast"):
        bpy.context.view_layer.update()
        depsgraph = bpy.context.evaluated_depsgraph_get()
        return part("addon.operators.pictures").draw(gel, depsgraph, preset)[0].astype(float)

    return run


@pytest.fixture
def works_elsewhere():
    """``works_elsewhere(code)``: it prints "works" in another Blender like this one, without extensions."""
    import bpy

    def run(code, **environment):
        options = ["--background", "--factory-startup", "--python-exit-code", "1", "--python-expr"]
        command = [bpy.app.binary_path, *options] if bpy.app.binary_path else [sys.executable, "-c"]
        known = os.environ | environment
        done = subprocess.run([*command, code], env=known, capture_output=True, text=True, timeout=120)
        assert "works" in done.stdout, done.stdout + done.stderr

    return run


@pytest.fixture
def loaded(part):
    """``loaded("40:140")``: those frames of the shipped recording as the extension translates them."""

    def run(frames="40:140"):
        files = {"weights": "", "columns": "", "unit": ""}
        asked = SimpleNamespace(tare="auto", polarity="auto", frames=frames, apart=False, two=False, **files)
        load = part("addon.operators.recording_data").load
        return load(str(RECORDING), asked, lambda share: None, "SHAPE_KEYS", 1000.0)

    return run


@pytest.fixture
def nodes_of():
    """``nodes_of(object)``: the vertices (n, 3) that Blender shows on the current frame, in the object's units."""
    import bpy
    import numpy as np

    def read(thing):
        vertices = thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.vertices
        nodes = np.empty(len(vertices) * 3, np.float32)
        vertices.foreach_get("co", nodes)
        return nodes.reshape(-1, 3)

    return read
