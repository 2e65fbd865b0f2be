"""Report a conversion to its user: warnings, expected errors, and the contact sheet, a few frames as columns."""

from __future__ import annotations

import contextlib
import textwrap
import warnings as python_warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .. import accuracy
from ..files import atomic
from ..recordings import flags
from ..recordings.doubt import reason_of
from ..sensors import title
from ..translation.card import doubt
from ..translation.simulated_likeness import contradicted
from ..translation.trust_words import DENIED, FIRM, LOW_CONFIDENCE, SENTENCES, TOO_FIRM
from .frame_pass import FramePass, Tools, describe_gel
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
    """Report on all frames of a conversion, and its contact sheet. flagged : flag's name -> number of frames with it"""

    def __init__(self, rows: PreparedRows, frames: np.ndarray, tools: Tools, made: FramePass) -> None:
        """Start a report. rows : the prepared recording; frames : (T,) rising indices of the frames to convert
        tools : networks and drawer; made : the pass that translates and draws these frames"""
        self._rows, self._frames, self._tools, self._made = rows, frames, tools, made
        self.flagged: dict[str, int] = dict.fromkeys(flags.names(), 0)
        self._pressure: list[np.ndarray] = []
        self._firm_force, self._firm = FIRM * rows.signals.stiffness, 0  # N, and frames of more than that
        self._denied = 0  # frames that are unexplained because PDC shows another pressure
        self._explained: list[np.ndarray] = []
        self._forces: list[np.ndarray] = []  # that the traction adds up to, and the networks'
        change, at = rows.signals.change, rows.at(frames)
        parts = [at[start : start + BLOCK] for start in range(0, len(at), BLOCK)]
        chosen = choose_frames(np.concatenate([np.abs(change[part]).mean(axis=1) for part in parts]))
        self._shown: dict[int, dict[str, np.ndarray]] = {int(frame): {} for frame in frames[chosen]}

    def take(self, frames: np.ndarray, arrays: dict[str, np.ndarray]) -> None:
        """Add translated frames to the report. frames : (n,) indices, after those added before
        arrays : name -> (n, ...), by the names of frames.h5"""
        for name, bit in flags.names().items():
            self.flagged[name] += int(np.count_nonzero(arrays["flags"] & bit))
        self._pressure.append(arrays["pressure"])
        measured = self._rows.read(frames)[1].pressure_measured
        denied = contradicted(arrays["pressure"], measured) & (arrays["flags"] & flags.Flag.UNEXPLAINED > 0)
        self._denied += int(np.count_nonzero(denied))
        self._firm += int(np.count_nonzero(accuracy.lengths(arrays["force"]) > self._firm_force))
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
        """Return sentences that warn the user, on weights, recording, options and translated frames."""
        return *self._of_weights(), *self._of_recording()

    def _of_weights(self) -> list[str]:
        return [*filter(None, [doubt(self._tools.translator.card)])]

    def _of_recording(self) -> list[str]:
        """Return warnings on recording, gel and frames in the order of the steps: single samples first, frames last."""
        translator, drawer = self._tools.translator, self._tools.drawer
        told = describe_gel(drawer.target, drawer.found_on)
        found = [*self._rows.signals.warnings, *translator.answer.describe_shift(), *told]
        for flag, words in SENTENCES.items():
            name = str(flag.name).lower()
            denied = self._denied if flag is flags.Flag.UNEXPLAINED else 0
            for count, meaning in ((self.flagged[name] - denied, described(words, self._tools.pair)), (denied, DENIED)):
                if count:
                    found.append(f"{count} of {len(self._frames)} frames: {meaning} (flag {name})")
        if self._firm:
            found.append(f"{self._firm} of {len(self._frames)} frames: {TOO_FIRM.format(self._firm_force)}")
        if self._made.folded:
            found.append(f"{self._made.folded} frames: the translated gel folds over itself; heights there are guesses")
        return found

    @property
    def explained(self) -> float | None:
        """Return the share of the electrodes' change that is explained, mean in contact; None without contact."""
        share = np.concatenate(self._explained)
        touching = np.isfinite(share)
        return round(float(share[touching].mean(dtype=float)), 4) if touching.any() else None

    def describe_traction(self) -> str:
        """Return a sentence on how far the sum of traction is from the force; "" if traction is not kept."""
        if not self._forces:
            return ""
        from .solved_gel import describe_miss

        total, force = np.concatenate(self._forces, axis=1)
        return describe_miss(total, force, solved=self._tools.drawer.solve is not None)

    def draw_sheet(self, path: Path) -> None:
        """Draw the contact sheet to a file, after all frames were added; equal frames make equal bytes."""
        with _plain_matplotlib():
            content = self._sheet().png()
        atomic.write_bytes(path, content)

    def _sheet(self) -> SheetFigure:
        recording, signals = self._rows.recording, self._rows.signals
        camera, source = self._tools.drawer.camera, self._tools.translator.source
        shown, rows = np.array(list(self._shown)), self._rows.at(self._frames)
        of = {name: np.stack([at[name] for at in self._shown.values()]) for name in (*SHEET_ARRAYS, "pictures")}
        skin = None if recording.truth is None else recording.truth.displacement_biotac
        truth = None if skin is None else skin[self._rows.at(shown)]
        snapshots = bool(np.isnan(recording.time).all())
        time, columns = self._frames if snapshots else recording.time[rows], np.searchsorted(self._frames, shown)
        gravest_last = sorted(self._of_recording(), key=lambda text: reason_of(text) is not None)
        lines = _sentences([*self._of_weights(), *gravest_last[::-1]], of["confidence"])
        figure = SheetFigure(len(shown), camera, lines, truth is not None, snapshots=snapshots)
        # File names may hold what is no text at all.
        figure.title("".join(letter if letter.isprintable() else "?" for letter in recording.name), recording.simulated)
        figure.electrodes(time, signals.change[rows], columns)
        figure.explained(time, np.concatenate(self._explained))
        figure.pressure(time, np.concatenate(self._pressure), signals.pressure_measured[rows])
        figure.headings(time[columns])
        skin_of, gel = f"{title(source)}, unrolled\n", title(camera.sensor)
        largest = scale(of["displacement_biotac"], truth)
        centers = np.stack([of["contact_center"], of["second_center"]], axis=1)
        on_finger = centers - self._tools.translator.answer.mount_shift
        label = skin_of + ("translated" if recording.simulated else "displacement")
        figure.skin_row(label, of["displacement_biotac"], largest, on_finger, source)
        if truth is not None:
            figure.skin_row(f"{skin_of}true (simulated)", truth, largest, None, source)
        figure.gel_row(f"{gel} gel\ndisplacement", of["displacement_digit"], centers)
        figure.picture_row(f"{gel} picture", of["pictures"])
        dent = accuracy.lengths(of["displacement_digit"]).max(axis=1)
        figure.captions(of["force"], of["confidence"], of["flags"], of["expected_error_digit"], dent)
        return figure


