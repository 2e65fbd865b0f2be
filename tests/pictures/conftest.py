import pytest
from gel_pictures import works
from plain_unit import plain_unit

from tactile_core.pictures.mitsuba.variant import LLVM, SCALAR


@pytest.fixture(params=[LLVM, SCALAR])
def variant(request) -> str:
    """Each variant in turn."""
    return works(request.param)


@pytest.fixture(scope="session")
def small():
    """The plain unit with 60 x 80 pixels: a sixteenth of the work."""
    return plain_unit().at_size(60, 80)
