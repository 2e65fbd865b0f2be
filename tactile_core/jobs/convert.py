"""Convert a recording to a gel's deformation and pictures, with a note, in a folder of its own; and in reverse, a gel's
deformation to the BioTac's skin, force and electrode counts."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .. import recordings
from ..errors import TactileError
from ..files import atomic, provenance
from ..files.hdf5_writer import new_hdf5
from ..files.png_writer import pack_png
from ..files.provenance import Stopwatch
from ..files.threads import in_one_thread
from ..pictures.presets import FAST
from ..recordings import PrepareOptions, Recording, labels
from ..recordings.array_store import open_hdf5
from ..sensors import SOURCE, TARGET
from ..translation.answer import Answer
from ..translation.translate import CHUNK, PreparedRows, load_translator
from ..translation.translator import Translator
from . import results
from .conversion_report import ConversionReport
from .frame_pass import FramePass, Tools, load_drawer
from .gel_frames import read_displacement
from .results import SOLVED, TRANSLATED, ball_radius, frames_text, select

if TYPE_CHECKING:
    from ..recordings.electrode_gains import SensorFile

REVERSE_FORMAT = "tactile-reverse-1"
# dataset -> (unit, meaning); T is the number of frames
REVERSED = {
    "frame": ("1", "index of the frame in the input"),
    "displacement": ("m", "(T, N, 3) of the skin's nodes, attribute sensor: whose"),
    "force": ("N", "(T, 3) of the object on the sensor; 0 where the gel is at rest"),
    "electrodes": ("count", "(T, e) changes against rest, as raw readings have them"),
}


@dataclasses.dataclass(frozen=True)
class Options:
    """Options of the conversion of a recording.

    frames : slice of its frames; keep : arrays to keep: latent, displacement, height, image, traction, marker_motion
    prepare : options of the preparation; overwrite : true replaces an older result
    sensor : the unit's rest, gains and offsets, from `tactile adapt`; None for a typical unit"""

    frames: slice = dataclasses.field(default_factory=lambda: slice(None))
    keep: tuple[str, ...] = results.DEFAULT_KEEP
    prepare: PrepareOptions = PrepareOptions()  # noqa: RUF009 - frozen
    overwrite: bool = False
    sensor: SensorFile | None = None


@dataclasses.dataclass(frozen=True)
class ToolOptions:
    """Options of the networks, the gel and its pictures, for all recordings of a command.

    weights : folder of networks, None for those that ship; source : sensor that they must translate, None for any
    calibration : file of camera and lights, None for those that ship
    preset : name of the pictures' preset; variant : Mitsuba's, None for the faster
    object_reflectance : 0 black to 1 white, of what touches the gel; None for the calibration's
    answer : options of the estimated contact
    gel : "translated" by the networks, or "solved": the contact that they find is solved on the target, also if no
        networks lead to it; "ball:28" solves it under a ball of 28 mm diameter, known to have touched
    target : name of the gel; unless it is solved, the weights must translate to it"""

    weights: str | None = None
    calibration: str | None = None
    preset: str = FAST
    variant: str | None = None
    answer: Answer = Answer()  # noqa: RUF009 - frozen
    gel: str = TRANSLATED
    target: str = TARGET
    source: str | None = SOURCE
    object_reflectance: float | None = None

    def load_networks(self) -> tuple[Translator, str]:
        """Return the networks, and ``gel``, but "solved" if they lead to another gel than the target's. Raises
        TactileError for weights or a gel that cannot be used, and for two contacts on a gel that is solved."""
        ball_radius(self.gel)  # a bad one is refused
        must_lead_to = None if self.gel != TRANSLATED or self.weights is None else self.target
        translator = load_translator(self.weights, self.answer, must_lead_to, self.source)
        gel = SOLVED if self.gel == TRANSLATED and translator.target != self.target else self.gel
        if gel != TRANSLATED and self.answer.contacts > 1:
            raise TactileError("--contacts 2", "a gel that is solved", "one that is translated to", "Leave one out")
        return translator, gel


def load_tools(options: ToolOptions) -> Tools:
    """Return the networks, and camera and lights of the gel. Raises TactileError for weights that are missing, changed
    or of another shape, and for a bad calibration or preset."""
    translator, gel = options.load_networks()
    unit = options.calibration, options.preset, options.variant, options.target
    drawer = load_drawer(*unit, translator.target, options.object_reflectance, gel)
    return Tools(translator, drawer, options.calibration, gel)