WARNING_LINES, WARNING_WIDTH = 5, 200
# Lines in pieces: Agg refuses a noisy line of a hundred thousand points as a whole.
STYLE = {"font.size": 9, "axes.linewidth": 0.6, "agg.path.chunksize": 10_000}


def choose_frames(strength: np.ndarray, count: int = FRAMES) -> np.ndarray:
    """Return the frames (k,) to show, at most `count`, rising: the strongest contacts, each 1 / (2 count) of all apart.
    strength : (T,) any measure of contact, such as the rms change of the electrodes; NaN counts as none"""
    left = np.where(np.isfinite(strength), strength, -1.0)
    count = min(count, len(left))
    frames, chosen = np.arange(len(left)), []
    for _ in range(count):
        best = int(np.argmax(left))
        chosen.append(best)
        left[np.abs(frames - best) < len(left) / (2 * count)] = -np.inf
    return np.sort(chosen)


@contextlib.contextmanager
def _plain_matplotlib() -> Iterator[None]:
    """Use this package's settings of matplotlib in the block: a user's own must not change the bytes."""
    import matplotlib

    with matplotlib.rc_context(), python_warnings.catch_warnings():
        # Names may hold characters that the font lacks, which are drawn as boxes.
        python_warnings.filterwarnings("ignore", "Glyph .* missing from", UserWarning)
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE)
        yield


def _sentences(warnings: Sequence[str], confidence: np.ndarray) -> list[str]:
    """Return warnings as lines of text, no more than the sheet has room for; one comes first if all confidence is low.
    confidence : (k,) 0..1 of the frames shown"""
    lines = [line for text in warnings for line in textwrap.wrap(text, WARNING_WIDTH, subsequent_indent="   ")]
    if len(confidence) and np.nanmax(confidence, initial=0) < LOW_CONFIDENCE:
        lines.insert(0, "Low confidence in every frame shown: take this as a guess.")
    if len(lines) > WARNING_LINES:
        lines = [*lines[: WARNING_LINES - 1], f"... and {len(lines) - WARNING_LINES + 1} more lines: see note.json"]
    return lines
