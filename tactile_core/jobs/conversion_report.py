"""The report of a conversion to its user: warnings, expected errors, and the contact sheet, a few frames as columns."""

from __future__ import annotations

import contextlib
import dataclasses
import os
import textwrap
import warnings as python_warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .. import accuracy
from ..files import atomic
from ..recordings import flags
from ..sensors import SOURCE, title
from ..sensors.camera import Camera
from ..translation.card import doubt
from ..translation.simulated_likeness import contradicted
from ..translation.trust_words import DENIED, LOW_CONFIDENCE, SENTENCES
from .frame_pass import FramePass, Tools
from .frames_file import described
from .sheet_figure import FRAMES, SheetFigure, scale

if TYPE_CHECKING:
    from ..translation.translate import PreparedRows

BLOCK = 2**16  # frames of signals alone that are looked at at a time
SHEET_ARRAYS = (
    "displacement_biotac", "displacement_digit", "force", "confidence", "flags", "expected_error_digit",
    "contact_center", "second_center",
)  # fmt: skip


class ConversionReport:
    """Collects what is reported of all frames, and what the contact sheet shows; flagged : number of frames by flag"""

    def __init__(self, rows: PreparedRows, frames: np.ndarray, tools: Tools, made: FramePass) -> None:
        """Start a report on rising frames (T,) of prepared rows, which `made` translates."""
        self._rows, self._frames, self._tools, self._made = rows, frames, tools, made
        self.flagged: dict[str, int] = dict.fromkeys(flags.names(), 0)
        self._pressure: list[np.ndarray] = []
        self._denied = 0  # frames that are unexplained because PDC shows another pressure
        self._explained: list[np.ndarray] = []
        self._forces: list[np.ndarray] = []  # that the traction adds up to, and the networks'
        change, at = rows.signals.change, rows.at(frames)
        parts = [at[start : start + BLOCK] for start in range(0, len(at), BLOCK)]
        chosen = choose_frames(np.concatenate([np.abs(change[part]).mean(axis=1) for part in parts]))
        self._shown: dict[int, dict[str, np.ndarray]] = {int(frame): {} for frame in frames[chosen]}

    def take(self, frames: np.ndarray, arrays: dict[str, np.ndarray]) -> None:
        """Add the arrays of some frames."""
        for name, bit in flags.names().items():
            self.flagged[name] += int(np.count_nonzero(arrays["flags"] & bit))
        self._pressure.append(arrays["pressure"])
        measured = self._rows.read(frames)[1].pressure_measured
        denied = contradicted(arrays["pressure"], measured) & (arrays["flags"] & flags.Flag.UNEXPLAINED > 0)
        self._denied += int(np.count_nonzero(denied))
        self._explained.append(arrays["explained"])
        if "traction_force" in arrays:
            self._forces.append(np.stack([arrays["traction_force"], arrays["force"]]))
        rows = np.flatnonzero(np.isin(frames, list(self._shown)))
        pictures = self._made.pictures(arrays, rows) if len(rows) else []
        for row, picture in zip(rows, pictures, strict=True):
            # Copies, so that the chunk can be freed.
            kept = {name: np.array(arrays[name][row]) for name in SHEET_ARRAYS} | {"pictures": np.array(picture)}
            self._shown[int(frames[row])] = kept

    def warnings(self) -> tuple[str, ...]:
        """Return warnings for the user: of the weights, the options, the recording, and its translated frames."""
        translator, drawer = self._tools.translator, self._tools.drawer
        found = [
            *filter(None, [doubt(translator.card)]),
            *self._rows.signals.warnings,
            *translator.answer.describe_shift(),
        ]
        found += drawer.describe_gel()
        for flag, words in SENTENCES.items():
            name = str(flag.name).lower()
            denied = self._denied if flag is flags.Flag.UNEXPLAINED else 0
            for count, meaning in ((self.flagged[name] - denied, described(words, self._tools.pair)), (denied, DENIED)):
                if count:
                    found.append(f"{count} of {len(self._frames)} frames: {meaning} (flag {name})")
        if self._made.folded:
            found.append(f"{self._made.folded} frames: the translated gel folds over itself; heights there are guesses")
        return tuple(found)

    @property
    def explained(self) -> float | None:
        """Share of the electrodes' change that the translation explains, mean in contact; None without any."""
        share = np.concatenate(self._explained)
        touching = np.isfinite(share)
        return round(float(share[touching].mean(dtype=float)), 4) if touching.any() else None

    def describe_traction(self) -> str:
        """Describe the difference between kept traction and force; empty where traction is not kept."""
        if not self._forces:
            return ""
        from .solved_gel import describe_miss

        total, force = np.concatenate(self._forces, axis=1)
        return describe_miss(total, force, solved=self._tools.drawer.solve is not None)

    def draw_sheet(self, path: Path) -> None:
        """Draw the contact sheet once all frames were added."""
        recording, signals = self._rows.recording, self._rows.signals
        shown, rows = np.array(list(self._shown)), self._rows.at(self._frames)
        columns = {name: np.stack([at[name] for at in self._shown.values()]) for name in (*SHEET_ARRAYS, "pictures")}
        truth, timeless = recording.truth, bool(np.isnan(recording.time).all())
        skin = None if truth is None else truth.displacement_biotac
        contents = Contents(
            name=recording.name,
            camera=self._tools.drawer.camera,
            time=self._frames if timeless else recording.time[rows],
            snapshots=timeless,
            electrodes=signals.change[rows],
            frames=np.searchsorted(self._frames, shown),
            true_displacement_biotac=None if skin is None else skin[self._rows.at(shown)],
            simulated=recording.simulated,
            mount_shift=self._tools.translator.answer.mount_shift,
            pressure=np.concatenate(self._pressure),
            explained=np.concatenate(self._explained),
            pressure_measured=signals.pressure_measured[rows],
            warnings=self.warnings(),
            source=self._tools.translator.source,
            **columns,
        )
        contact_sheet(path, contents)


