"""``blender -b --command tactile VERB ...``: the add-on's jobs without a window."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

import bpy

from ...tactile_core.errors import TactileError
from ...tactile_core.jobs.error_budget import parse_budget
from ...tactile_core.jobs.results import parse_frames
from ...tactile_core.recordings import readers
from ...tactile_core.recordings.opened_file import FOLDER_ENDINGS
from ...tactile_core.recordings.recording import name_of
from ..settings import kept_files, properties

DESCRIPTION = """\
Convert recordings, simulate scenes and render pictures inside Blender, unattended. Each input gets the folder
DIR/<its name>, each finger of a hand one of its own (hand_finger0). An input that fails is named and does not stop the
others; the exit status is then 1."""
EPILOG = """\
examples:
  blender -b --command tactile convert touch.csv --out results       touch.blend: BioTac and DIGIT, animated
  blender -b --command tactile simulate scenes/press --out results   press.blend and its recording
  blender -b --command tactile render results/touch/touch.blend --out pictures
  blender -b --command tactile batch day1 --out results              every recording, scene and .blend of a folder"""


def main(arguments: list[str]) -> int:
    """Run the command whose words follow ``--command tactile``; returns the exit status. Blender calls it."""
    parser = _parser()
    options = parser.parse_args(arguments)
    try:
        parse_budget(options.error or "1um")
    except TactileError as error:
        parser.error(str(error))
    inputs = [Path(name) for name in options.inputs]
    if options.verb == "batch":
        inputs = _found_in(inputs)
    if options.columns is None:  # a map names one finger's columns
        inputs = [finger for path in inputs for finger in _fingers(path)]
    if not inputs:
        print("tactile: error: nothing to do: no recording, scene or .blend there", file=sys.stderr)
        return 1
    failed, made = [], {}
    for path in inputs:
        work = VERBS[options.verb] if options.verb != "batch" else _for(path)
        try:
            folder = _folder(options.out, path)
            first = made.setdefault(str(folder).casefold(), path)  # macOS and Windows fold case in file names
            if first != path:
                advice = "Rename one, or convert them into different --out folders"
                raise TactileError(folder, f"is the result of {first}", "one name for each result folder", advice)
            work(path, folder, options)
            print(folder)
        except (TactileError, RuntimeError, OSError) as error:  # Blender's operators raise RuntimeError
            words = " ".join(str(error).removeprefix("Error: ").split())
            print("tactile: error:", words if str(path) in words else f"{path}: {words}", file=sys.stderr)
            failed.append(path)
    if failed:
        print(f"tactile: {len(failed)} of {len(inputs)} failed: {', '.join(map(str, failed))}", file=sys.stderr)
    return 1 if failed else 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="blender -b --command tactile", description=DESCRIPTION, epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    gels = [name.lower() for name, _, _ in properties.sensor_items(gels_only=True)]
    presets = bpy.context.scene.tactile_render.bl_rna.properties["preset"].enum_items.keys()
    verbs = parser.add_subparsers(dest="verb", metavar="VERB", required=True)
    for name, brief, what in (
        ("convert", "recordings to .blend files with both sensors", "recording, in any layout that is read"),
        ("simulate", "scenes to .blend files and recordings", "scene.toml, or the folder that holds one"),
        ("render", "pictures of every frame", ".blend file, or a recording"),
        ("batch", "all of that for whatever a folder holds", "folder"),
    ):
        verb = verbs.add_parser(name, help=brief, description=brief)
        verb.add_argument("inputs", nargs="+", metavar="INPUT", help=what)
        verb.add_argument("--out", required=True, type=Path, metavar="DIR", help="folder of the results")
        verb.add_argument("--pictures", action="store_true", help="render every frame taken, too")
        verb.add_argument("--preset", choices=presets, default="fast", help="of the pictures (default: fast)")
        verb.add_argument("--error", default="", help="largest error to add: 50um (tier), 0.6levels (preset), or both")
        verb.add_argument("--tare", default="auto", help="of recordings: auto, none or frames A:B")
        verb.add_argument("--polarity", choices=[name for name, _, _ in properties.POLARITIES], default="auto",
                          help="of recordings: what counts do where a film thins")  # fmt: skip
        verb.add_argument(
            "--weights",
            type=Path,
            metavar="FOLDER",
            help="networks, which name the sensor of the recordings (default: those that ship for it)",
        )
        verb.add_argument("--columns", type=Path, metavar="FILE", help="map of the recordings' columns")
        verb.add_argument(
            "--sensor", type=Path, metavar="FILE", help="rest and gains of the unit, from `tactile adapt`"
        )
        verb.add_argument("--frames-apart", action="store_true", help="translate each frame by itself, as of snapshots")
        verb.add_argument("--contacts", type=int, choices=(1, 2), default=1, help="looked for in a frame (default: 1)")
        verb.add_argument("--ball", type=float, default=0.0, metavar="MM", help="known to touch: solved; a plate: 2000")
        verb.add_argument("--to", choices=gels, help="gel of recordings (default: the weights')")
        verb.add_argument("--frames", default=":", help="of recordings, or of a .blend to render: A:B:STEP")
        verb.add_argument("--seed", type=int, default=0, help="of simulated noise")
        verb.add_argument("--overwrite", action="store_true", help="write into result folders that exist")
        verb.set_defaults(verb=name)
    return parser


def _found_in(folders: list[Path]) -> list[Path]:
    found = []
    for folder in folders:
        for path in sorted(folder.iterdir()) if folder.is_dir() else [folder]:
            scene = path.is_dir() and (path / "scene.toml").is_file()
            if scene or path.suffix.lower() in (*FOLDER_ENDINGS, ".blend"):
                found.append(path)
            elif path.is_dir() and path.name not in (kept_files.CACHE, kept_files.SIMULATIONS, "images"):
                print(f"tactile: {path}: a folder, passed over; give it as an input of its own", file=sys.stderr)
    return found


def _fingers(path: Path) -> list[Path]:
    """Return a path for each recording in a file, such as ``hand.mat#1``; the path itself for one, and for none."""
    try:
        return [Path(finger) for finger in readers.list_fingers([path])]
    except ModuleNotFoundError:  # its reader says which
        return [path]


