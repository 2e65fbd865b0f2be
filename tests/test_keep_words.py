"""Words of --keep are read in any order, and others are named."""

import pytest

from tactile_core import keep_words
from tactile_core.errors import TactileError

KNOWN = ("electrodes", "displacement_biotac", "displacement_digit")


def test_words_come_in_their_own_order_and_all_without_a_text():
    assert keep_words.parse("displacement_digit, electrodes", KNOWN) == ("electrodes", "displacement_digit")
    assert keep_words.parse(None, KNOWN) == KNOWN
    assert keep_words.parse(" ", KNOWN, least=0) == ()


@pytest.mark.parametrize(("text", "match"), [("electrodes,image", "image"), (" , ", "nothing"), ("digit", "digit")])
def test_words_that_are_none_are_refused(text, match):
    with pytest.raises(TactileError, match=f"--keep.*{match}"):
        keep_words.parse(text, KNOWN)
