"""A hard case: what is asked, of which stage, what is expected in words, and what was found."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

from tactile_core.accuracy import Row, row
from tactile_core.errors import TactileError

MECHANICS_FAST, MECHANICS_FULL = "mechanics, fast tier", "mechanics, full tier"
TRANSLATION, HEIGHT_MAP = "translation", "height map"
FAST_PICTURE, MITSUBA = "fast picture", "Mitsuba's picture"


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

    hard : the difficulty, by a name of ``table.HARD``
    expected : the behaviour, and where the target comes from; slow : not in a quick run
    limit : why it is known to miss; "" where it must not
    """

    name: str
    hard: str
    stage: str
    expected: str
    find: Callable[[], Found]
    slow: bool = False
    limit: str = ""

    def row(self) -> Row:
        """What was found, as a row of a report, with its words."""
        found = self.find()
        made = row(self.name, found.value, found.unit, found.target, of=self.stage, at_least=found.at_least)
        made["ok"] = bool(made["ok"]) and not found.broken
        words = "; ".join([found.words, *found.broken] if found.words else found.broken)
        return made | {"case": self.hard, "expected": self.expected, "words": words, "limit": self.limit}


CASES: list[Case] = []


def case(
    name: str, hard: str, stage: str, expected: str, *, slow: bool = False, limit: str = ""
) -> Callable[[Callable[[], Found]], Callable[[], Found]]:
    """Add a function that finds something to the table."""

    def add(find: Callable[[], Found]) -> Callable[[], Found]:
        CASES.append(Case(name, hard, stage, expected, find, slow, limit))
        return find

    return add


def refusal(ask: Callable[[], object], said: str) -> Found:
    """1 where asking raises a TactileError with these words in it, else 0."""
    try:
        ask()
    except TactileError as error:
        return Found(float(said in str(error)), "said", 1.0, at_least=True, words=str(error))
    return Found(0.0, "said", 1.0, at_least=True, words="an answer, without a word")