def _folder(out: Path, path: Path) -> Path:
    return out / (path.parent.resolve().name if path.name == "scene.toml" else name_of(path.resolve().as_posix()))


def _claimed(folder: Path, options: argparse.Namespace) -> None:
    """Make the folder of a result; raises TactileError if it holds files, unless they may go."""
    if folder.exists() and any(folder.iterdir()) and not options.overwrite:
        raise TactileError(folder, "already holds something", "a new folder", "Add --overwrite, or another --out")
    folder.mkdir(parents=True, exist_ok=True)


def convert(path: Path, folder: Path, options: argparse.Namespace) -> None:
    """Translate the recording ``path`` and write it as a .blend into a folder. options : of the command line"""
    _refuse(path, options, "seed")
    _fresh()
    words = {
        "tare": options.tare,
        "frames": options.frames,
        "polarity": options.polarity,
        "apart": options.frames_apart,
        "two": options.contacts == 2,
        "ball": options.ball,
    }
    files = {"weights": options.weights, "columns": options.columns, "unit": options.sensor}
    words |= {name: str(file.resolve()) for name, file in files.items() if file is not None}
    bpy.ops.tactile.import_recording(filepath=path.resolve().as_posix(), **words)  # a topic keeps its slashes
    bpy.ops.tactile.translate(**({} if options.to is None else {"to": options.to.upper()}))
    _claimed(folder, options)
    _finish(folder, options)


def simulate(path: Path, folder: Path, options: argparse.Namespace) -> None:
    """Simulate the scene.toml ``path``, or that of the folder ``path``, and write it as a .blend into a folder, its
    recording beside it. options : of the command line"""
    file = path / "scene.toml" if path.is_dir() else path
    frames = parse_frames(options.frames)  # of its pictures a step can be taken
    _refuse(path, options, *OF_RECORDINGS, *["frames"] * (frames.start is not None or frames.stop is not None))
    _fresh()
    bpy.ops.tactile.import_scene(filepath=str(file.resolve()))
    _claimed(folder, options)
    _save(folder)
    bpy.context.scene.tactile_render.error = options.error
    bpy.ops.tactile.simulate(seed=options.seed)
    _finish(folder, options)


