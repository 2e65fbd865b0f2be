"""Surface compliance of a sensor: what every surface node does under a unit force on each node that can be touched.

Linear elasticity of the whole solid, condensed to its surface once and cached on disk; a contact then needs
only dense sub-blocks. The BioTac's incompressible fluid enters exactly, as a rank-one change.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
import logging
import os
import pathlib

import numpy as np

from .. import atomic, biotac_shape, digit_shape, sensors, surface
from ..errors import TactileError
from ..lattice import Lattice
from ..sensors import Material
from .elasticity import assemble
from .factor import factor
from .hex_mesh import HexMesh, gel_mesh, skin_mesh

log = logging.getLogger(__name__)
_FORMAT = 1  # raise when the meaning of the cached arrays changes

# Skin nodes that can be touched: those that unroll onto the gel or up to this far beside it, m.
_BESIDE_GEL = 2.0e-3


@dataclasses.dataclass(frozen=True)
class Compliance:
    """Answers of a sensor's surface to forces, SI units.

    name : ``"biotac"`` or ``"digit"``
    surface : the sensor's surface lattice, n nodes
    touchable : (m,) int, surface nodes that can carry contact force
    move : (3 m, 3 n) float32, m/N; row 3 i + k is the surface displacement under 1 N along axis k at touchable node i
    watch : (3 m, w) float32, m/N; motion of the watched inner points along their watch directions (BioTac only:
        first the 19 electrode feet, then the inner skin under the pad; toward the core is negative)
    watch_gap : (w,) float64, m, their distance to electrode or core at rest
    pressure : (3 m,) float64, Pa/N, fluid pressure under the same forces (zero for the gel)
    """

    name: str
    surface: Lattice
    touchable: np.ndarray
    move: np.ndarray
    watch: np.ndarray
    watch_gap: np.ndarray
    pressure: np.ndarray


@functools.cache
def biotac_compliance() -> Compliance:
    """The BioTac's skin over incompressible fluid; built in about a minute, then read from the cache."""
    return _cached("biotac", sensors.biotac_surface(), _touchable_skin(), skin_mesh(), sensors.BIOTAC_SKIN)


@functools.cache
def digit_compliance() -> Compliance:
    """The DIGIT's gel; built in about a minute, then read from the cache."""
    lattice = sensors.digit_surface()
    return _cached("digit", lattice, np.arange(len(lattice.rest)), gel_mesh(), sensors.DIGIT_GEL)


def _touchable_skin() -> np.ndarray:
    rolled = surface.unrolled_nodes()
    x, z = rolled.T
    near = (x > digit_shape.X_TIP - _BESIDE_GEL) & (x < digit_shape.X_BASE + _BESIDE_GEL)
    return np.flatnonzero(near & (np.abs(z) < digit_shape.HALF_WIDTH + _BESIDE_GEL))


def cache_folder() -> pathlib.Path:
    """Where matrices are kept: ``$TACTILE_CACHE``, else ``~/.cache/tactile`` (``%LOCALAPPDATA%`` on Windows)."""
    chosen = os.environ.get("TACTILE_CACHE")
    if chosen:
        return pathlib.Path(chosen)
    base = os.environ.get("LOCALAPPDATA") or os.environ.get("XDG_CACHE_HOME")
    return (pathlib.Path(base) if base else pathlib.Path.home() / ".cache") / "tactile"


def _cached(name: str, lattice: Lattice, touchable: np.ndarray, mesh: HexMesh, material: Material) -> Compliance:
    digest = hashlib.sha256(json.dumps([_FORMAT, name, lattice.sha256, dataclasses.asdict(material)]).encode())
    watch, watch_gap = _watched(mesh)
    for array in (np.round(mesh.nodes * 1e9), mesh.cells, mesh.clamped, touchable, np.round(watch * 1e9), watch_gap):
        digest.update(np.ascontiguousarray(array).tobytes())
    folder = cache_folder() / f"compliance-{name}-{digest.hexdigest()[:16]}"
    try:
        loaded = _load(folder)
    except (OSError, ValueError):  # not built yet, or cut short
        log.info("building the compliance of the %s in %s (about a minute, once)", name, folder)
        _claim(folder)
        _store(folder, dict(zip(_ARRAYS, build(mesh, material, touchable, lattice), strict=True)))
        loaded = _load(folder)
    return Compliance(name, lattice, touchable, *loaded)


