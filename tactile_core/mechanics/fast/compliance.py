"""Surface compliance of a sensor: displacement of every surface node by a unit force on each touchable node.

Linear elasticity of the whole solid, condensed to its surface once and cached on disk; a contact then needs
only dense sub-blocks. The BioTac's incompressible fluid enters exactly, as a rank-one change.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
import logging
import pathlib
from typing import NamedTuple

import numpy as np

from ... import sensors
from ...errors import TactileError
from ...files import array_cache, lock
from ...files.array_cache import cache_folder
from ...files.threads import one_thread
from ...geometry.lattice import Lattice
from ...sensors import TARGET, Material
from ...sensors import unrolling as surface
from ..solids.fluid_cavity import FluidCavity
from ..solids.hex_mesh import HexMesh, inner_faces, solid_mesh
from .condense import MirrorSymmetry, axes_of, condense, mirror_nodes
from .sensing_points import ON_PLANE, electrode_feet, facing_nodes, images, sensing_points_of

log = logging.getLogger(__name__)
_FORMAT = 6  # raise when the meaning of the cached arrays changes
_ROOM = "350 MB"

# Skin nodes that can be touched: those that unroll onto the gel or up to this far beside it, m.
_BESIDE_GEL = 2.0e-3


@dataclasses.dataclass(frozen=True)
class Compliance:
    """Answers of a sensor's surface to forces, SI units.

    name : of the sensor
    surface : the sensor's surface lattice, n nodes
    touchable : (m,) int, surface nodes that can carry contact force
    move : (3 r, 3 n) float32, m/N; row 3 i + k is the surface displacement under 1 N along axis k at the i-th of the r
        touchable nodes with z >= 0, and mirrored that under the same force on its image (``answers``)
    watch : (3 m, w) float32, m/N; motion of the inner sensing points along their watch directions (BioTac only:
        first the electrode feet, then the inner skin under the pad and beside it; toward the core is negative)
    watch_gap : (w,) float64, m, their distance to electrode or core at rest
    pressure : (3 m,) float64, Pa/N, fluid pressure under the same forces (zero for the gel)
    inner_move : (w, 3 n) float32, m/N, surface displacement under 1 N at a sensing point along its direction
    inner_watch : (w, w) float32, m/N, motion of the sensing points under the same forces
    inner_pressure : (w,) float64, Pa/N, fluid pressure under them
    feet : how many of the sensing points, the first ones, are electrode feet
    facing : how many after them face the core, which may press on them
    """

    name: str
    surface: Lattice
    touchable: np.ndarray
    move: np.ndarray
    watch: np.ndarray
    watch_gap: np.ndarray
    pressure: np.ndarray
    inner_move: np.ndarray
    inner_watch: np.ndarray
    inner_pressure: np.ndarray
    feet: int = 0
    facing: int = 0

    @functools.cached_property
    def answers(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Row (m,) of ``move`` for each touchable node; (m,) bool, if it is the image's; all mirror images (n,)."""
        image = mirror_nodes(self.surface.rest)
        answered = answered_nodes(self.surface, self.touchable, image)
        mirrored = self.surface.rest[self.touchable, 2] < -ON_PLANE
        return np.searchsorted(answered, np.where(mirrored, image[self.touchable], self.touchable)), mirrored, image


# Arrays of a ``Compliance`` that are computed and cached.
ARRAYS = ("move", "watch", "watch_gap", "pressure", "inner_move", "inner_watch", "inner_pressure")


@functools.cache
def compliance_of(sensor: str) -> Compliance:
    """Return the compliance of a sensor that is there; built in about a minute, then read from the cache."""
    return _cached(_solid(sensor))


class Solid(NamedTuple):
    """Solid from which a compliance is computed; touchable : (m,) surface nodes."""

    name: str
    lattice: Lattice
    touchable: np.ndarray
    mesh: HexMesh
    material: Material


def _solid(sensor: str) -> Solid:
    lattice, material = sensors.sensor_surface(sensor), sensors.describe(sensor).material
    touchable = np.arange(len(lattice.rest)) if sensors.is_gel(sensor) else _touchable_skin(sensor)
    return Solid(sensor, lattice, touchable, solid_mesh(sensor), material)


class Stored(NamedTuple):
    """Cache entry of a sensor's matrices: path, and bytes on disk, 0 before they are built.

    surface, touchable, volume : how many nodes the surface has, can be touched, and the solid has
    """

    folder: pathlib.Path
    bytes: int
    surface: int
    touchable: int
    volume: int


def stored(sensor: str) -> Stored:
    """Return the cache entry of a sensor; builds and loads nothing."""
    solid = _solid(sensor)
    folder = _folder(solid)
    files = [folder / f"{array}.npy" for array in ARRAYS]
    size = sum(file.stat().st_size for file in files) if all(file.is_file() for file in files) else 0
    return Stored(folder, size, len(solid.lattice.rest), len(solid.touchable), len(solid.mesh.nodes))


def _touchable_skin(sensor: str) -> np.ndarray:
    rolled = surface.unrolled_nodes(sensor)
    x, z = rolled.T
    gel = sensors.shape_of(TARGET)
    near = (x > gel.tip_x - _BESIDE_GEL) & (x < gel.base_x + _BESIDE_GEL)
    return np.flatnonzero(near & (np.abs(z) < gel.half_width + _BESIDE_GEL))


