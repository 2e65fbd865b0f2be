"""One file a layout. Each module here is found by itself and has four names:

``CONTAINER``  "csv", "hdf5", "npz" or "bag"
``NAME``       the layout in words, for messages
``score(keys) -> float``  share (0..1) of the layout's own columns or arrays among those of the file
``read(source) -> Recording``  source is a ``table.Table`` for CSV, a ``store.Store`` for HDF5 and NPZ;
               it picks its columns and hands them to ``assemble.assemble``, which checks them.
Those of bags have no ``read``, but the message they know: see ``bag_biotac_hand``. Those of HDF5 have
``ELECTRODES_NAME`` too, the array whose length is the number of frames: see ``parts``.
"""

from __future__ import annotations

from collections.abc import Collection


def share(keys: Collection[str], wanted: Collection[str]) -> float:
    """Share of the wanted names that are among the keys."""
    return sum(name in keys for name in wanted) / len(wanted)
