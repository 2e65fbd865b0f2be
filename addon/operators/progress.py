"""Progress of what runs inside an operator, at the mouse pointer."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import bpy


@contextmanager
def shown(context: bpy.types.Context) -> Iterator[Callable[[float], None]]:
    """Return a callback that takes the share done, 0..1."""
    manager = context.window_manager
    manager.progress_begin(0, 100)
    try:
        yield lambda share: manager.progress_update(round(100 * share))
    finally:
        manager.progress_end()
