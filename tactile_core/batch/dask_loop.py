"""The event loop of this process's Dask clients, in a thread that may take its time to start."""

from __future__ import annotations

import asyncio
import functools
import threading
from typing import Any

from ..errors import TactileError

CONFIGURED = "distributed.comm.timeouts.connect"  # Dask's own setting of how long to wait for others, 30 s by itself


def wait() -> float:
    """s to wait for a loop or a scheduler; DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT=120s asks for more."""
    import dask
    import distributed  # noqa: F401 - brings its settings
    from dask.utils import parse_timedelta

    return parse_timedelta(dask.config.get(CONFIGURED))


@functools.cache
def loop() -> Any:
    """A tornado loop that runs in a thread as long as this process.

    Dask starts one by itself, but gives up after 10 s whatever its settings are: too little on a machine that is very
    busy (seen). Raises TactileError where it does not start.
    """
    from tornado.ioloop import IOLoop

    began, found = threading.Event(), []

    async def run() -> None:
        """Tell the loop, then keep it running for good."""
        found.append(IOLoop.current())
        began.set()
        await asyncio.Event().wait()

    threading.Thread(target=asyncio.run, args=(run(),), daemon=True, name="dask loop").start()
    if not began.wait(wait()):
        advice = "Ease the machine, or set DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT=120s"
        raise TactileError("dask", f"its loop has not started after {wait():g} s", "a running thread", advice)
    return found[0]
