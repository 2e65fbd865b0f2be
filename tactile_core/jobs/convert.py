"""The main job: a recording becomes a gel's pictures, deformations and a note, in a folder of its own."""

from __future__ import annotations

import dataclasses
import functools
import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..errors import TactileError
from ..files import atomic, provenance
from ..files.stopwatch import Stopwatch
from ..sensors import SOURCE, TARGET
from . import results, sampling_error
from .frame_pass import FramePass, Solver, Tools
from .frame_range import frames_text, select
from .results import SOLVED, TRANSLATED, Gel

if TYPE_CHECKING:
    from ..recordings import PrepareOptions, Recording
    from ..recordings.electrode_gains import SensorFile
    from ..translation.answer import Answer
    from ..translation.translate import Translator
    from .error_budget import Budget
    from .needed_rows import Needed


@dataclasses.dataclass(frozen=True)
class Options:
    """Options of the conversion of a recording.

    frames : part of it, the same for every recording; keep : words of results.KEEPABLE
    prepare : tare and kind overrides, None for automatic; overwrite : replace an older result
    sensor : the unit's rest, and gains and offsets to take off, as `tactile adapt` finds them
    error : what the toolkit may add
    calibration : file of the DIGIT that is drawn, for the note; None for the one that ships
    """

    frames: slice = dataclasses.field(default_factory=lambda: slice(None))
    keep: tuple[str, ...] = results.DEFAULT_KEEP
    prepare: PrepareOptions | None = None
    overwrite: bool = False
    sensor: SensorFile | None = None
    error: Budget | None = None
    calibration: str | os.PathLike | None = None


def load_tools(
    weights: str | os.PathLike | None = None,
    calibration: str | os.PathLike | None = None,
    preset: str = "fast",
    variant: str | None = None,
    answer: Answer | None = None,
    gel: Gel = TRANSLATED,
    target: str = TARGET,
    source: str | None = SOURCE,
) -> Tools:
    """Load the weights, shipped or of a folder, and camera and lights of a gel, the unit's that ships or a file's.

    preset, variant : of ``renderer.Renderer``, for all pictures but fast ones
    answer : which of the contacts that signals may come from, and where on the gel; see ``Answer``
    gel : the networks', or the found contact solved on the target (``solved_gel``), as for any target to which the
        shipped weights do not lead
    target : the gel, to which the weights must translate unless it is solved
    source : the sensor whose recordings they must translate; None for whichever they do
    The fast shader is made when the first picture is drawn: it takes 140 MB, which reading a long recording may need.
    Raises TactileError for weights that are missing, changed or of another shape, for a bad calibration, and what
    ``renderer.Renderer`` raises.
    """
    from ..pictures import background, height_map, shading
    from ..sensors.calibration_file import load_calibration

    translator, solves = load_networks(weights, answer, gel, target, source)
    unit = load_calibration(calibration, target)
    mapper = height_map.gel_mapper(unit.camera)
    dots = None
    if preset == "fast" and unit.markers is None:
        if unit.photograph:
            background.read_photograph(unit.photograph, unit.camera)  # a bad one is refused before any work
        shade = made_at_first_call(partial(shading.Shader, unit))
    else:
        from ..pictures.renderer import Renderer

        shade = Renderer(unit, preset, variant)
        dots = shade.dots
    solve: Solver | None = None
    if solves:
        from . import solved_gel

        solved_gel.prepare(target)
        solve = partial(solved_gel.solved, gel=target, found_on=translator.target)
    asked = translator.answer
    return Tools(
        translate=translator, card=translator.card, sha256=translator.sha256,
        height_map=mapper, shade=shade, preset=preset, camera=unit.camera,
        posterior=translator.posterior if asked.follows else None,
        plausible=translator.plausible if asked.samples else None,
        answer=asked, solve=solve, dots=dots,
        source=translator.source, target=target, found_on=translator.target,
    )  # fmt: skip


def load_networks(
    weights: str | os.PathLike | None, answer: Answer | None, gel: Gel, target: str, source: str | None
) -> tuple[Translator, bool]:
    """Load the networks, and tell whether the target is solved under the contacts that they find; see `load_tools`."""
    from ..translation import translate

    led = None if gel == SOLVED or weights is None else target
    translator = translate.load_translator(weights, answer, led, source)
    return translator, gel == SOLVED or translator.target != target


def made_at_first_call(make: Callable[[], Callable[..., np.ndarray]]) -> Callable[..., np.ndarray]:
    """Return a tool that `make` makes when it is first called."""
    made = functools.cache(make)
    return lambda *arguments: made()(*arguments)


@dataclasses.dataclass(frozen=True)
class Done:
    """A finished conversion. folder : the result; warnings : what the user should know of it

    remarks : sentences on errors: by how much a kept traction misses the force; where a bound was given, what the
        toolkit added to displacements or heights, and what the translation itself leaves
    """

    folder: Path
    warnings: tuple[str, ...]
    remarks: tuple[str, ...]


