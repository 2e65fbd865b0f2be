"""The model card: sizes and tensors of its networks, their sensors, their errors on held-out presses, error bounds.

A bound is a factor on the expected error that covers the largest error of 95 of 100 contacts. It is found by split
conformal prediction in groups with the ratio of the errors as score (Lei et al. 2018, section 5.2; Vovk 2012). The
groups are regions along the finger: one factor for all gave bounds that were too wide over the electrodes and too
narrow beyond them. Results without contact are a group whose score is the error itself: nearly all are right to a
micrometre, so a ratio to the expected error says nothing about the few that missed a light touch. Parameters called
``where`` or ``path`` name the card's file in errors."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .. import sensors
from ..errors import TactileError
from ..sensors import ELECTRODES, PAIR, descriptor
from .layers import DISTANCES, plain_shapes, residual_shapes
from .weights import ADVICE

SIGNAL_HIDDEN = (256, 128, 64)  # the published SVB's (docs/sources.md, Networks)
PLACE = 2  # numbers of a mesh's latent that are the place of its dent
STATE = PLACE + 2  # numbers of a contact's state: the place of the gel's dent, on asinh scales its force and depth
SURFACES = PAIR
ERROR_FEATURES = 3  # beside the latent: what SVB leaves, how large the signal is, whether it is rectified
NETS = ("SVB", "MVB", "S2MPN", "R2MPN", "MVD", "M2MPN", "D2BPN", "B2SPN", "force", "pressure", "error")
PARTS = "parts"  # the network that tells two contacts apart, which weights may lack
POSTERIORS = ("S2MPN", "R2MPN")
MAX_SIZE = 100_000  # of anything in a card: larger than any network here, small enough to refuse a damaged number


def tensor_shapes(net: str, sizes: dict[str, int], electrodes: int = ELECTRODES) -> dict[str, tuple[int, ...]]:
    """Return the shapes, by name, of network `net`'s tensors. sizes : the net's in the card; electrodes : how many it
    reads"""
    if net == "SVB":
        latent, hidden = sizes["latent"], SIGNAL_HIDDEN
        shapes = plain_shapes("encoder", (electrodes + 1, *hidden, 2 * latent))
        shapes |= plain_shapes("decoder", (latent, *hidden[::-1], electrodes))
        shapes |= {"distance.mean": (latent,), "distance.whitening": (latent, latent)}
        return shapes | {"distance.residual": (electrodes,)}
    width, blocks = sizes["width"], sizes["blocks"]
    if net in POSTERIORS:
        shapes = residual_shapes("posterior", sizes["inputs"], sizes["components"] * (1 + 2 * STATE), width, blocks)
        return shapes | residual_shapes("code", sizes["inputs"] + STATE, sizes["outputs"], width, blocks)
    if net in ("MVB", "MVD"):
        wide, near, latent, window = sizes["wide"], sizes["near"], sizes["latent"], (2 * sizes["half"] + 1) ** 2
        shapes = residual_shapes("encoder", wide + near + 2 * PLACE, 2 * (latent - PLACE), width, blocks)
        shapes |= residual_shapes("decoder", latent + PLACE, wide + near, width, blocks)
        shapes |= {"wide": (wide, 3 * sizes["nodes"]), "near": (near, 3 * window)}
        return shapes | {"scale": (wide + near,), "turn": (sizes["nodes"],)}
    shapes = residual_shapes("map", sizes["inputs"], sizes["outputs"], width, blocks)
    own = {"pressure": "rectified", PARTS: "single"}.get(net)
    return shapes | {own: (1,)} if own else shapes


_MESH = ("blocks", "columns", "half", "latent", "near", "nodes", "rows", "wide", "width")
_MAP = ("blocks", "inputs", "outputs", "width")
_OWN = {"SVB": ("latent",), "MVB": _MESH, "MVD": _MESH} | dict.fromkeys(POSTERIORS, ("components", *_MAP))
SIZE_NAMES = {net: _OWN.get(net, _MAP) for net in (*NETS, PARTS)}


def card_entry(card: dict, net: str, path: Path) -> dict:
    """Return the card's entry for the network `net`: sha256 and sizes. Raises TactileError if it is incomplete."""
    nets = card.get("nets")
    entry: Any = nets.get(net) if isinstance(nets, dict) else None
    sizes: Any = entry.get("sizes") if isinstance(entry, dict) else None
    names = SIZE_NAMES[net]
    whole = isinstance(sizes, dict) and sorted(sizes) == sorted(names)
    whole = whole and all(type(size) is int and 0 <= size <= MAX_SIZE for size in sizes.values())
    if not whole or not isinstance(entry.get("sha256"), str):
        expected = f"sha256 and the sizes {', '.join(names)} as whole numbers"
        raise TactileError(f"{path}, nets.{net}", "an incomplete entry", expected, ADVICE)
    if "rows" in sizes and not 0 < sizes["rows"] * sizes["columns"] <= sizes["nodes"]:
        found = f"a lattice of {sizes['rows']} x {sizes['columns']} in {sizes['nodes']} nodes"
        raise TactileError(f"{path}, nets.{net}", found, "a lattice among the nodes", ADVICE)
    return entry


