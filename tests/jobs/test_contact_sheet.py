import io
from pathlib import Path

import numpy as np
import pytest

from tactile_core import sensors
from tactile_core.jobs.conversion_report import Contents, choose_frames, contact_sheet
from tactile_core.jobs.sheet_figure import CAPTION, FOOT, SheetFigure
from tactile_core.recordings.flags import Flag
from tactile_core.sensors.calibration_file import load_calibration


@pytest.fixture
def columns() -> dict:
    """A made-up recording of 50 frames, two of them shown."""
    rng = np.random.default_rng(0)
    biotac, digit = len(sensors.biotac_surface().rest), len(sensors.digit_surface().rest)
    return {
        "name": "touch",
        "camera": load_calibration().camera,
        "time": np.arange(50) / 100,
        "electrodes": rng.normal(size=(50, 19)),
        "frames": np.array([10, 30]),
        "displacement_biotac": rng.normal(size=(2, biotac, 3)) * 1e-4,
        "displacement_digit": rng.normal(size=(2, digit, 3)) * 1e-4,
        "pictures": rng.integers(0, 256, (2, 320, 240, 3), dtype=np.uint8),
        "force": np.array([[0, 1.0, 0], [0, 0, 0]]),
        "confidence": np.array([0.9, 0.1]),
        "flags": np.array([0, 4], np.uint16),
        "expected_error_digit": np.array([30e-6, 90e-6]),
        "contact_center": np.array([[-7e-3, 1e-3], [np.nan, np.nan]]),
        "pressure": np.linspace(0, 2e3, 50),
        "pressure_measured": np.full(50, np.nan),
        "explained": np.r_[np.full(10, np.nan), np.linspace(-3, 1, 40)],
    }


def size(path: Path) -> tuple[int, int]:
    from PIL import Image

    with Image.open(io.BytesIO(path.read_bytes())) as picture:
        return picture.size


def test_same_input_makes_the_same_bytes_without_a_date(tmp_path: Path, columns: dict) -> None:
    first, second = tmp_path / "a.png", tmp_path / "b.png"
    contact_sheet(first, Contents(**columns))
    contact_sheet(second, Contents(**columns))
    assert first.read_bytes() == second.read_bytes()
    assert b"Software" not in first.read_bytes()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.png", "b.png"]  # no half file is left


def test_own_matplotlib_settings_change_nothing(tmp_path: Path, columns: dict) -> None:
    import matplotlib

    first, second = tmp_path / "a.png", tmp_path / "b.png"
    contact_sheet(first, Contents(**columns))
    with matplotlib.rc_context({"font.size": 20, "lines.linewidth": 5}):
        contact_sheet(second, Contents(**columns))
        assert matplotlib.rcParams["font.size"] == 20
    assert first.read_bytes() == second.read_bytes()


def test_truth_adds_a_row_and_warnings_add_lines(tmp_path: Path, columns: dict) -> None:
    path = tmp_path / "a.png"
    contact_sheet(path, Contents(**columns))
    width, plain = size(path)
    assert width == 1600
    contact_sheet(path, Contents(**columns, true_displacement_biotac=columns["displacement_biotac"], simulated=True))
    with_truth = size(path)[1]
    assert with_truth > plain + 200
    contact_sheet(path, Contents(**columns, warnings=["rectified: the sign is lost", "no quiet part"]))
    assert plain + 30 < size(path)[1] < plain + 60
    contact_sheet(path, Contents(**columns, warnings=["many words " * 40] * 30))  # cut off, with a line that says so
    assert size(path)[1] < plain + 120


@pytest.mark.parametrize("name", ["$\\alpha", "名前", "a\udcff\nb", "x" * 300])
def test_any_name_can_be_drawn(tmp_path: Path, columns: dict, name: str, recwarn: pytest.WarningsRecorder) -> None:
    contact_sheet(tmp_path / "a.png", Contents(**columns | {"name": name}))
    assert not recwarn.list


def test_one_frame_without_contact(tmp_path: Path, columns: dict) -> None:
    given = ("displacement_biotac", "displacement_digit", "pictures", "force", "confidence", "flags")
    for what in (*given, "expected_error_digit", "contact_center"):
        columns[what] = 0 * columns[what][:1]
    columns |= {"frames": np.array([0]), "time": np.zeros(1), "electrodes": np.full((1, 19), np.nan)}
    columns |= {name: np.full(1, np.nan) for name in ("pressure", "pressure_measured", "explained")}
    contact_sheet(tmp_path / "a.png", Contents(**columns))
    assert size(tmp_path / "a.png")[0] == 1600


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
    pairs = [Flag.UNEXPLAINED | Flag.OUT_OF_RANGE, Flag.BEYOND_PICTURE | Flag.POLARITY_ASSUMED, Flag.RECTIFIED]
    flags = np.array([int(flag) for flag in (*pairs, *pairs)], np.uint16)
    figure.captions(np.full((6, 3), 9.0), np.linspace(0, 1, 6), flags, np.full(6, 1e-3), np.full(6, 2e-3))
    renderer = FigureCanvasAgg(figure.figure).get_renderer()
    boxes = [text.get_window_extent(renderer) for text in figure.figure.texts]
    assert len(boxes) == 7
    assert not any(one.overlaps(other) for k, one in enumerate(boxes) for other in boxes[:k])
    assert min(box.y0 for box in boxes) >= 0
