import io
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tactile_core import sensors
from tactile_core.jobs.conversion_report import ConversionReport, choose_frames
from tactile_core.jobs.frame_pass import Tools
from tactile_core.jobs.sheet_figure import CAPTION, FOOT, SheetFigure
from tactile_core.recordings.doubt import Doubt, Reason
from tactile_core.recordings.flags import Flag
from tactile_core.sensors.calibration_file import load_calibration
from tactile_core.translation.answer import Answer

COUNT = 2


def drawn(path: Path, *arguments: Any, **named: Any) -> Path:
    """Draw the sheet of ``reported``, which takes the other arguments."""
    reported(*arguments, **named).draw_sheet(path)
    return path


def reported(
    warnings: Sequence[str] = (), truth: bool = False, touched: bool = True, shift: tuple = (0.0, 0.0),
    force: float = 1.0, stiffness: float = 1.0, **about: Any,
) -> ConversionReport:  # fmt: skip
    """Report a made-up recording; truth : with the true skin; shift : mm; force : N; about : of ``Recording``"""
    rng = np.random.default_rng(0)
    known = {"name": "touch", "time": np.arange(COUNT) / 100, "simulated": truth, "truth": None} | about
    skin = (len(known["time"]), len(sensors.biotac_surface().rest), 3)
    if truth:
        known["truth"] = SimpleNamespace(displacement_biotac=rng.normal(size=skin) * 1e-4)
    recording, count = SimpleNamespace(**known), len(known["time"])
    unknown, frames = np.full(count, np.nan), np.arange(count)
    change = rng.normal(size=(count, 19)) if touched else np.full((count, 19), np.nan)
    signals = SimpleNamespace(change=change, pressure_measured=unknown, warnings=warnings, stiffness=stiffness)
    rows = SimpleNamespace(
        recording=recording, signals=signals, at=lambda frames: frames, read=lambda frames: (None, signals)
    )
    translator = SimpleNamespace(card={}, answer=Answer(mount_shift_mm=shift), source="biotac")
    drawer = SimpleNamespace(camera=load_calibration().camera, target="digit", found_on="digit")
    made = SimpleNamespace(folded=0, pictures=lambda arrays, rows: list(arrays["image"][rows]))
    report = ConversionReport(rows, frames, Tools(translator, drawer), made)
    gel = (count, len(sensors.digit_surface().rest), 3)
    report.take(frames, {
        "displacement_biotac": touched * rng.normal(size=skin) * 1e-4,
        "displacement_digit": touched * rng.normal(size=gel) * 1e-4,
        "image": rng.integers(0, 256, (count, 320, 240, 3), dtype=np.uint8),
        "force": touched * np.tile([0, force, 0], (count, 1)),
        "confidence": np.full(count, 0.9),
        "flags": np.zeros(count, np.uint16),
        "expected_error_digit": np.full(count, 30e-6),
        "contact_center": np.tile([-7e-3, 1e-3] if touched else [np.nan, np.nan], (count, 1)),
        "second_center": np.full((count, 2), np.nan),
        "pressure": np.linspace(0, 2e3, count) if touched else unknown,
        "explained": np.linspace(-3, 1, count) if touched else unknown,
    })  # fmt: skip
    return report


@pytest.mark.parametrize(
    ("force", "stiffness", "limit"), [(4.5, 1.0, "4"), (3.5, 1.0, None), (4.5, 1.2, None), (5.5, 1.2, "4.8")]
)
def test_a_force_beyond_what_signals_tell_is_said(force: float, stiffness: float, limit: str | None) -> None:
    found = [text for text in reported(force=force, stiffness=stiffness).warnings() if "force above" in text]
    assert len(found) == (limit is not None)
    assert all(text.startswith(f"{COUNT} of {COUNT} frames: force above {limit} N may be half") for text in found)


def size(path: Path) -> tuple[int, int]:
    from PIL import Image

    with Image.open(io.BytesIO(path.read_bytes())) as picture:
        return picture.size


