"""Process the frames of a recording in one pass: translate, shade, write, a chunk at a time."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import TactileError
from ..files.png_writer import pack_png
from ..files.stopwatch import Stopwatch
from ..pictures.height_map import folds_counted
from ..recordings import flags
from ..sensors import PRESSURE_PER_COUNT, SOURCE, TARGET, sensor_surface, title
from ..sensors.camera import Camera
from ..translation.answer import Answer
from ..translation.card_errors import doubt
from ..translation.contact_track import Evidence, Tracked
from ..translation.gel_place import beyond_picture
from . import results
from .contact_sheet import Contents, choose_frames, contact_sheet
from .frames_file import FramesFile, described, kept
from .sampling_error import depth_share

if TYPE_CHECKING:
    from ..pictures.marker_field import MarkerField
    from ..recordings import Signals
    from ..translation.translate import Translation
    from .needed_rows import Needed

Solver = Callable[[dict[str, np.ndarray]], dict[str, np.ndarray]]
BLOCK = 2**16  # frames of signals alone that are looked at at a time
CHUNK = 64  # frames in memory at a time: about 5 MB of displacements and 20 MB of heights
SHEET_ARRAYS = (
    "displacement_biotac", "displacement_digit", "force", "confidence", "flags", "expected_error_digit",
    "contact_center",
)  # fmt: skip
LEFT = ("expected_error_digit", "error_bound_digit")
# Flags that the translation sets, which no warning of the recording mentions.
REMARKABLE = {
    "out_of_range": "signals unlike those the networks were trained on",
    "beyond_digit": "the contact has no counterpart on the DIGIT's gel",
    "beyond_picture": "the contact lies on the gel beside its picture (--mount-shift X,Z moves it there)",
    "undecided_place": "by its own signals the contact may as well lie elsewhere",
    "two_contacts": "the signals look like two contacts at once; the translation shows one",
    "unexplained": "the signals resemble no contact's: rest was perhaps taken under load (--tare, --sensor)",
    "gel_not_solved": "no contact was solved on the gel, which is the networks' there, or at rest if they have none",
}


@dataclasses.dataclass(frozen=True)
class Tools:
    """Tools of a conversion; the same for every recording.

    translate : Signals -> Translation; card, sha256 : of its weights
    height_map : (T, M, 3) m -> (T, H, W) m
    shade : (H, W) m, and the ``marks`` of dots if there are any -> (H, W, 3) uint8, by a preset of ``pictures.presets``
    camera : of the DIGIT that is drawn, by which contacts beside its picture are flagged; None: none are
    posterior : Signals -> Evidence, by which contacts are followed through time; None: each frame is translated alone
    plausible : Signals and frames (T,) -> contacts drawn for each, by ``plausible.NAMES``; None: none are
    answer : what the translator was asked for
    solve : arrays by the names of frames.h5 -> the same with solved gels; None: gels are the networks'
    dots : on the gel that is drawn; None: it has none
    source, target : the sensor whose recordings are translated, and the gel
    found_on : the gel of the networks, on which contacts are found that are solved on another
    """

    translate: Callable[..., Translation]
    card: dict[str, Any]
    sha256: str
    height_map: Callable[[np.ndarray], np.ndarray]
    shade: Callable[..., np.ndarray]
    preset: str = "fast"
    camera: Camera | None = None
    posterior: Callable[[Signals], Evidence] | None = None
    plausible: Callable[[Signals, np.ndarray], dict[str, np.ndarray]] | None = None
    answer: Answer = dataclasses.field(default_factory=Answer)
    solve: Solver | None = None
    dots: MarkerField | None = None
    source: str = SOURCE
    target: str = TARGET
    found_on: str = TARGET

    def draw(self, height: np.ndarray, displacement: np.ndarray) -> np.ndarray:
        """Draw the picture (H, W, 3) uint8 of heights (H, W) m and of the dots on a gel displaced by (M, 3) m."""
        return self.shade(height) if self.dots is None else self.shade(height, self.dots.marks(displacement))

    def warm_up(self) -> None:
        """Draw the resting gel, so that the next picture need not wait for what the first one makes."""
        still = np.zeros((1, len(sensor_surface(self.target).rest), 3), np.float32)
        self.draw(self.height_map(still)[0], still[0])

    def gel_of(self, translation: Translation) -> np.ndarray:
        """Return the displacements (T, M, 3) m of the gel that is drawn: the networks', or solved."""
        arrays = _arrays(translation)
        return (arrays if self.solve is None else self.solve(arrays))["displacement_digit"]

    def marker_motion(self, displacement: np.ndarray) -> dict[str, np.ndarray]:
        """Return gels' array of frames.h5, displaced by (T, M, 3) m; TactileError for a unit without dots."""
        return {"marker_motion": self.needed_dots().motion(displacement)}

    def describe_gel(self) -> tuple[str, ...]:
        """Say that contacts are solved on another gel than that of the networks, where they are."""
        return describe_gel(self.target, self.found_on)

    def needed_dots(self) -> MarkerField:
        """Return the unit's dots; raises TactileError where it has none."""
        if self.dots is None:
            found = "asked of a unit without dots"
            advice = "Give a --calibration with a [markers] table (docs/calibration.md)"
            raise TactileError("--keep marker_motion", found, "a gel with dots printed on it", advice)
        return self.dots

    def tracked(self, read: Callable[[int, int], tuple[np.ndarray, Signals]], count: int) -> Tracked | None:
        """Track the contact through a recording of `count` frames, of which `read` gives some, with their times, s."""
        if self.posterior is None:
            return None

        def read_posteriors(start: int, stop: int) -> tuple[np.ndarray, Evidence]:
            """Times and posteriors of these frames."""
            time, signals = read(start, stop)
            return time, self.posterior(signals)

        return Tracked(read_posteriors, count)