WARNING_LINES, WARNING_WIDTH = 5, 200
# Lines in pieces: Agg refuses a noisy line of a hundred thousand points as a whole.
STYLE = {"font.size": 9, "axes.linewidth": 0.6, "agg.path.chunksize": 10_000}


@dataclasses.dataclass(frozen=True, eq=False)
class Contents:
    """Contents of a sheet of a recording of T frames, in k columns.

    name : of the recording; time : (T,) s, of snapshots their numbers; electrodes : (T, 19) counts, change from rest
    pressure, pressure_measured : (T,) Pa, rise of the fluid's as translated and by PDC; NaN where it was not measured
    explained : (T,), share of the electrodes' change that the translation explains; NaN without contact
    frames : (k,) which of the T frames are the columns
    displacement_biotac : (k, N, 3) m; displacement_digit : (k, M, 3) m; pictures : (k, H, W, 3) uint8
    force : (k, 3) N; confidence : (k,) 0..1; flags : (k,) uint16; expected_error_digit : (k,) m, of the largest node
    contact_center : (k, 2) m = (x, z) on the DIGIT, NaN without contact; mount_shift : (2,) m, of a mount in it
    second_center : (k, 2) m of a second contact, likewise
    true_displacement_biotac : (k, N, 3) m of a simulated recording; warnings : sentences for the reader
    source : the sensor that was read, whose skin is drawn; camera : of the gel
    """

    name: str
    camera: Camera
    time: np.ndarray
    electrodes: np.ndarray
    frames: np.ndarray
    displacement_biotac: np.ndarray
    displacement_digit: np.ndarray
    pictures: np.ndarray
    force: np.ndarray
    confidence: np.ndarray
    flags: np.ndarray
    expected_error_digit: np.ndarray
    contact_center: np.ndarray
    pressure: np.ndarray
    explained: np.ndarray
    pressure_measured: np.ndarray
    true_displacement_biotac: np.ndarray | None = None
    simulated: bool = False
    mount_shift: np.ndarray | float = 0.0
    warnings: Sequence[str] = ()
    source: str = SOURCE
    snapshots: bool = False
    second_center: np.ndarray | float = np.nan