def check_chain(sizes: dict[str, dict[str, int]], path: Path, electrodes: int = ELECTRODES) -> None:
    """Raise TactileError if networks do not fit together: networks that share a latent must agree on its size.
    sizes : of the card, by network and name; electrodes : how many are read"""
    links = [
        ("S2MPN", "inputs", sizes["SVB"]["latent"]),
        ("S2MPN", "outputs", sizes["MVB"]["latent"]),
        ("R2MPN", "inputs", sizes["SVB"]["latent"]),
        ("R2MPN", "outputs", sizes["MVB"]["latent"]),
        ("R2MPN", "components", sizes["S2MPN"]["components"]),
        ("M2MPN", "inputs", sizes["MVB"]["latent"] + PLACE),
        ("M2MPN", "outputs", sizes["MVD"]["latent"]),
        ("D2BPN", "inputs", sizes["MVD"]["latent"] + PLACE),
        ("D2BPN", "outputs", sizes["MVB"]["latent"]),
        ("B2SPN", "inputs", sizes["MVB"]["latent"] + PLACE),
        ("B2SPN", "outputs", sizes["SVB"]["latent"]),
        ("error", "inputs", sizes["SVB"]["latent"] + ERROR_FEATURES),
        ("error", "outputs", len(SURFACES)),
        ("force", "inputs", sizes["MVB"]["latent"]),
        ("force", "outputs", 3),
        ("pressure", "inputs", electrodes),
        ("pressure", "outputs", 1),
        (PARTS, "inputs", 2 * electrodes),
        (PARTS, "outputs", electrodes + 1),
    ]
    for net, size, expected in (link for link in links if link[0] in sizes):
        if sizes[net][size] != expected:
            raise TactileError(f"{path}, nets.{net}", f"{size} {sizes[net][size]}", f"{expected}", ADVICE)


DOUBT = "doubt"  # in a card: a sentence on what was not checked on real sensors
REST = "rest_counts"  # in a card: counts at rest of the unit whose changes it takes, if the sensor's table has none

ROW, SET = "chain_rms_um", "test presses"  # BioTac signals to the gel's displacement, rms over its nodes
WORSE = 0.8  # error over that of zero displacement, above which weights hardly translate (assumed)


def pair_of(card: dict[str, Any], where: str | os.PathLike) -> tuple[str, str]:
    """Return the sensor that is read and the gel that is translated to. Raises TactileError if the card has no such
    two."""
    return descriptor.pair_of(card, where, "networks", "") or PAIR


def chain_error(card: Mapping[str, Any]) -> tuple[float, float] | None:
    """Return the rms error, um, of the translated gel on held-out presses, and that of predicting no displacement
    (baseline); None for a card without that row."""
    rows = card.get("errors")
    for row in rows if isinstance(rows, list) else []:
        if isinstance(row, dict) and (row.get("name"), row.get("set")) == (ROW, SET):
            value, baseline = row.get("value"), row.get("baseline")
            if isinstance(value, int | float) and isinstance(baseline, int | float):
                return float(value), float(baseline)
    return None


def doubt(card: Mapping[str, Any]) -> str:
    """Return the card's own doubt (``DOUBT``), else a sentence if the weights are worse or hardly better than none, or
    ""."""
    if isinstance(card.get(DOUBT), str):
        return card[DOUBT]
    found = chain_error(card)
    if found is None or found[0] <= WORSE * found[1]:
        return ""
    judged = "worse" if found[0] > found[1] else "hardly better"
    return (
        f"these weights are {judged} than none: off by {found[0]:.3g} um (rms of the gel) on held-out presses from"
        f" their training, where no displacement at all is off by {found[1]:.3g} um: train on more pairs, or longer"
    )


def silent_level(silence: dict[str, list[float]], quantity: str) -> float:
    """Return what 99 % of translated frames of noise stay below; silence : the card's; quantity : biotac_m, digit_m,
    force_N"""
    return float(np.interp(0.99, silence["levels"], silence[quantity]))


LEVEL = 0.95  # share of frames whose error the bound covers
EDGES = (-14e-3, -8e-3, -2e-3)  # m, x of the contact's middle: tip, first and last electrodes, base (assumed)
REGIONS = len(EDGES) + 2  # results without contact first
FEWEST = 100  # contacts in a region; with fewer the factor of all contacts is used (assumed)
KINDS = ("signed", "rectified")