def _folder(solid: Solid) -> pathlib.Path:
    """Return the cache's folder, named by all that decides the arrays."""
    name, lattice, touchable, mesh, material = solid
    digest = hashlib.sha256(json.dumps([_FORMAT, name, lattice.sha256, dataclasses.asdict(material)]).encode())
    sensing = sensing_points_of(name, mesh)
    # Rounded, and without a minus before zero, which differ between versions of numpy and scipy.
    places = sensing.rows, sensing.columns, *(np.round(each * 1e9) + 0.0 for each in (sensing.weights, sensing.gap))
    for array in (np.round(mesh.nodes * 1e9), mesh.cells, mesh.clamped, touchable, *places):
        digest.update(np.ascontiguousarray(array).tobytes())
    return cache_folder() / f"compliance-{name}-{digest.hexdigest()[:16]}"


def _cached(solid: Solid) -> Compliance:
    """Read the matrices, checked against the hashes of when they were built; build them where they are not there."""
    name, lattice, touchable, mesh, _ = solid
    folder = _folder(solid)
    try:
        loaded = array_cache.load(folder, ARRAYS)
    except array_cache.DamagedError:  # not built yet, perhaps by a process that is at it now
        array_cache.claim(folder, _ROOM)
        with lock.awaited(folder.with_name(f".{folder.name}.lock")):
            loaded = _built(solid, folder)
    counts = (len(electrode_feet(name).gap), len(facing_nodes(name, mesh))) if len(mesh.inner) else (0, 0)
    return Compliance(name, lattice, touchable, **loaded, feet=counts[0], facing=counts[1])


def _built(solid: Solid, folder: pathlib.Path) -> dict[str, np.ndarray]:
    """Return what another process built while this one waited, or build it."""
    try:
        return array_cache.load(folder, ARRAYS)
    except array_cache.DamagedError as damage:
        if (folder / array_cache.HASHES).exists():
            log.warning("%s: damaged (%s); it is built again", folder, damage)
    log.warning("building the compliance of the %s in %s: about a minute, once", solid.name, folder)
    with one_thread():  # what one process keeps, every other computes with
        array_cache.store(folder, build(solid), _ROOM)
    return array_cache.load(folder, ARRAYS)


def build(solid: Solid) -> dict[str, np.ndarray]:
    """Compute the ``ARRAYS`` of a ``Compliance``, by name, from a solid that is even in z.

    Raises ValueError for a solid without mirror symmetry or held nowhere, TactileError where the memory does not
    suffice.
    """
    name, lattice, touchable, mesh, material = solid
    sensing = sensing_points_of(name, mesh)
    source, mirrored = images(name, mesh, len(sensing.gap))
    kept = np.unique(source)
    loads = sensing.dense(3 * len(mesh.nodes), kept)
    column, sign = np.searchsorted(kept, source), np.where(mirrored, -1.0, 1.0)
    if len(mesh.inner):
        loads = np.column_stack([loads, _volume_gradient(mesh)])
        column, sign = np.r_[column, len(kept)], np.r_[sign, 1.0]
    half = np.flatnonzero(lattice.rest[:, 2] >= -ON_PLANE)
    try:
        even, odd = (condense(mesh, material, mesh.surface[half], loads, parity) for parity in (1, -1))
        image = mirror_nodes(lattice.rest)
        place, answered = MirrorSymmetry(half, image), answered_nodes(lattice, touchable, image)
        move = place.forces(even.answer, odd.answer, answered)
        inner_move = place.loads(even.under_loads, odd.under_loads, column, sign)
        every = np.ix_(column, column)
        among = even.among[every] + odd.among[every] * np.outer(sign, sign)
        inner_pressure, pressure = np.zeros(len(sensing.gap)), np.zeros(3 * len(touchable))
        touch_dofs = axes_of(touchable)
        if len(mesh.inner):  # the fluid keeps its volume: its pressure is one more force, and takes one more row away
            swell, stiffness = inner_move[-1], 1 / among[-1, -1]
            inner_pressure, pressure = -stiffness * among[-1, :-1], -stiffness * swell[touch_dofs]
            on_answered = -stiffness * swell[axes_of(answered)]
            for start in range(0, len(move), 512):  # in blocks: the whole outer product would double the memory
                part = slice(start, start + 512)
                move[part] += np.outer(on_answered[part], swell).astype(np.float32)
            inner_move = inner_move[:-1] + np.outer(inner_pressure, swell)
            among = among[:-1, :-1] + np.outer(inner_pressure, among[-1, :-1])
        watch = np.ascontiguousarray(inner_move[:, touch_dofs].T, np.float32)
    except MemoryError as error:
        raise TactileError("compliance", "out of memory", "2.2 GB of free memory", "Close other programs") from error
    inner = inner_move.astype(np.float32), among.astype(np.float32), inner_pressure
    return dict(zip(ARRAYS, (move, watch, sensing.gap, pressure, *inner), strict=True))


def answered_nodes(lattice: Lattice, touchable: np.ndarray, image: np.ndarray) -> np.ndarray:
    """Surface nodes (r,) with z >= 0 whose responses also serve their mirror images: one for every touchable node."""
    return np.unique(np.where(lattice.rest[touchable, 2] >= -ON_PLANE, touchable, image[touchable]))


def _volume_gradient(mesh: HexMesh) -> np.ndarray:
    """Gradient d(fluid volume) / d(node) (3 n_nodes,), m2, at rest."""
    return FluidCavity(inner_faces(mesh), len(mesh.nodes)).gradient(mesh.nodes)
