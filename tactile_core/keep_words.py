"""Outputs as a user asks for them in one text: ``--keep electrodes,image``."""

from __future__ import annotations

from .errors import TactileError


def parse(text: str | None, known: tuple[str, ...], least: int = 1) -> tuple[str, ...]:
    """``"image,electrodes"`` as known words, in their order; None: all.

    Raises TactileError for other words, or fewer than ``least``.
    """
    words = known if text is None else [word.strip() for word in text.split(",") if word.strip()]
    for word in words:
        if word not in known:
            raise TactileError("--keep", repr(word), f"words out of {', '.join(known)}", "Separate them by commas")
    if len(words) < least:
        raise TactileError("--keep", "nothing", f"one or more of {', '.join(known)}")
    return tuple(word for word in known if word in words)