def convert(
    recording_path: str | os.PathLike,
    folder: str | os.PathLike,
    options: Options,
    tools: Tools,
    progress: Callable[[int, int], None] | None = None,
) -> Done:
    """Convert one recording into `folder`, which appears whole or not at all.

    progress : called with (frames done, frames in all)
    Raises TactileError for a recording that cannot be read, a selection without frames, a disk that cannot be written.
    """
    from .. import recordings
    from ..recordings.fingers import split
    from .needed_rows import Needed

    if options.error is not None and options.error.um is not None:
        sampling_error.check_gel(tools.target)
    clock = Stopwatch()
    with clock.stage("read"):
        columns = None if options.prepare is None else options.prepare.columns
        recording = recordings.read(recording_path, columns, tools.source, lean=True)
        check_order(recording, tools.answer)
    frames = select(options.frames, len(recording))
    with clock.stage("prepare"):
        finger = split(os.fspath(recording_path))[1]
        unit = (
            None
            if options.sensor is None
            else options.sensor.gains_for(recording_path, finger, "--sensor", recording.sensor)
        )
        needed = Needed.prepared(recording, frames, tools.posterior is not None, options.prepare, unit)
        del recording  # of a long one most rows are not needed any more
    try:
        with atomic.new_folder(folder, overwrite=options.overwrite) as partial:
            made = FramePass(needed, options.keep, tools, clock)
            made.write(partial, progress or _silent)
            added = _added(options, made)
            with clock.stage("sheet"):
                made.draw_sheet(partial / results.SHEET)
            origin = note(needed, made, options, tools)
            atomic.write_json(partial / results.NOTE, origin)
            machine = provenance.machine()
            timings = {**clock.per_frame(len(frames)), "frames": len(frames), "machine": machine}
            atomic.write_json(partial / results.TIMINGS, timings)
    except OSError as error:
        file = f"{os.path.basename(error.filename)} " if isinstance(error.filename, str) else ""
        found = f"{file}cannot be written ({error.strerror or error})"
        raise TactileError(folder, found, "a writable folder", "Make room, or name another --out folder") from error
    remarks = [made.describe_traction(), added, "" if options.error is None else made.describe_expected_error()]
    return Done(Path(folder), made.warnings(), tuple(filter(None, remarks)))


def check_order(recording: Recording, answer: Answer) -> None:
    """Raise TactileError where a contact is to be tracked through snapshots, which have no order."""
    if answer.follows and np.isnan(recording.time).all():
        found = "snapshots, which do not follow each other"
        raise TactileError(recording.path, found, "frames in order", "Translate each alone: --frames-apart")


def _added(options: Options, made: FramePass) -> str:
    """Describe the toolkit's own error in displacements or heights; raises TactileError for more than is allowed."""
    if options.error is None or options.error.um is None:
        return ""
    return sampling_error.check(options.error.um, made.share if {"height", "image"} & set(options.keep) else None)


def _silent(done: int, total: int) -> None:
    """Discard progress."""


def note(needed: Needed, made: FramePass, options: Options, tools: Tools) -> dict:
    """Return the origin of a result for JSON: what the same input reproduces, so no paths and no time of day."""
    from ..recordings import labels

    recording = needed.recording
    prepare = None if options.prepare is None else dataclasses.asdict(options.prepare)
    return {
        "format": results.FORMAT,
        "recording": {
            "file": os.path.basename(recording.path), "sha256": provenance.sha256(recording.path),
            "layout": recording.layout, "frames": needed.count, "simulated": recording.simulated,
            "labels": labels.summary(recording.labels),
            "about": {name: value for name, value in recording.about.items() if name != "scene"},  # the file holds it
        },
        "options": {"frames": frames_text(options.frames), "keep": list(options.keep), "prepare": prepare,
                    "error": None if options.error is None else str(options.error), "preset": tools.preset,
                    "answer": dataclasses.asdict(tools.answer), "gel": TRANSLATED if tools.solve is None else SOLVED},
        "frames_converted": len(made.frames),
        "prepared": made.signals.report,
        "warnings": list(made.warnings()),
        "flagged_frames": made.flagged,
        "weights": weights_entry(tools),
        **_unit_entry(options.calibration),
        "versions": provenance.versions("PIL", "matplotlib"),
    }  # fmt: skip


def _unit_entry(calibration: str | os.PathLike | None) -> dict[str, dict[str, str]]:
    """Return the calibration that pictures are drawn by, where one was given."""
    if calibration is None:
        return {}
    return {"calibration": {"file": os.path.basename(calibration), "sha256": provenance.sha256(calibration)}}


def weights_entry(tools: Tools) -> dict:
    """Return the hash of the weights' card, and the error and baseline, um, that the card states."""
    from ..translation.card_errors import chain_error

    found = chain_error(tools.card)
    errors = {} if found is None else {"kept_apart_rms_um": found[0], "baseline_rms_um": found[1]}
    return {"sha256": tools.sha256, **errors}