def region(x: np.ndarray) -> np.ndarray:
    """Return the region (T,) int along the finger of each contact: 0 without contact, else 1 (tip) to REGIONS - 1
    (base). x : (T,) m, place along the finger, NaN without contact"""
    return np.where(np.isnan(x), 0, 1 + np.searchsorted(EDGES, x, side="right"))


def fit_bounds(error: np.ndarray, expected: np.ndarray, x: np.ndarray) -> list[float]:
    """Fit the bounds of all REGIONS, four digits each: first a length in m, for results without contact, then factors
    on the expected error. Each covers LEVEL of the contacts in its region.
    error, expected : (C,) m, the largest node error and its estimate; x : (C,) m, place along the finger"""
    ratio, where = error / expected, region(x)
    scores = [error, *[ratio] * (REGIONS - 1)]
    parts = [score[where == each] for each, score in enumerate(scores)]
    return [_quantile(part if len(part) >= FEWEST else every) for part, every in zip(parts, scores, strict=True)]


def _quantile(score: np.ndarray) -> float:
    return float(f"{np.quantile(score, min(1.0, LEVEL * (1 + 1 / len(score)))):.4g}")


def error_bound(expected: np.ndarray, x: np.ndarray, numbers: list[float]) -> np.ndarray:
    """Return the bound (T,) float32 m that 95 of 100 largest errors stay below: expected error times the number of the
    region (without contact the number itself, m). expected : (T,) m; x : (T,) m or NaN; numbers : of `fit_bounds`"""
    where = region(x)
    return np.where(where == 0, numbers[0], np.asarray(numbers)[where] * expected).astype(np.float32)


def check_tables(card: dict[str, Any], where: str) -> None:
    """Raise TactileError unless a card has bounds, and rising quantiles, one per level, of distance and silence."""
    _check_table(card.get("silence"), ("biotac_m", "digit_m", "force_N"), f"{where}, silence")
    distance: Any = card.get("distance") if isinstance(card.get("distance"), dict) else {}
    for kind in KINDS:
        table: Any = distance.get(kind) if isinstance(distance.get(kind), dict) else {}
        _check_table({"levels": distance.get("levels"), **table}, DISTANCES, f"{where}, distance.{kind}")
    check_bounds(card, where)


def _check_table(table: Any, names: tuple[str, ...], where: str) -> None:
    levels: Any = table.get("levels") if isinstance(table, dict) else None
    for name in ("levels", *names):
        values: Any = table.get(name) if isinstance(table, dict) else None
        if not (_grows(values) and len(values) == len(levels)):
            expected = "as many growing, finite numbers as levels"
            raise TactileError(f"{where}.{name}", f"{values!r:.80}", expected, ADVICE)


def _grows(values: Any) -> bool:
    numbers = isinstance(values, list) and len(values) > 0 and all(type(v) in (int, float) for v in values)
    return numbers and all(0 <= v <= sys.float_info.max for v in values) and values == sorted(values)


def check_pair(card: dict[str, Any], source: str | None, target: str | None, where: str) -> None:
    """Raise TactileError unless a card's networks translate from `source` to `target` (None: any)."""
    if target is not None:
        sensors.shape_of(target)  # raises for a name that is none, and for a sensor without a gel
    known = pair_of(card, where)
    if source not in (None, known[0]):
        advice = "`tactile convert` takes them, with recordings of that sensor"
        expected = f"networks that translate recordings of {source}"
        raise TactileError(where, f"networks of {' and '.join(known)}", expected, advice)
    if target not in (None, known[1]):
        advice = "Train some (docs/extend.md), or solve the gel under the contact that these find: --gel solved"
        raise TactileError(where, f"networks of {' and '.join(known)}", f"networks that translate to {target}", advice)


def check_bounds(card: Mapping[str, object], where: str) -> None:
    """Raise TactileError unless the card has REGIONS positive error bounds for each surface and kind of signals."""
    bounds = card.get("error_bounds")
    for kind in KINDS:
        for name in SURFACES:
            kinds = bounds.get(kind) if isinstance(bounds, dict) else None
            value = kinds.get(name) if isinstance(kinds, dict) else None
            if not (isinstance(value, list) and len(value) == REGIONS and all(map(_is_factor, value))):
                entry = f"{where}, error_bounds.{kind}.{name}"
                raise TactileError(entry, f"{value!r:.80}", f"{REGIONS} numbers above 0, one a place", ADVICE)


def _is_factor(value: Any) -> bool:
    return type(value) in (int, float) and 0 < value < 1e6
