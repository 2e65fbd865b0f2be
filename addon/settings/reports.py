"""Turn errors of the library into Blender's own error reports, in the words of its buttons."""

from __future__ import annotations

import importlib.util
import re
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import bpy

from ...tactile_core.errors import TactileError

# module -> what it is needed for
MODULES = {
    "h5py": "reading HDF5 recordings",
    "msgspec": "scene files, maps of columns and files of units",
    "rosbags": "ROS bags and MCAP",
    "scipy": "simulating contacts and MATLAB files",
    "trimesh": "meshes as indenters",
    "rtree": "meshes as indenters",
    "mitsuba": "the Mitsuba presets",
    "OpenEXR": "scenes of Mitsuba",
    "threadpoolctl": "simulating contacts",
}
# What errors call by the command line's names -> what Blender calls it; folders of jobs, which the user never sees.
WORDS = (
    (re.escape(tempfile.gettempdir()) + r"[/\\]tactile-\w+[/\\]?", ""),
    (r"tactile info \S+ --columns \S+( writes one( to fill in)?)?", "Columns writes the file that it names"),
    (r"; to try with a recording that ships: tactile scenes copy \S+", ""),
    (r"See `tactile doctor`", "Check LLVM in the add-on's preferences"),
    (r"--(tare|polarity|columns|weights|preset|frames)\b(?!-)", lambda found: found[1].title()),
    (r"--sensor\b", "Unit"),
    (r"--error\b", "Largest Error"),
    (r"--frames-apart\b", "Each Frame Alone"),
    (r"--contacts( 2)?\b", "Two Contacts"),
    (r"--gel: 'ball:(\S+)'", r"Known Ball: \1"),
    (r"translated, solved or ball:MM, |ball:(?=\d)", ""),
    (r"the aspect ratio of \d+ x \d+", lambda found: f"{found[0]}. Set Up Render sets it; the percentage keeps it"),
)  # fmt: skip
ADVICE = "Install the extension's zip for this platform, which brings it"


def in_blender(text: str) -> str:
    """Return a message with the command line's options and advice replaced by what Blender's buttons call them."""
    for pattern, words in WORDS:
        text = re.sub(pattern, words, text)
    return text


def missing(*names: str) -> list[str]:
    """Return those of the modules ``names`` that Blender's Python does not have."""
    return [name for name in names if importlib.util.find_spec(name) is None]


def require(*names: str) -> None:
    """Raise TactileError if Blender's Python lacks one of the modules ``names``; the message names those."""
    lacking = missing(*names)
    if lacking:
        uses = ", ".join(dict.fromkeys(MODULES[name] for name in lacking))
        raise TactileError("Tactile", f"{', '.join(lacking)} missing", f"it for {uses}", ADVICE)


class Refused(Exception):
    """Error raised after an operator has reported why it cannot go on."""


@contextmanager
def reported(operator: bpy.types.Operator) -> Iterator[None]:
    """Turn TactileError, missing modules, and errors of files or disks into an error report, then raise ``Refused``."""
    try:
        yield
    except TactileError as error:
        text = str(error)
    except ModuleNotFoundError as error:
        if error.name not in MODULES:
            raise
        text = f"Tactile: {error.name} missing; expected it for {MODULES[error.name]}. {ADVICE}"
    except OSError as error:
        text = f"{error.filename or 'Tactile'}: cannot be written or read ({error.strerror or error})"
    else:
        return
    text = in_blender(text)
    operator.report({"ERROR"}, text)
    raise Refused(text)


class TactileOperator(bpy.types.Operator):
    """Base of the add-on's operators: ``_work`` does the work, and its errors are reported."""

    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012 (Blender reads plain class attributes)
    bl_translation_context = "Tactile"  # of no dictionary: Blender's own would make Translate to move

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Do the work and report its errors; Blender calls it."""
        try:
            with reported(self):
                return self._work(context) or {"FINISHED"}
        except Refused:
            return {"CANCELLED"}


@contextmanager
def shown(context: bpy.types.Context) -> Iterator[Callable[[float], None]]:
    """Show an operator's progress at the mouse pointer; yield a function to call with the share done, 0 to 1."""
    manager = context.window_manager
    manager.progress_begin(0, 100)
    try:
        yield lambda share: manager.progress_update(round(100 * share))
    finally:
        manager.progress_end()
