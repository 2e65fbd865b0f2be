"""What tests of all rooms share: the outside data and small recordings."""

import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parent.parent
SHIPPED = ROOT / "scenes" / "press_roll_slide" / "press_roll_slide.h5"
PAC, ELECTRODES = [f"pac{i}" for i in range(1, 23)], [f"ele{i}" for i in range(1, 20)]
SLIDE_HEADER = ["timestamp", "tdc", "tac", "pdc", *PAC, *ELECTRODES]

# A run started in the background of a shell inherits "ignore Ctrl-C" and so would every program that a test starts and
# interrupts. A handler of our own is not inherited: children begin with the system's default.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
# So does one under nohup "ignore the hangup"; the tests themselves go on through it.
if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
    signal.signal(signal.SIGHUP, lambda number, frame: None)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run files that take all the memory they can get first, which is quicker while this process has freed little.

    Then the pages' commands: one page may take a minute and more, in which other workers do the short tests.
    """
    greedy = "test_hdf5_bombs.py", "test_bombs.py"
    items.sort(key=lambda item: (item.path.name not in greedy, not item.name.startswith("test_commands_work")))


@pytest.fixture(scope="session")
def outside_data() -> Callable[[str], Path]:
    """``outside_data("biotac_recordings")``: that folder of real data, or a skip that says why."""

    def folder(name: str) -> Path:
        base = Path(os.environ.get("TACTILE_TEST_DATA") or ROOT.parent / "shared" / "data")
        if not (base / name).exists():
            pytest.skip(f"outside data: {base / name} is absent; set TACTILE_TEST_DATA to the folder that holds {name}")
        return base / name

    return folder


@pytest.fixture(scope="session")
def shipped():
    """The recording that ships, with its truth; no test may change its arrays."""
    from tactile_core import recordings

    return recordings.read(SHIPPED)


def write_counts(path: Path, electrodes: np.ndarray, pdc: np.ndarray | float = 2000) -> None:
    """A slide file at 100 Hz that holds these electrodes' counts (frames, 19) and pdc, and 2000 elsewhere."""
    rows = np.full((len(electrodes), len(SLIDE_HEADER)), 2000.0)
    rows[:, 0] = 1.6e9 + np.arange(len(rows)) / 100
    rows[:, 3], rows[:, 26:] = pdc, electrodes
    np.savetxt(path, rows, fmt=["%.6f"] + ["%d"] * 44, delimiter=",", header=",".join(SLIDE_HEADER), comments="")


@pytest.fixture(scope="session")
def write_slide() -> Callable[[str, int, Path], Path]:
    """``write_slide("touch", 150, folder)`` writes a raw recording: 0.6 s of quiet, then a press, at 100 Hz."""

    def write(name: str, frames: int, folder: Path) -> Path:
        random = np.random.default_rng(7)
        press = np.clip(np.arange(frames) - 60, 0, 60)[:, None] * np.linspace(1, 3, 19)
        path = folder / f"{name}.csv"
        write_counts(path, np.rint(3400 + press + random.normal(0, 1, (frames, 19))), pdc=2000 + press[:, 0])
        return path

    return write


@pytest.fixture(scope="session")
def _own_sensors(tmp_path_factory: pytest.TempPathFactory) -> Path:
    import coarse_sensors

    folder = tmp_path_factory.mktemp("own")
    coarse_sensors.copy_mini(folder)
    return folder


@pytest.fixture
def coarse_mini(_own_sensors: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """The name of a GelSight Mini whose matrices are soon made, among the user's own sensors."""
    monkeypatch.setenv("TACTILE_SENSORS", str(_own_sensors))
    return "coarse_mini"


@pytest.fixture
def no_sheet(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave the contact sheet of a conversion empty: drawing it takes a second, and most tests look elsewhere."""
    from tactile_core.jobs.conversion_report import ConversionReport

    monkeypatch.setattr(ConversionReport, "draw_sheet", lambda made, path: path.write_bytes(b""))


@pytest.fixture
def coarse_fits(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have fits go a few steps from one depth on pictures of 60 x 80 pixels, for what asks no better ones."""
    from tactile_core.pictures.calibrate import ball_pictures, checked_fit, fit, press_fit

    minimise = fit.minimise
    monkeypatch.setattr(ball_pictures, "WORKING_WIDTH", 60)
    monkeypatch.setattr(press_fit, "DEPTHS", (0.4,))
    monkeypatch.setattr(press_fit, "TOLERANCE", 1e-3)
    monkeypatch.setattr(checked_fit, "COARSE_SIDE", 30)
    monkeypatch.setattr(checked_fit, "LOOKED_AT", 1)
    monkeypatch.setattr(fit, "minimise", lambda *given, most, **more: minimise(*given, most=min(most, 4), **more))


@pytest.fixture
def slide_csv(tmp_path: Path, write_slide: Callable[[str, int, Path], Path]) -> Callable[..., Path]:
    """``slide_csv("touch", frames=150)`` writes such a recording into the test's own folder."""

    def write(name: str = "touch", frames: int = 150, folder: Path = tmp_path) -> Path:
        return write_slide(name, frames, folder)

    return write


@pytest.fixture
def any_variant() -> str:
    """The faster of Mitsuba's variants that works here."""
    from gel_pictures import NO_MITSUBA

    from tactile_core.pictures.mitsuba.variant import choose_variant

    pytest.importorskip("mitsuba", reason=NO_MITSUBA)
    return choose_variant().name


@pytest.fixture
def press():
    """A gel that is pressed; Blender's tests, which have no package of this name, never ask for it."""
    from gel_pictures import Press

    return Press()


@pytest.fixture
def compiled_loops(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[bool], None]]:
    """``compiled_loops(False)`` compiles nothing; a skip where numba is not installed."""
    from tactile_core.files import compiled

    pytest.importorskip("numba", reason="the extras [fem] and [fast] are not installed")

    def switch(on: bool) -> None:
        monkeypatch.setenv(compiled.SWITCH, "1" if on else "0")
        compiled.available.cache_clear()

    yield switch
    monkeypatch.undo()
    compiled.available.cache_clear()