def describe_gel(target: str, found_on: str) -> tuple[str, ...]:
    """Say that contacts found on one gel are solved on another; nothing where both are the same."""
    if target == found_on:
        return ()
    return (
        f"no networks lead to the {title(target)}: its gel is solved under the contacts found on a {title(found_on)}'s",
    )


def translated(signals: Signals, tools: Tools, tracked: Tracked | None, frames: np.ndarray) -> dict[str, np.ndarray]:
    """Translate `signals` to arrays, T first, by the names of frames.h5; frames : (T,) in the recording."""
    translation = tools.translate(signals) if tracked is None else tools.translate(signals, tracked(frames))
    arrays = _arrays(translation)
    if tools.plausible is not None:
        arrays |= tools.plausible(signals, frames)
    arrays |= {"electrodes": signals.electrodes, "pressure_measured": PRESSURE_PER_COUNT * signals.pdc}
    arrays["flags"] = arrays["flags"] | signals.flags | beyond_picture(arrays["contact_center"], tools.camera)
    return arrays if tools.solve is None else tools.solve(arrays)


def _arrays(translation: Translation) -> dict[str, np.ndarray]:
    return {field.name: getattr(translation, field.name) for field in dataclasses.fields(translation)}


class FramePass:
    """Takes the selected frames once through all stages, and keeps of them only what the contact sheet shows."""

    def __init__(
        self,
        needed: Needed,
        keep: tuple[str, ...],
        tools: Tools,
        clock: Stopwatch,
    ) -> None:
        """Take needed : the selected frames; keep : words of results.KEEPABLE."""
        if "marker_motion" in keep:
            tools.needed_dots()
        self.recording, self.signals, self.frames, self.keep = needed.recording, needed.signals, needed.frames, keep
        self.tools, self.clock, self._needed = tools, clock, needed
        self._tracked = tools.tracked(self._read, needed.count)
        self.flagged: dict[str, int] = dict.fromkeys(flags.names(), 0)
        self._errors: list[np.ndarray] = []
        self._pressure: list[np.ndarray] = []
        self._forces: list[np.ndarray] = []  # that the traction adds up to, and the networks'
        self.folded = 0  # height maps of a gel that folds over itself
        self._packed: tuple[np.ndarray, bytes] | None = None  # the last picture, and its file
        self.share = 0.0  # the deepest move of a node so far, over the gel's thickness
        change, rows = self.signals.change, needed.at(self.frames)
        parts = [rows[start : start + BLOCK] for start in range(0, len(rows), BLOCK)]
        chosen = choose_frames(np.concatenate([np.abs(change[part]).mean(axis=1) for part in parts]))
        self.shown: dict[int, dict[str, np.ndarray]] = {int(frame): {} for frame in self.frames[chosen]}

    def write(self, folder: Path, progress: Callable[[int, int], None]) -> None:
        """Write ``frames.h5`` and the pictures; `progress` is called with (frames done, frames in all)."""
        if "image" in self.keep:
            (folder / results.IMAGES).mkdir()
        name = self.recording.name.encode(errors="replace").decode()  # HDF5 text is UTF-8, file names need not be
        about = {"recording": name, "simulated": self.recording.simulated}
        keep, pair = kept(self.keep, self.tools.answer), (self.tools.source, self.tools.target)
        with FramesFile(folder / results.FRAMES, len(self.frames), keep, about, pair=pair) as file:
            for start in range(0, len(self.frames), CHUNK):
                frames = self.frames[start : start + CHUNK]
                arrays = self._translate(frames)
                arrays |= self._press(arrays)
                if "marker_motion" in self.keep:
                    arrays |= self.tools.marker_motion(arrays["displacement_digit"])
                arrays |= self._draw(folder, frames, arrays["displacement_digit"])
                with self.clock.stage("hdf5"):
                    file.write(start, arrays)
                self._count_flags(arrays["flags"])
                self._keep_measures(arrays)
                self._remember(frames, arrays)
                progress(start + len(frames), len(self.frames))
            rows = self._needed.at(self.frames)
            file.write_labels({label: column[rows] for label, column in self.recording.labels.items()})
            file.annotate("time", start_time=self.recording.start_time)
            file.annotate("electrodes", rest=self.signals.rest, kind=self.signals.kind)
            if "marker_motion" in self.keep:
                file.annotate("marker_motion", rest=self.tools.needed_dots().rest)

    def warnings(self) -> tuple[str, ...]:
        """Return warnings for the user: of the recording, and of its translated frames."""
        found = [*self.signals.warnings, *self.tools.answer.describe_shift(), *filter(None, [doubt(self.tools.card)])]
        found += self.tools.describe_gel()
        for name, words in REMARKABLE.items():
            meaning = described(words, (self.tools.source, self.tools.target))
            if self.flagged[name]:
                found.append(f"{self.flagged[name]} of {len(self.frames)} frames: {meaning} (flag {name})")
        if self.folded:
            found.append(f"{self.folded} frames: the translated gel folds over itself; heights there are guesses")
        return tuple(found)

    def describe_expected_error(self) -> str:
        """Describe the translation's own error on the gel: the median of the frames in contact."""
        errors = np.concatenate(self._errors, axis=1)
        if not errors.shape[1]:
            return "no frame is in contact, so the translation expects no error"
        expected, bound = 1e3 * np.median(errors, axis=1)
        if np.isnan(expected):
            return "the translation's own error is not known on this gel, which no networks lead to"
        return (
            f"the translation itself, beside this: the worst node of its gel is off by {expected:.2f} mm in half of "
            f"such contacts, by less than {bound:.2f} mm in 95 of 100"
        )

    def describe_traction(self) -> str:
        """Describe by how much the kept traction misses the force; empty where it is not kept."""
        if not self._forces:
            return ""
        from .gel_traction import describe_miss

        return describe_miss(*np.concatenate(self._forces, axis=1), solved=self.tools.solve is not None)

    def _press(self, arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Compute tractions of translated frames, where they are kept."""
        if "traction" not in self.keep:
            return {}
        from .gel_traction import gel_traction  # with all of contact mechanics

        with self.clock.stage("traction"):
            found = gel_traction(arrays, self.tools.target)
        self._forces.append(np.stack([found["traction_force"], arrays["force"]]))
        return found

    def _keep_measures(self, arrays: dict[str, np.ndarray]) -> None:
        touching = np.isfinite(arrays["contact_center"][:, 0])
        self._errors.append(np.stack([arrays[name][touching] for name in LEFT]))
        self._pressure.append(arrays["pressure"])
        self.share = max(self.share, depth_share(arrays["displacement_digit"], self.tools.target))

    def _translate(self, frames: np.ndarray) -> dict[str, np.ndarray]:
        """Translate some frames to all arrays, T first, by the names of frames.h5."""
        rows = self._needed.at(frames)
        with self.clock.stage("translate"):
            arrays = translated(self.signals.at(rows), self.tools, self._tracked, frames)
        return arrays | {"frame": frames.astype(np.int32), "time": self.recording.time[rows]}

    def _read(self, start: int, stop: int) -> tuple[np.ndarray, Signals]:
        rows = self._needed.between(start, stop)
        return self.recording.time[rows], self.signals.at(rows)

    def _draw(self, folder: Path, frames: np.ndarray, displacement: np.ndarray) -> dict[str, np.ndarray]:
        """Heights, as far as they are kept; pictures go to their files. Frames neither kept nor shown are skipped."""
        whole = "height" in self.keep or "image" in self.keep
        seen = np.flatnonzero([whole or int(frame) in self.shown for frame in frames])
        if not len(seen):
            return {}
        with self.clock.stage("height_map"), folds_counted() as folds:
            heights = self.tools.height_map(displacement[seen])
        self.folded += len(folds)
        for frame, height, moved in zip(frames[seen], heights, displacement[seen], strict=True):
            shown = self.shown.get(int(frame))
            if "image" in self.keep or shown is not None:
                with self.clock.stage("shade"):
                    picture = self.tools.draw(height, moved)
                if shown is not None:
                    shown["pictures"] = picture
                if "image" in self.keep:
                    with self.clock.stage("png"):
                        self._write_picture(folder / results.IMAGES / results.IMAGE_NAME.format(frame), picture)
        return {"height_map": heights} if "height" in self.keep else {}

    def _write_picture(self, path: Path, picture: np.ndarray) -> None:
        """Write a picture; one that equals the one before, as while nothing touches, is not packed again."""
        if self._packed is None or not np.array_equal(picture, self._packed[0]):
            self._packed = picture, pack_png(picture)
        path.write_bytes(self._packed[1])

    def _count_flags(self, bits: np.ndarray) -> None:
        for name, bit in flags.names().items():
            self.flagged[name] += int(np.count_nonzero(bits & bit))

    def _remember(self, frames: np.ndarray, arrays: dict[str, np.ndarray]) -> None:
        """Copy what the contact sheet needs, so that the chunk can be freed."""
        for index in np.flatnonzero(np.isin(frames, list(self.shown))):
            shown = self.shown[int(frames[index])]
            for name in SHEET_ARRAYS:
                shown[name] = np.array(arrays[name][index])

    def draw_sheet(self, path: Path) -> None:
        """Draw the contact sheet of the frames kept for it; call after `write`."""
        shown, rows = np.array(list(self.shown)), self._needed.at(self.frames)
        columns = {name: np.stack([at[name] for at in self.shown.values()]) for name in (*SHEET_ARRAYS, "pictures")}
        truth, timeless = self.recording.truth, bool(np.isnan(self.recording.time).all())
        skin = None if truth is None else truth.displacement_biotac
        contents = Contents(
            name=self.recording.name,
            time=self.frames if timeless else self.recording.time[rows],
            snapshots=timeless,
            electrodes=self.signals.change[rows],
            frames=np.searchsorted(self.frames, shown),
            true_displacement_biotac=None if skin is None else skin[self._needed.at(shown)],
            simulated=self.recording.simulated,
            mount_shift=self.tools.answer.mount_shift,
            pressure=np.concatenate(self._pressure),
            pressure_measured=PRESSURE_PER_COUNT * self.signals.pdc[rows],
            warnings=self.warnings(),
            source=self.tools.source,
            **columns,
        )
        contact_sheet(path, contents, self.tools.camera)
