from __future__ import annotations

import pytest
from gel_pictures import NO_MITSUBA, Press, works
from plain_unit import plain_unit

from tactile_core.optics.variant import LLVM, SCALAR, choose_variant


@pytest.fixture(params=[LLVM, SCALAR])
def variant(request) -> str:
    """Each variant in turn."""
    return works(request.param)


@pytest.fixture
def any_variant() -> str:
    """The faster variant that works here."""
    pytest.importorskip("mitsuba", reason=NO_MITSUBA)
    return choose_variant().name


@pytest.fixture(scope="session")
def small():
    """The plain unit with 60 x 80 pixels: a sixteenth of the work."""
    return plain_unit().at_size(60, 80)


@pytest.fixture
def press():
    return Press()
