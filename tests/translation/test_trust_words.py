import pytest

from tactile_core.recordings.flags import Flag
from tactile_core.translation.trust_words import in_words, is_guess


@pytest.mark.parametrize(
    ("confidence", "flags", "words"),
    [
        (1.0, 0, "as in training"),
        (1.0, Flag.RECTIFIED, "guess: rectified recording"),
        (0.2, 0, "guess: signals unlike training"),
        (0.2, Flag.REPAIRED, "guess: signals unlike training, repaired sample"),
        (1.0, Flag.REPAIRED, "as in training: repaired sample"),
        (
            0.2,
            Flag.REPAIRED | Flag.RECTIFIED | Flag.UNEXPLAINED | Flag.OUT_OF_RANGE,
            "guess: unlike any contact, signals unlike training",
        ),
        (1.0, 0, "no contact"),
        (1.0, Flag.POLARITY_ASSUMED, "no contact: polarity assumed"),
        (1.0, Flag.UNEXPLAINED, "guess: no contact, unlike any contact"),
        (0.2, 0, "guess: no contact, signals unlike training"),
    ],
)
def test_trust_is_one_line_of_plain_words(confidence: float, flags: int, words: str) -> None:
    """A silent frame is said to be one, and told no error."""
    moved, force, error = (0.0, 0.0, "") if "no contact" in words else (900e-6, 0.2, ", expected error 0.37 mm of 0.90")
    assert in_words(confidence, flags, 370e-6, moved, (0.0, force, 0.0)) == words + error


@pytest.mark.parametrize("force", [(0.0, 0.2, 0.0), (0.0, 0.0, 0.0)])
@pytest.mark.parametrize("flag", Flag)
def test_every_flag_is_said(flag: Flag, force: tuple[float, ...]) -> None:
    assert in_words(1.0, flag, 0.0, 1e-3, force) != in_words(1.0, 0, 0.0, 1e-3, force)
    assert is_guess(1.0, flag) == in_words(1.0, flag, 0.0, 1e-3, force).startswith("guess: ")


def test_a_dent_whose_error_is_as_large_is_no_shape() -> None:
    force = (0.0, 0.2, 0.0)
    assert in_words(1.0, 0, 4e-4, 7e-4, force) == "guess: shape unsure, expected error 0.40 mm of 0.70"
    assert in_words(1.0, 0, 4e-4, 3e-4, force) == "nothing but a touch is known, expected error 0.40 mm of 0.30"
    assert in_words(1.0, 0, float("nan"), 3e-4, force) == "as in training, error not known"
    assert not is_guess(1.0, 0, 4e-4, 0.0)  # no contact has no shape
    assert is_guess(1.0, 0, 4e-4, 7e-4) and not is_guess(1.0, 0, 3e-4, 7e-4) and not is_guess(1.0, 0, -1e-6, 7e-4)