def render(path: Path, folder: Path, options: argparse.Namespace) -> None:
    """Render pictures of the .blend or recording ``path`` into a folder, by the command line's options."""
    if path.suffix.lower() != ".blend":
        options.pictures = True
        convert(path, folder, options)
        return
    if not path.is_file():
        raise TactileError(path, "there is no such file", "a .blend", "Check the path")
    _refuse(path, options, *OF_RECORDINGS, "seed")
    bpy.ops.wm.open_mainfile(filepath=str(path.resolve()))
    bpy.context.view_layer.objects.active = None  # F12 renders the camera's gel, not the active one's
    _choose(options.frames)
    _claimed(folder, options)
    _pictures(folder, options)


def _choose(text: str) -> None:
    """Limit the opened scene to frames A:B, by Blender's numbers, which are the recording's. Raises TactileError if it
    plays none of them."""
    scene, frames = bpy.context.scene, parse_frames(text)
    if frames.start is None and frames.stop is None:
        return
    chosen = [each for each in range(scene.frame_end + 1)[frames.start : frames.stop] if each >= scene.frame_start]
    if not chosen:
        expected = f"some of {scene.frame_start} to {scene.frame_end}, which the scene plays"
        raise TactileError("--frames", f"{text} takes none", expected, "Widen it")
    scene.frame_start, scene.frame_end = chosen[0], chosen[-1]


def _refuse(path: Path, options: argparse.Namespace, *names: str) -> None:
    """Raise TactileError for an option of ``names`` that was given: nothing is done to ``path`` by it. A batch may hold
    others that take it."""
    usual = _parser().parse_args([options.verb, "-", "--out", "-"])
    for name in names if options.verb != "batch" else ():
        if getattr(options, name) != getattr(usual, name):
            found = f"given for {path}, to which it does nothing"
            raise TactileError(f"--{name.replace('_', '-')}", found, "an input that takes it", "Leave it out")


def _for(path: Path) -> Callable:
    if path.suffix.lower() == ".blend":
        return render
    return simulate if path.is_dir() or path.suffix.lower() == ".toml" else convert


def _fresh() -> None:
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)


def _finish(folder: Path, options: argparse.Namespace) -> None:
    bpy.ops.tactile.set_up_render()
    bpy.context.scene.tactile_render.preset, bpy.context.scene.tactile_render.error = options.preset, options.error
    bpy.context.scene.render.filepath = "//images/"
    _save(folder)
    if options.pictures:
        _pictures(folder, options)


def _save(folder: Path) -> None:
    """Save the folder's .blend, without a copy of the one before."""
    files = bpy.context.preferences.filepaths
    copies, files.save_version = files.save_version, 0
    bpy.ops.wm.save_as_mainfile(filepath=str((folder / f"{folder.name}.blend").resolve()))
    files.save_version = copies


def _pictures(folder: Path, options: argparse.Namespace) -> None:
    scene = bpy.context.scene
    bpy.ops.tactile.set_up_render()
    scene.tactile_render.preset, scene.tactile_render.error = options.preset, options.error
    scene.render.filepath, scene.render.use_overwrite = str((folder / "images").resolve()) + "/", True
    if step := parse_frames(options.frames).step:  # between two frames that were taken Blender interpolates
        scene.frame_step = step
    bpy.ops.render.render(animation=True)


OF_RECORDINGS = "tare", "polarity", "weights", "columns", "sensor", "frames_apart", "contacts", "ball", "to"
VERBS = {"convert": convert, "simulate": simulate, "render": render}
_command = None


def register() -> None:
    """Register what this file declares; the package calls it."""
    global _command
    _command = bpy.utils.register_cli_command("tactile", main)


def unregister() -> None:
    """Take back what `register` did; the package calls it."""
    bpy.utils.unregister_cli_command(_command)
