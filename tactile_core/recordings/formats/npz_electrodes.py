"""NPZ with electrodes (T, 19); time, pdc, tac, tdc (T,), pac (T, P), position and force (T, 3) are optional."""

from __future__ import annotations

from functools import partial
from typing import Any

from ..array_store import Store
from ..assemble import assemble
from ..recording import Recording
from . import electrodes_of, share

CONTAINER = "npz"
NAME = "NPZ with electrodes (T, 19), optional time, pdc, tac, tdc, pac, position, force"

score = partial(share, wanted=["electrodes"])


def read(store: Store) -> Recording:
    """Return the file's recording. Raises TactileError for arrays of other shapes."""
    electrodes = electrodes_of(store, "electrodes")
    frames = len(electrodes)
    columns: dict[str, Any] = {name: store.optional(name, (frames,)) for name in ("pdc", "tac", "tdc")}
    columns |= {name: store.optional(name, (frames, 3)) for name in ("position", "force")}
    if "pac" in store.shapes:
        columns["pac"] = store.array("pac", (frames, *store.shapes["pac"][0][1:2]))
    return assemble(store.path, NAME, electrodes=electrodes, stamps=store.optional("time", (frames,)), **columns)
