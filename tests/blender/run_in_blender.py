"""Started by a real Blender (`scripts/dev.py test-blender --binary PATH`): runs these tests in it.

TACTILE_SITE: the folder that holds pytest, which no Blender brings; TACTILE_ZIP: the extension to install.
"""

import os
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent


def main() -> int:
    """pytest's status."""
    sys.path.insert(0, os.environ["TACTILE_SITE"])
    import pytest

    arguments = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
    os.chdir(HERE.parents[1])
    return int(pytest.main(["-p", "no:cacheprovider", str(HERE), *arguments]))


if "BLENDER_USER_RESOURCES" not in os.environ:
    # Too late for this process: Blender has read its folders. Start it again with a user folder of its own.
    import subprocess

    import bpy

    with tempfile.TemporaryDirectory(prefix="tactile-blender-") as folder:
        known = os.environ | {"BLENDER_USER_RESOURCES": folder}
        os._exit(subprocess.call([bpy.app.binary_path, *sys.argv[1:]], env=known))
sys.exit(main())