_ARRAYS = ("move", "watch", "watch_gap", "pressure")


def _load(folder: pathlib.Path) -> list[np.ndarray]:
    return [np.load(folder / f"{array}.npy", mmap_mode="r", allow_pickle=False) for array in _ARRAYS]


def _claim(folder: pathlib.Path) -> None:
    """Find out before the long build whether its result can be kept."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "probe").touch()
        (folder / "probe").unlink()
    except OSError as error:
        found = f"cannot be written ({error.strerror})"
        raise TactileError(folder, found, "a folder for 450 MB", "Name one in TACTILE_CACHE") from error


def _store(folder: pathlib.Path, arrays: dict[str, np.ndarray]) -> None:
    """Write arrays whole or not at all; two processes that build at once write the same bytes."""
    try:
        for name, values in arrays.items():
            with atomic.new_file(folder / f"{name}.npy") as partial, open(partial, "wb") as file:
                np.save(file, values)
    except OSError as error:
        found = f"cannot be written ({error.strerror})"
        raise TactileError(folder, found, "room for 450 MB", "Make room, or name a folder in TACTILE_CACHE") from error


def build(mesh: HexMesh, material: Material, touchable: np.ndarray, lattice: Lattice) -> tuple[np.ndarray, ...]:
    """``move``, ``watch``, ``watch_gap`` and ``pressure`` of a ``Compliance``, from a solid that is even in z.

    touchable : (m,) surface nodes that may carry force. Raises ValueError for a surface without mirror symmetry.
    """
    free = np.repeat(~mesh.clamped, 3)
    place = np.cumsum(free) - 1  # degree of freedom -> row of the reduced system
    solve = factor(assemble(mesh, material)[free][:, free].tocsc())

    def spread(answer: np.ndarray) -> np.ndarray:
        full = np.zeros((len(free), answer.shape[1]))
        full[free] = answer
        return full

    surface_dofs = _dofs(mesh.surface)
    watch, watch_gap = _watched(mesh)  # (3 n_nodes, w)
    move = np.zeros((3 * len(touchable), len(surface_dofs)), np.float32)
    mirror_node = _mirror(lattice)
    done = np.zeros(len(touchable), bool)
    index_of = {int(node): i for i, node in enumerate(touchable)}
    adjoint = spread(solve(watch[free])) if watch.shape[1] else np.zeros((len(free), 0))
    for first in _chunks([i for i, node in enumerate(touchable) if lattice.rest[node, 2] >= -1e-9]):
        dofs = _dofs(mesh.surface[touchable[first]])
        known = ~np.repeat(mesh.clamped[mesh.surface[touchable[first]]], 3)
        load = np.zeros((int(free.sum()), len(dofs)))
        load[place[dofs[known]], np.flatnonzero(known)] = 1.0
        answer = spread(solve(load))[surface_dofs].T
        _put_with_mirror(move, answer, first, touchable, mirror_node, index_of, done)
    if not done.all():
        raise ValueError("the surface is not mirror symmetric: some touchable nodes have no image")
    pressure = np.zeros(3 * len(touchable))
    touch_dofs = _dofs(mesh.surface[touchable])
    watched = adjoint[touch_dofs].astype(np.float64)
    if len(mesh.inner):
        swell = _volume_gradient(mesh)
        under_pressure = spread(solve(swell[free, None]))[:, 0]
        stiffness = 1 / float(swell @ under_pressure)
        pressure = -stiffness * under_pressure[touch_dofs]
        for start in range(0, len(move), 512):  # in blocks: the whole outer product would double the memory
            part = slice(start, start + 512)
            move[part] += np.outer(pressure[part], under_pressure[surface_dofs]).astype(np.float32)
        watched += np.outer(pressure, swell @ adjoint)
    return move, watched.astype(np.float32), watch_gap, pressure


def _dofs(nodes: np.ndarray) -> np.ndarray:
    return (3 * np.asarray(nodes)[:, None] + np.arange(3)).ravel()


def _chunks(items: list[int], size: int = 42):  # noqa: ANN202 (42 nodes: 126 right-hand sides, one batch of the factor)
    for start in range(0, len(items), size):
        yield np.array(items[start : start + size])


def _mirror(lattice: Lattice) -> np.ndarray:
    """Surface node that is the image of each node under z -> -z."""
    keys = np.round(lattice.rest * 1e8).astype(np.int64)
    where = {tuple(key): i for i, key in enumerate(keys)}
    return np.array([where.get((x, y, -z), -1) for x, y, z in keys.tolist()])


def _put_with_mirror(move, answer, first, touchable, mirror_node, index_of, done) -> None:  # noqa: ANN001
    """Store answers (3 k, 3 n) for touchable entries ``first`` and, mirrored in z, for their images."""
    sign = np.array([1.0, 1.0, -1.0])
    for row, i in enumerate(first):
        block = answer[3 * row : 3 * row + 3].reshape(3, -1, 3)
        move[3 * i : 3 * i + 3] = block.reshape(3, -1)
        done[i] = True
        image = index_of.get(int(mirror_node[touchable[i]]))
        if image is not None and image != i:
            flipped = block[:, mirror_node] * sign[:, None, None] * sign
            move[3 * image : 3 * image + 3] = flipped.reshape(3, -1)
            done[image] = True


def _volume_gradient(mesh: HexMesh) -> np.ndarray:
    """d(fluid volume) / d(node) (3 n_nodes,), m2: area vectors of the inner skin that point away from the fluid."""
    inner = biotac_shape.skin_surface("inner")
    corners = inner.rest[inner.faces]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 6
    gradient = np.zeros((len(mesh.nodes), 3))
    for corner in range(3):
        np.add.at(gradient, mesh.inner[inner.faces[:, corner]], -area)  # the faces point into the fluid
    return gradient.ravel()


def _watched(mesh: HexMesh) -> tuple[np.ndarray, np.ndarray]:
    """Weights (3 n_nodes, w) that turn a displacement into the change of each watched gap, and the gaps at rest."""
    if not len(mesh.inner):
        return np.zeros((3 * len(mesh.nodes), 0)), np.zeros(0)
    inner = biotac_shape.skin_surface("inner")
    feet = electrode_feet()
    core_nodes, core_out, core_gap = _over_core(inner)
    weights = np.zeros((len(mesh.nodes), 3, len(feet.gap) + len(core_nodes)))
    for e, (face, barycentric, out) in enumerate(zip(feet.face, feet.weights, feet.outward, strict=True)):
        for node, weight in zip(inner.faces[face], barycentric, strict=True):
            weights[mesh.inner[node], :, e] += weight * out
    columns = len(feet.gap) + np.arange(len(core_nodes))
    weights[mesh.inner[core_nodes], :, columns] = core_out
    return weights.reshape(-1, weights.shape[-1]), np.r_[feet.gap, core_gap]


@dataclasses.dataclass(frozen=True)
class ElectrodeFeet:
    """Where the film over each electrode ends on the inner skin: face, weights, direction (19, 3), gap (19,) m."""

    face: np.ndarray
    weights: np.ndarray
    outward: np.ndarray
    gap: np.ndarray


@functools.cache
def electrode_feet() -> ElectrodeFeet:
    """The nearest point of the resting inner skin to each electrode; gaps 0.49 to 1.76 mm (published: 0.51 to 1.76)."""
    positions = sensors.electrodes()
    face, weights, place = surface.closest_on_triangles(biotac_shape.skin_surface("inner"), positions)
    gap = np.linalg.norm(place - positions, axis=1)
    return ElectrodeFeet(face, weights, (place - positions) / gap[:, None], gap)


_CORE_WATCH_STEP = 2  # every second node along and round: the gap varies slowly


def _over_core(inner: Lattice) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Free inner nodes under the pad that face the core: node, radial direction (n, 3), gap (n,) m."""
    theta = biotac_shape.angles()
    rows, columns = inner.shape
    row, column = np.meshgrid(
        np.arange(0, rows, _CORE_WATCH_STEP), np.arange(0, columns, _CORE_WATCH_STEP), indexing="ij"
    )
    nodes = (row * columns + column)[np.abs(theta[column]) <= biotac_shape.PAD_ANGLE]
    x, y, z = inner.rest[nodes].T
    radius = np.hypot(y - biotac_shape.AXIS_Y, z)
    gap = radius - biotac_shape.core_radius(x, np.arctan2(z, biotac_shape.AXIS_Y - y))
    keep = np.isfinite(gap) & (gap > 0.1e-3)
    outward = np.column_stack([np.zeros(len(x)), y - biotac_shape.AXIS_Y, z]) / radius[:, None]
    return nodes[keep], outward[keep], gap[keep]
