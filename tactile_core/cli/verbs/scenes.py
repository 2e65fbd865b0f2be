"""``tactile scenes``: copy the example scenes that ship to where the pages' examples look for them."""

from __future__ import annotations

import argparse
from shlex import quote
from typing import TYPE_CHECKING

from ...errors import TactileError
from ..terminal import next_step, tell

if TYPE_CHECKING:
    from pathlib import Path

BRIEF = "list or copy the example scenes and other example files"
TEXT = """\
List the example scenes and other example files that ship, or copy them (all, or those named) into the folder scenes,
where the examples of every page look for them. An example that is there already is not overwritten, but refused."""
EPILOG = """\
examples:
  tactile scenes
  tactile scenes copy                      all of them, into the folder scenes
  tactile scenes copy press --out mine     one, as mine/press"""


def arguments(verb: argparse.ArgumentParser) -> None:
    """Add the arguments of this verb."""
    verb.add_argument("action", nargs="?", choices=("list", "copy"), default="list", help="default: list")
    verb.add_argument("names", nargs="*", metavar="NAME", help="what to copy (default: all)")
    verb.add_argument("--out", default="scenes", metavar="FOLDER", help="where they are copied to (default: scenes)")


def run(options: argparse.Namespace) -> int:
    """List the example scenes, or copy them; returns the exit status."""
    from ...files import example_scenes

    if options.action == "list":
        if options.names:
            raise TactileError("scenes list", f"given {options.names[0]!r}", "no NAME", "NAME is for `copy`")
        for line in example_scenes.described():
            tell(line)
        return 0
    copied = example_scenes.copy(options.names, options.out)
    for folder in copied:
        tell(str(folder))
    if following := _following(copied):
        next_step(following)
    return 0


def _following(copied: list[Path]) -> str:
    """Return a command that tries what was copied: a recording, or else a scene; "" if it was neither."""
    for recording in (folder / f"{folder.name}.h5" for folder in copied):
        if recording.is_file():
            return f"tactile convert {quote(str(recording))} --out results"
    for folder in copied:
        if (folder / "scene.toml").is_file():
            return f"tactile simulate {quote(str(folder))} --out scene.h5 --plan"
    return ""
