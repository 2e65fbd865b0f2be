"""HDF5 with electrode_vals/data (T, 19) and, if present, contact_loc/data, force_vec/data (T, 3), indenter_type/data
(T, ...). Such files hold no time stamps; 100 Hz is assumed, with a warning."""

from __future__ import annotations

from functools import partial

import numpy as np

from ...errors import TactileError
from ..array_store import Store
from ..assemble import assemble
from ..recording import Recording
from . import electrodes_of, share

CONTAINER = "hdf5"
ELECTRODES_NAME = "electrode_vals/data"
NAME = "HDF5 with electrode_vals/data, contact_loc/data, force_vec/data, indenter_type/data"

score = partial(share, wanted=[ELECTRODES_NAME])


def read(store: Store) -> Recording:
    """Return the file's recording; its `about` lists the indenters' numbers. Raises TactileError for other shapes."""
    electrodes = electrodes_of(store, ELECTRODES_NAME)
    frames = len(electrodes)
    return assemble(
        store.path,
        NAME,
        electrodes=electrodes,
        stamps=None,
        about=_indenters(store, frames),
        position=store.optional("contact_loc/data", (frames, 3)),
        force=store.optional("force_vec/data", (frames, 3)),
    )


def _indenters(store: Store, frames: int) -> dict[str, list[float]]:
    """Return {"indenter_types": distinct numbers of the indenters}, empty if the file has none."""
    name = "indenter_type/data"
    if name not in store.shapes:
        return {}
    shape, _ = store.shapes[name]
    if not shape or shape[0] != frames:
        raise TactileError(f"{store.path}, {name}", f"shape {shape}", f"{frames} frames as in {ELECTRODES_NAME}")
    return {"indenter_types": np.unique(store.array(name, (frames, *shape[1:]))).tolist()}
