"""Check the networks' sizes in a card, and derive the names and shapes of their tensors."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..errors import TactileError
from ..sensors import ELECTRODES, PAIR
from .layers import plain_shapes, residual_shapes
from .weights import ADVICE

SIGNAL_HIDDEN = (256, 128, 64)  # the published SVB's (docs/sources.md, Networks)
PLACE = 2  # numbers of a mesh's latent that are the place of its dent
STATE = PLACE + 2  # numbers of a contact's state: the place of the gel's dent, on asinh scales its force and depth
SURFACES = PAIR
ERROR_FEATURES = 3  # beside the latent: what SVB leaves, how large the signal is, whether it is rectified
NETS = ("SVB", "MVB", "S2MPN", "R2MPN", "MVD", "M2MPN", "D2BPN", "B2SPN", "force", "pressure", "error")
POSTERIORS = ("S2MPN", "R2MPN")
MAX_SIZE = 100_000  # of anything in a card: larger than any network here, small enough to refuse a damaged number


def tensor_shapes(net: str, sizes: dict[str, int], electrodes: int = ELECTRODES) -> dict[str, tuple[int, ...]]:
    """Return the tensor names and shapes of one network from the sizes in its card; electrodes : how many are read."""
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
    return shapes | {"rectified": (1,)} if net == "pressure" else shapes


_MESH = ("blocks", "columns", "half", "latent", "near", "nodes", "rows", "wide", "width")
_MAP = ("blocks", "inputs", "outputs", "width")
_OWN = {"SVB": ("latent",), "MVB": _MESH, "MVD": _MESH} | dict.fromkeys(POSTERIORS, ("components", *_MAP))
SIZE_NAMES = {net: _OWN.get(net, _MAP) for net in NETS}


def card_entry(card: dict, net: str, path: Path) -> dict:
    """Return the card's entry for one network: its sha256 and sizes."""
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
    """Check that the networks fit together: each latent's size is the same in all networks that share it."""
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
    ]
    for net, size, expected in links:
        if sizes[net][size] != expected:
            raise TactileError(f"{path}, nets.{net}", f"{size} {sizes[net][size]}", f"{expected}", ADVICE)
