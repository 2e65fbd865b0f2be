"""The zip that users install: its listing, Blender's own check of it, and the whole job from the installed copy."""

import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import bpy
import pytest
from by_path import module_at

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def builder():
    if not (ROOT / ".git").exists() or shutil.which("git") is None:
        pytest.skip("the zip is made of what git tracks, and this is no checkout, or git is not here")
    return module_at(ROOT / "scripts" / "build_extension.py")


@pytest.fixture(scope="module")
def packed(builder, tmp_path_factory):
    return builder.build(tmp_path_factory.mktemp("dist"), None, "3.11", [])


def test_the_listing_is_what_git_tracks(builder, packed):
    with zipfile.ZipFile(packed) as file:
        names = file.namelist()
    assert names == builder.tracked()
    for needed in (
        "__init__.py",
        "blender_manifest.toml",
        "LICENSE",
        "addon/ui/panels.py",
        "tactile_core/data/weights/MVB.safetensors",
    ):
        assert needed in names
    assert not [name for name in names if "torch" in name or name.startswith(("tests/", "scripts/"))]
    assert [name for name in names if name.startswith("tactile_core/training/")] == list(builder.KEPT)


def test_the_command_line_starts_from_what_was_packed(packed, tmp_path):
    with zipfile.ZipFile(packed) as file:
        file.extractall(tmp_path)
    command = [sys.executable, "-P", "-m", "tactile_core", "train", "--help"]
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr


def test_the_same_checkout_gives_the_same_bytes(builder, packed, tmp_path):
    assert builder.build(tmp_path, None, "3.11", []).read_bytes() == packed.read_bytes()


def test_wheels_are_named_in_the_manifest(builder, tmp_path):
    wheel = tmp_path / "h5py-3.16.0-cp311-cp311-manylinux_2_28_x86_64.whl"
    wheel.write_bytes(b"a wheel")
    path = builder.build(tmp_path, "linux-x64", "3.11", [wheel])
    assert path.name.endswith("-linux-x64-py3.11.zip")
    with zipfile.ZipFile(path) as file:
        assert file.read(f"wheels/{wheel.name}") == b"a wheel"
        text = file.read("blender_manifest.toml").decode()
    assert f'"./wheels/{wheel.name}"' in text and 'platforms = ["linux-x64"]' in text


@pytest.mark.parametrize(("python", "debian", "bounds"), [
    ("3.11", False, ("4.2.0", "5.1.0")), ("3.13", False, ("5.1.0", None)),
    ("3.13", True, ("4.2.0", None)), ("3.14", True, ("4.2.0", None)),
])  # fmt: skip
def test_a_zip_is_for_the_blenders_that_have_its_python(builder, python, debian, bounds):
    told = tomllib.loads(builder.manifest("linux-x64", python, [], debian))
    assert (told["blender_version_min"], told.get("blender_version_max")) == bounds


def test_the_manifest_keeps_the_platform_s_rules(builder):
    told = tomllib.loads(builder.manifest(None, "3.11", [], False))
    assert "Blender" not in told["name"]
    for words in (told["tagline"], *told["permissions"].values()):
        assert len(words) <= 64 and words[-1].isalnum()
    assert set(told["permissions"]) == {"files"}  # no part of the add-on opens a connection, the clipboard or a camera


def test_every_wheel_has_a_version(builder):
    for platform in builder.PLATFORMS:
        assert all("==" in line for line in builder.requirements("3.11", platform))
    assert not {"torch", "numpy"} & set(builder.WHEELS)


@pytest.mark.parametrize("program", ["the wheel's", "blender"])
def test_blender_s_own_check_passes(packed, program):
    checker = Path(bpy.utils.system_resource("SCRIPTS")) / "addons_core" / "bl_pkg" / "cli" / "blender_ext.py"
    command = [sys.executable, str(checker)]
    if program == "blender":
        found = bpy.app.binary_path or shutil.which("blender")
        if not found:
            pytest.skip("no blender executable here: the wheel's own check alone")
        said = subprocess.run([found, "--version"], capture_output=True, text=True, timeout=60).stdout
        version = re.search(r"Blender (\d+)\.(\d+)", said)  # none where it does not start, as beside another's Python
        if not version or (int(version[1]), int(version[2])) < (4, 2):
            pytest.skip(f"{found} knows no extensions: the wheel's own check alone")
        command = [found, "--background", "--factory-startup", "--command", "extension"]
    done = subprocess.run([*command, "validate", str(packed)], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_installed_copy_does_the_whole_job(packed, tmp_path, slide_csv, works_elsewhere):
    code = f"""
import sys
import bpy, addon_utils
bpy.ops.extensions.package_install_files(filepath={str(packed)!r}, repo="user_default", enable_on_install=True)
name = "bl_ext.user_default.tactile"
try:
    assert name in bpy.context.preferences.addons, list(bpy.context.preferences.addons.keys())
    assert {str(tmp_path)!r} in sys.modules[name].__file__
    bpy.ops.tactile.import_recording(filepath={str(slide_csv())!r})
    bpy.ops.tactile.translate()
    assert bpy.data.images["DIGIT picture"].size[1] == 320
finally:
    addon_utils.disable(name)
print("works")
"""
    works_elsewhere(code, BLENDER_USER_RESOURCES=str(tmp_path / "user"))


@pytest.mark.skipif(
    not (bpy.app.binary_path and os.environ.get("TACTILE_ZIP")), reason="needs a real Blender and a zip"
)
def test_a_real_blender_installs_the_zip_by_command(tmp_path):
    environment = os.environ | {"BLENDER_USER_RESOURCES": str(tmp_path / "user")}
    command = [bpy.app.binary_path, "--background", "--command", "extension", "install-file", "--repo", "user_default"]
    done = subprocess.run(
        [*command, "--enable", os.environ["TACTILE_ZIP"]], env=environment, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "user" / "extensions" / "user_default" / "tactile" / "blender_manifest.toml").is_file()
