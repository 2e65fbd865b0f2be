"""The card of a file of paired contacts: its counts, hash and histograms, small enough to keep beside the code."""

from __future__ import annotations

import json
import os
import pathlib

import numpy as np

from ..files.provenance import sha256
from ..sensors import SOURCE, TARGET

_DEPTHS_MM = (0, 0.05, 0.1, 0.2, 0.3, 0.45, 0.6, 0.9, 1.2, 1.6, 2.0, 2.4)
_FORCES_N = (0, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100)
_X_MM, _Z_MM = tuple(range(-21, 7, 3)), tuple(range(-10, 11, 4))
_TILTS_DEG = tuple(range(0, 46, 5))


def card(path: str | os.PathLike, source: str = SOURCE, target: str = TARGET) -> dict:
    """Return counts, hash and histograms of a file of pairs; without its name, which its maker chooses."""
    import h5py

    with h5py.File(path) as file:
        values = {name: file[name][()] for name in (*_READ, f"depth_{source}", f"depth_{target}", f"beyond_{target}")}
        names = json.loads(file.attrs["indenters"])
        attributes = {name: _plain(file.attrs[name]) for name in ("scene", "seed", "version", "electrodes")}
    force = np.linalg.norm(values["force"], axis=1)
    x, z, tilt, _ = values["place"].T
    places, _, _ = np.histogram2d(1e3 * x, 1e3 * z, bins=(_X_MM, _Z_MM))
    return {
        **attributes,
        "sha256": sha256(path),
        "contacts": len(force),
        "presses": len(np.unique(values["press"])),
        "contacts_by_indenter": {name: int((values["indenter"] == i).sum()) for i, name in enumerate(names)},
        "contacts_sliding": int(values["slide"].any(axis=1).sum()),
        f"contacts_beyond_{target}": int(values[f"beyond_{target}"].sum()),
        f"depth_{source}_mm": _histogram(1e3 * values[f"depth_{source}"], _DEPTHS_MM),
        f"depth_{target}_mm": _histogram(1e3 * values[f"depth_{target}"], _DEPTHS_MM),
        "force_n": _histogram(force, _FORCES_N),
        "tilt_deg": _histogram(np.degrees(tilt), _TILTS_DEG),
        "place_mm": {"x_edges": list(_X_MM), "z_edges": list(_Z_MM), "counts": places.astype(int).tolist()},
    }  # fmt: skip


def card_path(path: str | os.PathLike) -> pathlib.Path:
    """Return the path of the card of a file of pairs: ``<file>.card.json``."""
    path = pathlib.Path(path)
    return path.with_name(path.name + ".card.json")


_READ = ("force", "place", "slide", "press", "indenter")


def _histogram(values: np.ndarray, edges: tuple[float, ...]) -> dict[str, list]:
    """Counts between edges; what lies beyond the last counts in the last."""
    counts, _ = np.histogram(np.clip(values, edges[0], edges[-1]), edges)
    return {"edges": list(edges), "counts": counts.tolist()}


def _plain(value: object) -> object:
    return value.item() if isinstance(value, np.generic) else value