def test_same_input_makes_the_same_bytes_without_a_date_whatever_ones_own_settings(tmp_path: Path) -> None:
    import matplotlib

    first = drawn(tmp_path / "a.png")
    with matplotlib.rc_context({"font.size": 20, "lines.linewidth": 5}):
        second = drawn(tmp_path / "b.png")
        assert matplotlib.rcParams["font.size"] == 20
    assert first.read_bytes() == second.read_bytes() and b"Software" not in first.read_bytes()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.png", "b.png"]  # no half file is left


def test_a_column_has_its_frame_s_time_and_its_place_on_the_finger(tmp_path: Path, monkeypatch) -> None:
    times, centers = [], []
    monkeypatch.setattr(SheetFigure, "headings", lambda self, seconds: times.extend(seconds))
    monkeypatch.setattr(SheetFigure, "skin_row", lambda *given: centers.append(given[4]))
    drawn(tmp_path / "a.png", shift=(-2.0, 0.5), time=np.arange(60) / 100)
    assert np.diff(times).min() >= 0.6 / 12  # a frame each of parts of the recording: `choose_frames`
    np.testing.assert_allclose(centers[0][:, 0], np.tile([-5e-3, 0.5e-3], (6, 1)))


def test_truth_adds_a_row_and_warnings_add_lines(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    width, plain = size(drawn(path))
    assert width == 1600
    assert size(drawn(path, truth=True))[1] > plain + 200
    assert plain + 30 < size(drawn(path, ["rectified: the sign is lost", "no quiet part"]))[1] < plain + 60
    many = ["many words " * 40] * 30  # cut off, with a line that says so
    assert size(drawn(path, many))[1] < plain + 120


def test_what_doubts_the_whole_is_shown_before_frames_and_samples(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(SheetFigure, "png", lambda figure: "\n".join(figure.warnings).encode())
    loaded = Doubt(Reason.REST_LOADED, share=0.6)
    found = ["line 7: glitch in E3 900; interpolated", loaded, "rectified: the sign is lost"]
    lines = drawn(tmp_path / "sheet.txt", found, force=4.5).read_text().split("\n")
    assert [line.split()[0] for line in lines] == ["what", str(COUNT), "rectified:", "line"]


@pytest.mark.parametrize("name", ["$\\alpha", "名前", "a\udcff\nb", "x" * 300])
def test_any_name_can_be_drawn(tmp_path: Path, name: str, recwarn: pytest.WarningsRecorder) -> None:
    drawn(tmp_path / "a.png", name=name)
    assert not recwarn.list


def test_one_frame_without_contact(tmp_path: Path) -> None:
    assert size(drawn(tmp_path / "a.png", touched=False, time=np.zeros(1)))[0] == 1600


def test_frames_are_the_strongest_that_lie_apart() -> None:
    strength = np.zeros(60)
    strength[[3, 12, 29, 31, 45, 59]] = [1, 5, 6, 7, 2, 3]
    chosen = choose_frames(strength)
    # 29 lies two frames from 31, the strongest; with 60 frames and 6 columns they are 5 apart
    assert set(chosen) >= {3, 12, 31, 45, 59} and 29 not in chosen
    assert (np.diff(chosen) >= 5).all() and len(chosen) == 6
    np.testing.assert_array_equal(choose_frames(strength[:4]), [0, 1, 2, 3])
    strength[31] = np.nan
    assert 29 in choose_frames(strength)
    assert len(choose_frames(np.full(30, np.nan))) == 6


def test_captions_touch_neither_each_other_nor_the_line_below_them() -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    figure = SheetFigure(6, load_calibration().camera, [], False)
    figure.top = figure.height - CAPTION - FOOT
    pairs = [Flag.UNEXPLAINED | Flag.OUT_OF_RANGE, Flag.LAW_DOUBTED | Flag.OUT_OF_RANGE, Flag.RECTIFIED]
    flags = np.array([int(flag) for flag in (*pairs, *pairs)], np.uint16)
    figure.captions(np.full((6, 3), 9.0), np.linspace(0, 1, 6), flags, np.full(6, 1e-3), np.full(6, 0.8e-3))
    renderer = FigureCanvasAgg(figure.figure).get_renderer()
    boxes = [text.get_window_extent(renderer) for text in figure.figure.texts]
    assert len(boxes) == 7
    assert not any(one.overlaps(other) for k, one in enumerate(boxes) for other in boxes[:k])
    assert min(box.y0 for box in boxes) >= 0
