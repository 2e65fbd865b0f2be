"""A hard case: what is asked, of which stage, what is expected in words, and what was found."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Iterable

from tactile_core.accuracy import Row, row
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
    "saturated electrodes", "dead electrodes", "12-bit quantisation", "drift over an hour", "out-of-range latents",
    "single precision against double", "extreme px/mm", "grazing light", "depth discontinuities",
    "one-frame recordings",
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


@dataclasses.dataclass(frozen=True)
class Case:
    """One hard case of one stage.

    hard : the difficulty, one of HARD; expected : the behaviour, and where the target comes from
    slow : not in a quick run
    """

    name: str
    hard: str
    stage: str
    expected: str
    find: Callable[[], Found]
    slow: bool = False

    def row(self) -> Row:
        """What was found, as a row of a report, with its words."""
        found = self.find()
        made = row(self.name, found.value, found.unit, found.target, of=self.stage, at_least=found.at_least)
        made["ok"] = bool(made["ok"]) and not found.broken
        words = "; ".join([found.words, *found.broken] if found.words else found.broken)
        return made | {"case": self.hard, "expected": self.expected, "words": words}


CASES: list[Case] = []


def case(
    name: str,
    hard: str | dict[str, str],
    stage: str | dict[str, str],
    expected: str,
    *each: tuple,
    slow: Iterable[str] = (),
) -> Callable[[Callable[..., Found]], Callable[..., Found]]:
    """Add a function that finds something to the table.

    each : its arguments, a case each, which the name is formatted with; hard, stage : or by the first argument that
    they have; slow : names, or arguments, of slow cases
    """

    def by(which: str | dict[str, str], args: tuple) -> str:
        return which if isinstance(which, str) else next(which[arg] for arg in args if arg in which)

    def add(find: Callable[..., Found]) -> Callable[..., Found]:
        for args in each or [()]:
            made = name.format(*args), by(hard, args), by(stage, args), expected, functools.partial(find, *args)
            CASES.append(Case(*made, slow=bool({made[0], *args} & {*slow})))
        return find

    return add


def refusal(ask: Callable[[], object], said: str) -> Found:
    """1 where asking raises a TactileError with these words in it, else 0."""
    try:
        ask()
    except TactileError as error:
        return Found(float(said in str(error)), "said", 1.0, at_least=True, words=str(error))
    return Found(0.0, "said", 1.0, at_least=True, words="an answer, without a word")