@dataclasses.dataclass(frozen=True)
class Converted:
    """A finished conversion. folder : where the result is; warnings : sentences
    remark : sentence on how far the sum of kept traction differs from the force; "" if none is kept"""

    folder: Path
    warnings: tuple[str, ...]
    remark: str


@in_one_thread
def convert(
    recording_path: str | os.PathLike,
    folder: str | os.PathLike,
    options: Options,
    tools: Tools,
    progress: Callable[[int, int], None] | None = None,
) -> Converted:
    """Convert one recording into `folder`, which appears whole or not at all.

    progress : called with (frames done, frames in all)
    Raises TactileError for a recording that cannot be read, a selection without frames, a disk that cannot be written.
    """
    clock, answer = Stopwatch(), tools.translator.answer
    with clock.stage("read"):
        recording = recordings.read(recording_path, options.prepare.columns, tools.translator.source, lean=True)
        check_order(recording, answer)
        files = {"recording": recording.path, "calibration": tools.calibration}
        # Now: before the last picture a file may have grown, or be gone.
        sources = {name: provenance.entry(file) for name, file in files.items() if file is not None}
    frames = select(options.frames, len(recording))
    with clock.stage("prepare"):
        unit = None
        if options.sensor is not None:
            unit = options.sensor.gains_for(recording_path, recording.section, "--sensor", recording.sensor)
        rows = PreparedRows(recording, frames, answer, options.prepare, unit)
        del recording  # of a long one most rows are not needed any more
    made = FramePass(tools, rows.read, rows.count, options.keep, clock)
    report = ConversionReport(rows, frames, tools, made)
    try:
        with atomic.new_folder(folder, overwrite=options.overwrite) as unfinished:
            _write_frames(unfinished, made, report, rows, frames, options, clock, progress)
            with clock.stage("sheet"):
                report.draw_sheet(unfinished / results.SHEET)
            origin = note(sources, rows, frames, report, options, tools)
            atomic.write_json(unfinished / results.NOTE, origin)
            atomic.write_json(unfinished / results.TIMINGS, clock.timings(len(frames)))
    except OSError as error:
        file = f"{os.path.basename(error.filename)} " if isinstance(error.filename, str) else ""
        found = f"{file}cannot be written ({error.strerror or error})"
        raise TactileError(folder, found, "a writable folder", "Make room, or name another --out folder") from error
    return Converted(Path(folder), report.warnings(), report.describe_traction())


def _write_frames(
    folder: Path, made: FramePass, report: ConversionReport, rows: PreparedRows, frames: np.ndarray, options: Options,
    clock: Stopwatch, progress: Callable[[int, int], None] | None,
) -> None:  # fmt: skip
    """Write ``frames.h5`` and pictures. frames : (T,) indices; progress : called with (frames done, in all), or None"""
    pictures, done = _Pictures(folder / results.IMAGES) if "image" in options.keep else None, 0

    def take(some: np.ndarray, arrays: dict[str, np.ndarray]) -> None:
        nonlocal done
        report.take(some, arrays)
        if pictures is not None:
            with clock.stage("png"):
                for frame, picture in zip(some, arrays["image"], strict=True):
                    pictures.write(frame, picture)
        done += len(some)
        if progress is not None:
            progress(done, len(frames))

    recording = rows.recording
    name = recording.name.encode(errors="replace").decode()  # HDF5 text is UTF-8, file names need not be
    about = {"recording": name, "simulated": recording.simulated}
    at = rows.at(frames)
    texts = {name: column[at] for name, column in recording.labels.items()}
    made.write(folder / results.FRAMES, frames, rows.signals, recording.start_time, about, take, texts)