def choose_frames(strength: np.ndarray, count: int = FRAMES) -> np.ndarray:
    """Choose the frames (k,) to show, in order: the strongest contacts, each at least 1 / (2 count) of the recording
    apart.
    strength : (T,) any measure of contact, such as the rms change of the electrodes; NaN counts as none"""
    left = np.where(np.isfinite(strength), strength, -1.0)
    count = min(count, len(left))
    frames, chosen = np.arange(len(left)), []
    for _ in range(count):
        best = int(np.argmax(left))
        chosen.append(best)
        left[np.abs(frames - best) < len(left) / (2 * count)] = -np.inf
    return np.sort(chosen)


def contact_sheet(path: str | os.PathLike, shown: Contents) -> None:
    """Draw the sheet and write it to `path` as a PNG; equal contents make equal bytes."""
    with _plain_matplotlib():
        content = _drawn(shown).png()
    atomic.write_bytes(path, content)


@contextlib.contextmanager
def _plain_matplotlib() -> Iterator[None]:
    """Use matplotlib's settings of this package alone: a user's own must not change the bytes."""
    import matplotlib

    with matplotlib.rc_context(), python_warnings.catch_warnings():
        # Names may hold characters that the font lacks, which are drawn as boxes.
        python_warnings.filterwarnings("ignore", "Glyph .* missing from", UserWarning)
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE)
        yield


def _drawn(shown: Contents) -> SheetFigure:
    displacement, truth = shown.displacement_biotac, shown.true_displacement_biotac
    figure = SheetFigure(
        len(shown.frames),
        shown.camera,
        _sentences(shown.warnings, shown.confidence),
        truth is not None,
        snapshots=shown.snapshots,
    )
    # File names may hold what is no text at all.
    figure.title("".join(letter if letter.isprintable() else "?" for letter in shown.name), shown.simulated)
    figure.electrodes(shown.time, shown.electrodes, shown.frames)
    figure.explained(shown.time, shown.explained)
    figure.pressure(shown.time, shown.pressure, shown.pressure_measured)
    figure.headings(shown.time[shown.frames])
    largest = scale(displacement, truth)
    name = title(shown.source)
    centers = np.stack(np.broadcast_arrays(shown.contact_center, shown.second_center), axis=1)
    label = f"{name}, unrolled\n" + ("translated" if shown.simulated else "displacement")
    figure.skin_row(label, displacement, largest, centers - shown.mount_shift, shown.source)
    if truth is not None:
        figure.skin_row(f"{name}, unrolled\ntrue (simulated)", truth, largest, None, shown.source)
    gel = title(shown.camera.sensor)
    figure.gel_row(f"{gel} gel\ndisplacement", shown.displacement_digit, centers)
    figure.picture_row(f"{gel} picture", shown.pictures)
    dent = accuracy.lengths(shown.displacement_digit).max(axis=1)
    figure.captions(shown.force, shown.confidence, shown.flags, shown.expected_error_digit, dent)
    return figure


def _sentences(warnings: Sequence[str], confidence: np.ndarray) -> list[str]:
    """Return warnings as lines that fit the sheet, no more than it has room for."""
    lines = [line for text in warnings for line in textwrap.wrap(text, WARNING_WIDTH, subsequent_indent="   ")]
    if len(confidence) and np.nanmax(confidence, initial=0) < LOW_CONFIDENCE:
        lines.insert(0, "Low confidence in every frame shown: take this as a guess.")
    if len(lines) > WARNING_LINES:
        lines = [*lines[: WARNING_LINES - 1], f"... and {len(lines) - WARNING_LINES + 1} more lines: see note.json"]
    return lines
