"""Scenes: TOML files that say what presses where. Units are in the fields' names; unknown fields are refused."""

from __future__ import annotations

import json
import os
import pathlib
from typing import Annotated, Any

import msgspec
import numpy as np
from msgspec import Meta

from ..errors import TactileError
from ..files import atomic
from ..files.outside import read_toml_text
from ..mechanics.placement import FRICTION, MOST_FRICTION
from .indenter_specs import IndenterSpec, NotNegative, Positive, with_files_of

FORMAT = "tactile-scene-1"
Friction = Annotated[float, Meta(ge=0, le=MOST_FRICTION)]  # Coulomb's coefficient
LARGEST = 1e9  # of any number: none that means something comes near, squares of far larger ones are infinite (assumed)


class PairSpec(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Distribution of paired contacts. Places are uniform over the gel without a rim, rim_margin_mm wide; tilts are
    uniform in a cone up to tilt_max_deg off the normal. Force grows from force_min_n, each time by force_ratio, until
    depth is depth_max_percent of the thickness. If depth_steps is not 0, depth grows instead, in so many even steps
    from depth_min_mm to depth_max_mm.
    friction : Coulomb's; slide_share, slide_max_mm : share of presses that end with a slide, and its greatest length
    random_bodies : share of presses by a body drawn at random"""

    force_min_n: Positive = 0.02
    force_ratio: Annotated[float, Meta(ge=1.05, le=100)] = 1.5
    tilt_max_deg: Annotated[float, Meta(ge=0, le=45)] = 20.0
    rim_margin_mm: Annotated[float, Meta(ge=0, le=8)] = 1.0
    depth_max_percent: Annotated[float, Meta(gt=0, le=60)] = 60.0  # of the thickness under the first touch
    friction: Friction = FRICTION
    slide_share: Annotated[float, Meta(ge=0, le=1)] = 0.0  # of the presses end with a slide at constant force
    slide_max_mm: Annotated[float, Meta(ge=0, le=3)] = 0.0  # slides are evenly long up to this
    random_bodies: Annotated[float, Meta(ge=0, le=1)] = 0.0  # of the presses are of a body drawn for each
    depth_steps: Annotated[int, Meta(ge=0, le=100)] = 0  # contacts per press, paired by depth; 0: paired by force
    depth_min_mm: Annotated[float, Meta(gt=0, le=3)] = 0.05
    depth_max_mm: Annotated[float, Meta(gt=0, le=3)] = 1.2


class PointSpec(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """A point of a recorded motion: time_s; x_mm, z_mm, the indenter's place on the gel's (unrolled) plane; force_n."""

    time_s: Annotated[float, Meta(ge=0, le=600)]
    x_mm: float
    z_mm: float
    force_n: NotNegative


class RecordingSpec(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """A simulated recording: an indenter, by name, that moves linearly between ``points``, and the electrodes' defects.
    noise_counts : standard deviation; drift_counts : the most, from first to last frame
    friction : Coulomb's coefficient
    tilt_deg : between the indenter's axis and the surface normal, its upper end toward +x"""

    indenter: str
    points: Annotated[list[PointSpec], Meta(min_length=2)]
    noise_counts: NotNegative = 1.0
    drift_counts: NotNegative = 3.0
    tilt_deg: Annotated[float, Meta(ge=0, le=45)] = 0.0
    friction: Friction = FRICTION


class Scene(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Content of a scene file. format : "tactile-scene-1"; indenters : the bodies, each with another name
    pairs, recording : presses to draw, and a motion to record; None if the file has no such table"""

    format: str
    name: str
    description: str
    indenters: Annotated[list[IndenterSpec], Meta(min_length=1)]
    pairs: PairSpec | None = None
    recording: RecordingSpec | None = None


def load_scene(path: str | os.PathLike) -> tuple[Scene, str]:
    """Return the scene of a ``scene.toml`` or its folder, meshes named by full paths, and the file's text. Raises
    TactileError naming file and field."""
    file = pathlib.Path(path)
    file = file / "scene.toml" if file.is_dir() else file
    try:
        text = read_toml_text(file)
    except UnicodeDecodeError as error:
        raise TactileError(file, "no text", "a scene.toml or a folder that holds one") from error
    except OSError as error:
        raise TactileError(file, f"cannot be read ({error})", "a scene.toml or a folder that holds one") from error
    try:
        scene = msgspec.toml.decode(text, type=Scene)
    except (ValueError, RecursionError) as error:
        raise TactileError(file, str(error), "the fields of scenes/press_sphere/scene.toml") from error
    check(file, scene)
    found = [with_files_of(file.parent, spec) for spec in scene.indenters]
    return msgspec.structs.replace(scene, indenters=found), text


def check(file: str | os.PathLike, scene: Scene) -> None:
    """Raise TactileError for what the fields' types do not check: format, finite numbers, different names, growing
    depths and times, an indenter that exists. file : names the scene in messages"""
    if scene.format != FORMAT:
        raise TactileError(f"{file}, format", repr(scene.format), repr(FORMAT))
    numbers = list(_numbers(msgspec.to_builtins(scene)))
    if not np.isfinite(numbers).all():
        raise TactileError(file, "a number is nan or infinite", "finite numbers")
    if np.max(np.abs(numbers), initial=0.0) > LARGEST:
        raise TactileError(file, f"the number {max(numbers, key=abs):g}", f"millimetres, newtons... up to {LARGEST:g}")
    names = [spec.name for spec in scene.indenters]
    if len(set(names)) < len(names):
        raise TactileError(f"{file}, indenters", f"names {names}", "different names")
    if scene.pairs is not None and scene.pairs.depth_steps:
        _check_depths(file, scene.pairs)
    if scene.recording is None:
        return
    if scene.recording.indenter not in names:
        raise TactileError(f"{file}, recording.indenter", repr(scene.recording.indenter), f"one of {names}")
    times = [point.time_s for point in scene.recording.points]
    if times != sorted(set(times)):
        raise TactileError(f"{file}, recording.points", f"time_s {times}", "growing times")


def _check_depths(file: str | os.PathLike, spec: PairSpec) -> None:
    if spec.depth_min_mm >= spec.depth_max_mm:
        expected = f"less than depth_max_mm, {spec.depth_max_mm:g}"
        raise TactileError(f"{file}, pairs.depth_min_mm", f"{spec.depth_min_mm:g}", expected)
    if spec.slide_share:
        advice = "Slides are held at a force: pair by force, or leave them out"
        raise TactileError(f"{file}, pairs.slide_share", f"{spec.slide_share:g} beside depth_steps", "0", advice)


def _numbers(value):  # noqa: ANN001, ANN202 (any nesting of dict, list and numbers)
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list):
        for item in value:
            yield from _numbers(item)
    elif isinstance(value, float):
        yield value


def to_toml(scene: Scene) -> str:
    """Format a scene as TOML text, with every field, also defaults."""
    document = msgspec.to_builtins(scene)
    lines = [f"{key} = {_value(document[key])}" for key in ("format", "name", "description")]
    for spec in document["indenters"]:
        lines += ["", "[[indenters]]", *_fields(spec)]
    if document["pairs"] is not None:
        lines += ["", "[pairs]", *_fields(document["pairs"])]
    if document["recording"] is not None:
        recording = dict(document["recording"])
        points = recording.pop("points")
        lines += ["", "[recording]", *_fields(recording), "points = ["]
        lines += [f"    {_value(point)}," for point in points] + ["]"]
    return "\n".join(lines) + "\n"


def write_scene(folder: str | os.PathLike, scene: Scene, meshes: dict[str, bytes]) -> pathlib.Path:
    """Write ``scene.toml`` and the mesh files ``meshes``, name -> content, into a folder; return the path of
    scene.toml.
    Raises TactileError where they cannot be written."""
    folder = pathlib.Path(folder)
    with atomic.writing(folder, advice="Make room, or choose another one"):
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in meshes.items():
            atomic.write_bytes(folder / name, content)
        atomic.write_bytes(folder / "scene.toml", to_toml(scene).encode())
    return folder / "scene.toml"


def _fields(table: dict[str, Any]) -> list[str]:
    return [f"{key} = {_value(value)}" for key, value in table.items()]


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(_fields(value)) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_value(item) for item in value) + "]"
    # JSON's strings and finite numbers are TOML's too; DEL alone must be escaped there and is not by JSON.
    return json.dumps(value, ensure_ascii=False, allow_nan=False).replace("\x7f", "\\u007f")