class _Pictures:
    """Writer of PNG pictures; a picture equal to the last one, as without contact, is not compressed again."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir()
        self._folder = folder
        self._packed: tuple[np.ndarray, bytes] | None = None

    def write(self, frame: int, picture: np.ndarray) -> None:
        """Write the picture (H, W, 3) uint8 of a frame."""
        if self._packed is None or not np.array_equal(picture, self._packed[0]):
            self._packed = picture, pack_png(picture)
        (self._folder / results.IMAGE_NAME.format(frame)).write_bytes(self._packed[1])


def check_order(recording: Recording, answer: Answer) -> None:
    """Raise TactileError if a contact would be tracked through snapshots, which have no order."""
    if answer.follows and np.isnan(recording.time).all():
        found = "snapshots, which do not follow each other"
        raise TactileError(recording.path, found, "frames in order", "Translate each alone: --frames-apart")


def note(
    sources: dict, rows: PreparedRows, frames: np.ndarray, report: ConversionReport, options: Options, tools: Tools
) -> dict:
    """Return the content of a result's note.json: what the same input reproduces, so no paths and no time of day.
    Its weights have rms errors of the gel in um on contacts not trained on, and of no deformation, if their card does.
    sources : names and hashes of the files read; frames : (T,) int, indices of the converted frames in the recording"""
    from ..translation.card import chain_error

    recording, error = rows.recording, chain_error(tools.translator.card)
    errors = {} if error is None else {"kept_apart_rms_um": error[0], "baseline_rms_um": error[1]}
    return {
        "format": results.FORMAT,
        **sources,
        "recording": {
            **sources["recording"], "layout": recording.layout, "frames": rows.count,
            "simulated": recording.simulated, "labels": labels.summary(recording.labels),
            "about": {name: value for name, value in recording.about.items() if name != "scene"},  # the file holds it
        },
        "options": {"frames": frames_text(options.frames), "keep": list(options.keep),
                    "prepare": dataclasses.asdict(options.prepare),
                    "preset": tools.drawer.preset, "object_reflectance": tools.drawer.object_reflectance,
                    "answer": dataclasses.asdict(tools.translator.answer),
                    "gel": tools.gel},
        "frames_converted": len(frames),
        "prepared": rows.signals.report,
        "warnings": list(report.warnings()),
        "flagged_frames": report.flagged,
        "explained": report.explained,
        "weights": {"sha256": tools.translator.sha256, **errors},
        "versions": provenance.versions("PIL", "matplotlib"),
    }  # fmt: skip


def _is_reversed(path: str | os.PathLike) -> bool:
    """Return true if a file is a result of ``reverse``, or empty."""
    if os.path.isfile(path) and not os.path.getsize(path):
        return True
    try:
        with open_hdf5(os.fspath(path)) as store:
            return store.attributes.get("format") == REVERSE_FORMAT
    except TactileError:
        return False


def reverse(
    path: str | os.PathLike,
    out: str | os.PathLike,
    translator: Translator,
    frames: slice = slice(None),
    progress: Callable[[int, int], None] = lambda done, total: None,
    *,
    overwrite: bool = False,
) -> None:
    """Translate a gel's displacement, in frames.h5 or a simulated recording, back into a new HDF5 file: frame (T,), the
    skin's displacement (T, N, 3) m, force (T, 3) N, electrodes (T, e) counts.
    translator : networks that lead to that gel; frames : slice of the input's; overwrite : true replaces `out`
    progress : called with (frames done, in all). Raises TactileError for an input without that gel's displacement, and
    an output that exists or cannot be written."""
    if os.path.lexists(out) and not (overwrite and _is_reversed(out)):
        found = "exists, and is no result of --reverse" if overwrite else "exists"
        raise TactileError(
            out, found, "a new file", "Name another --out" if overwrite else "Add --overwrite, or another --out"
        )
    held = read_displacement(path, translator.target)
    rows = select(frames, len(held.numbers))
    writable = atomic.writing(out, "a file in a writable folder", "Name another --out")
    about = {"format": REVERSE_FORMAT, "sensor": translator.source, "weights": translator.sha256}
    with writable, atomic.new_file(out) as unfinished, new_hdf5(unfinished, about) as (file, disk):
        for start in range(0, len(rows), CHUNK):
            some = rows[start : start + CHUNK]
            gel = np.stack(list(held.iterate_rows(some))).astype(np.float32)
            arrays = {"frame": held.numbers[some].astype(np.int32), **translator.reverse(gel)}
            for name, values in arrays.items():
                if start == 0:
                    data = file.create_dataset(name, (len(rows), *values.shape[1:]), values.dtype, track_times=False)
                    data.attrs.update(dict(zip(("unit", "description"), REVERSED[name], strict=True)))
                file[name][start : start + len(some)] = values
            disk.check()
            progress(start + len(some), len(rows))
