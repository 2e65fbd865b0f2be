"""A hard case: what is asked, of which stage, what is expected in words, and what was found."""

import dataclasses
from collections.abc import Callable, Iterable

import pytest
from gel_pictures import NO_MITSUBA

from tactile_core.accuracy import Row, line, row
from tactile_core.errors import TactileError

MECHANICS_FAST, MECHANICS_FULL = "mechanics, fast tier", "mechanics, full tier"
TRANSLATION, HEIGHT_MAP = "translation", "height map"
FAST_PICTURE, MITSUBA = "fast picture", "Mitsuba's picture"
TIERS = {"fast": MECHANICS_FAST, "full": MECHANICS_FULL}
PRESETS = {"fast": FAST_PICTURE, "standard": MITSUBA}
# The difficulties that were set out from, each of which must be in the table.
HARD = (
    "near-incompressible gel", "indentation beyond 60 % of the thickness", "sharp edges and corners",
    "ring and concave contact", "sliding and rolling", "contact at the pad's rim and leaving it",
    "indenter much smaller than an element", "tiny force (1e-6 N)", "tiny depth (0.1 um)", "zero contact",
    "two patches at once", "load step ten times too large", "coarse and fine meshes", "inverted start",
    "drift over an hour", "single precision against double", "grazing light", "thin films and other fluids",
)  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Found:
    """One metric and whether it will do: |value| <= target, or value >= target for ``at_least``.

    words : what was said or seen; broken : invariants that do not hold, in words; one is enough to fail
    """

    value: float
    unit: str
    target: float | None
    at_least: bool = False
    words: str = ""
    broken: tuple[str, ...] = ()


COLLECTED: list[str] = []  # names of all cases, slow ones too
ROWS: dict[str, Row] = {}  # what those that ran have found


def case(
    name: str,
    hard: str | dict[str, str],
    stage: str | dict[str, str],
    expected: str,
    *each: tuple,
    slow: Iterable[str] = (),
) -> Callable[[Callable[..., Found]], Callable[..., None]]:
    """Make a test of a function that finds something; it fails where that misses its target or breaks a law.

    each : its arguments, a case each, which the name is formatted with; hard, stage : or by the first argument that
    they have; slow : names, or arguments, of slow cases; expected : the behaviour, and where the target comes from
    """

    def by(which: str | dict[str, str], args: tuple) -> str:
        return which if isinstance(which, str) else next(which[arg] for arg in args if arg in which)

    def test_of(find: Callable[..., Found]) -> Callable[..., None]:
        cases = {name.format(*args): args for args in each or [()]}
        assert not cases.keys() & {*COLLECTED} and {by(hard, args) for args in cases.values()} <= {*HARD}
        COLLECTED.extend(cases)
        marks = {case: [pytest.mark.slow_case] if {case, *args} & {*slow} else [] for case, args in cases.items()}

        @pytest.mark.parametrize("case", [pytest.param(case, id=case, marks=marks[case]) for case in cases])
        def test(case: str) -> None:
            args = cases[case]
            if by(stage, args) == MITSUBA:
                pytest.importorskip("mitsuba", reason=NO_MITSUBA)
            found = find(*args)
            made = row(case, found.value, found.unit, found.target, of=by(stage, args), at_least=found.at_least)
            words = "; ".join([found.words, *found.broken] if found.words else found.broken)
            ok = bool(made["ok"]) and not found.broken
            ROWS[case] = made | {"ok": ok, "case": by(hard, args), "expected": expected, "words": words}
            assert ok, f"{line(made)} {words}; expected: {expected}"

        return test

    return test_of


def refusal(ask: Callable[[], object], said: str) -> Found:
    """1 where asking raises a TactileError with these words in it, else 0."""
    try:
        ask()
    except TactileError as error:
        return Found(float(said in str(error)), "said", 1.0, at_least=True, words=str(error))
    return Found(0.0, "said", 1.0, at_least=True, words="an answer, without a word")
