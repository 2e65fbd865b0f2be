import pytest
from gel_pictures import works
from plain_unit import plain_unit

from tactile_core.pictures.calibrate import ball_pictures, checked_fit, fit, press_fit
from tactile_core.pictures.mitsuba.variant import LLVM, SCALAR


@pytest.fixture(params=[LLVM, SCALAR])
def variant(request) -> str:
    """Each variant in turn."""
    return works(request.param)


@pytest.fixture
def coarse_fits(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have fits go a few steps from one depth on pictures of 60 x 80 pixels, for what asks no better ones."""
    minimise = fit.minimise
    monkeypatch.setattr(ball_pictures, "WORKING_WIDTH", 60)
    monkeypatch.setattr(press_fit, "DEPTHS", (0.4,))
    monkeypatch.setattr(press_fit, "TOLERANCE", 1e-3)
    monkeypatch.setattr(checked_fit, "COARSE_SIDE", 30)
    monkeypatch.setattr(fit, "minimise", lambda *given, most, **more: minimise(*given, most=min(most, 4), **more))


@pytest.fixture(scope="session")
def small():
    """The plain unit with 60 x 80 pixels: a sixteenth of the work."""
    return plain_unit().at_size(60, 80)
