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
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ... import sensors
from ...errors import TactileError
from ...files import array_cache, lock
from ...files.array_cache import cache_folder
from ...files.shipped import shipped
from ...files.threads import in_one_thread
from ...geometry.lattice import Lattice
from ...sensors import TARGET, Material
from ...sensors import unrolling as surface
from ..solids.fluid_cavity import FluidCavity
from ..solids.hex_mesh import HexMesh, inner_faces, solid_mesh
from .compact_halves import unpack
from .condense import Half, MirrorSymmetry, axes_of, condense, mirror_nodes
from .sensing_points import ON_PLANE, electrode_feet, facing_nodes, images, sensing_points_of

log = logging.getLogger(__name__)
_FORMAT = 7  # raise when the meaning of the cached arrays changes, or the files that ship
_ROOM = "350 MB"

# Skin nodes that can be touched: those that unroll onto the gel or up to this far beside it, m.
_BESIDE_GEL = 2.0e-3


@dataclasses.dataclass(frozen=True)
class Compliance:
    """Response of a sensor's surface to forces, SI units.

    name : of the sensor
    surface : the sensor's surface lattice, n nodes
    touchable : (m,) int, surface nodes that can carry contact force
    move : (3 r, 3 n) float32, m/N; row 3 i + k is the displacement of all surface nodes under 1 N along axis k at the
        i-th of r nodes with z >= 0, from which mirror symmetry gives all touchable ones (``answers``)
    watch : (3 m, w) float32, m/N; motion of the w sensing points of the inner skin, each along its own direction
        (negative toward the core), under 1 N along each axis at each touchable node. BioTac only: first the points
        under the electrodes, then inner skin that faces the core, then inner skin beside it
    watch_gap : (w,) float64, m, their distance to electrode or core at rest
    pressure : (3 m,) float64, Pa/N, fluid pressure under the same forces (zero for the gel)
    inner_move : (w, 3 n) float32, m/N, surface displacement under 1 N at a sensing point along its direction
    inner_watch : (w, w) float32, m/N, motion of the sensing points under the same forces at these points
    inner_pressure : (w,) float64, Pa/N, fluid pressure under them
    feet : how many of the sensing points, the first ones, lie under electrodes
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

    def __deepcopy__(self, memo: dict) -> Compliance:
        return self  # hundreds of megabytes that nobody writes to

    @functools.cached_property
    def answers(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return how ``move`` answers for each touchable node: the number i (m,) of the node whose rows apply, and true
        (m,) if it is that node's mirror image; and the index (n,) of each surface node's mirror image."""
        image = mirror_nodes(self.surface.rest)
        answered = answered_nodes(self.surface, self.touchable, image)
        mirrored = self.surface.rest[self.touchable, 2] < -ON_PLANE
        return np.searchsorted(answered, np.where(mirrored, image[self.touchable], self.touchable)), mirrored, image


# Arrays of a ``Compliance`` that are computed and cached.
ARRAYS = ("move", "watch", "watch_gap", "pressure", "inner_move", "inner_watch", "inner_pressure")


@functools.cache
def compliance_of(sensor: str) -> Compliance:
    """Return the compliance of a sensor, by its name: read from the cache, or made and kept there at first use."""
    return _cached(solid_of(sensor))


class Solid(NamedTuple):
    """Solid from which a compliance is computed.
    name : of the sensor; lattice : its surface; mesh : its volume
    touchable : (m,), the surface's nodes that may carry contact force"""

    name: str
    lattice: Lattice
    touchable: np.ndarray
    mesh: HexMesh
    material: Material


def solid_of(sensor: str) -> Solid:
    """Return the solid of a sensor, by its name."""
    lattice, material = sensors.sensor_surface(sensor), sensors.describe(sensor).material
    touchable = np.arange(len(lattice.rest)) if sensors.is_gel(sensor) else _touchable_skin(sensor)
    return Solid(sensor, lattice, touchable, solid_mesh(sensor), material)


class Stored(NamedTuple):
    """Cache entry of a sensor's matrices: ``folder``, and ``bytes`` on disk, 0 before they are built.

    surface, touchable, volume : numbers of nodes: on the surface, that may be touched, in the solid"""

    folder: pathlib.Path
    bytes: int
    surface: int
    touchable: int
    volume: int


def stored(sensor: str) -> Stored:
    """Return the cache entry of a sensor's matrices, built or not; builds and loads nothing."""
    solid = solid_of(sensor)
    folder = cache_entry(solid)
    files = [folder / f"{array}.npy" for array in ARRAYS]
    size = sum(file.stat().st_size for file in files) if all(file.is_file() for file in files) else 0
    return Stored(folder, size, len(solid.lattice.rest), len(solid.touchable), len(solid.mesh.nodes))


def _touchable_skin(sensor: str) -> np.ndarray:
    rolled = surface.unrolled_nodes(sensor)
    x, z = rolled.T
    gel = sensors.shape_of(TARGET)
    near = (x > gel.tip_x - _BESIDE_GEL) & (x < gel.base_x + _BESIDE_GEL)
    return np.flatnonzero(near & (np.abs(z) < gel.half_width + _BESIDE_GEL))


def cache_entry(solid: Solid) -> pathlib.Path:
    """Return the cache folder of a solid's matrices, made or not; its name holds a hash of all that decides them."""
    name, lattice, touchable, mesh, material = solid
    digest = hashlib.sha256(json.dumps([_FORMAT, name, lattice.sha256, dataclasses.asdict(material)]).encode())
    sensing = sensing_points_of(name, mesh)
    # Rounded, and without a minus before zero, which differ between versions of numpy and scipy.
    places = sensing.rows, sensing.columns, *(np.round(each * 1e9) + 0.0 for each in (sensing.weights, sensing.gap))
    for array in (np.round(mesh.nodes * 1e9), mesh.cells, mesh.clamped, touchable, *places):
        digest.update(np.ascontiguousarray(array).tobytes())
    return cache_folder() / f"compliance-{name}-{digest.hexdigest()[:16]}"


def _cached(solid: Solid) -> Compliance:
    """Read a solid's matrices from the cache, checked against their stored hashes; build them if that fails."""
    name, lattice, touchable, mesh, _ = solid
    folder = cache_entry(solid)
    try:
        loaded = array_cache.load(folder, ARRAYS)
    except array_cache.DamagedError:  # not built yet, perhaps by a process that is at it now
        array_cache.claim(folder, _ROOM)
        with lock.awaited(folder.with_name(f".{folder.name}.lock")):
            loaded = _built(solid, folder)
    counts = (len(electrode_feet(name).gap), len(facing_nodes(name, mesh))) if len(mesh.inner) else (0, 0)
    return Compliance(name, lattice, touchable, **loaded, feet=counts[0], facing=counts[1])


def _built(solid: Solid, folder: pathlib.Path) -> dict[str, np.ndarray]:
    """Return the matrices that another process built while this one waited for the lock, or build them."""
    try:
        return array_cache.load(folder, ARRAYS)
    except array_cache.DamagedError as damage:
        if (folder / array_cache.HASHES).exists():
            log.warning("%s: damaged (%s); it is built again", folder, damage)
    with in_one_thread:  # what one process keeps, every other computes with
        halves = unpack(compact_file(solid.name), folder.name)
        if halves is None:
            log.warning("building the compliance of the %s in %s: about a minute, once", solid.name, folder)
            halves = condensed(solid)
        return array_cache.store(folder, assembled(solid, *halves), _ROOM)


def compact_file(sensor: str) -> pathlib.Path:
    """Return the path at which a sensor's condensed compliance ships, if it does: its parts even and odd in z, as
    `scripts/benchmarks/make/make_compliance.py` writes them."""
    return shipped(f"compliance/{sensor}.h5")


def condensed(solid: Solid) -> tuple[Half, Half]:
    """Condense a solid's even and odd half to its surface, under ``kept_loads`` and, last, a skin's fluid at 1 Pa.

    Raises ValueError for a solid without mirror symmetry or held nowhere, TactileError if memory is too small.
    """
    from scipy import sparse

    name, _, _, mesh, material = solid
    try:
        loads = sensing_points_of(name, mesh).matrix(3 * len(mesh.nodes), kept_loads(solid)[0])
        if len(mesh.inner):
            volume = FluidCavity(inner_faces(mesh), len(mesh.nodes)).gradient(mesh.nodes)  # m2, of the fluid, at rest
            loads = sparse.hstack([loads, volume[:, None]], format="csc")
        half, touched = kept_nodes(solid)
        even, odd = (condense(mesh, material, mesh.surface[half], touched, loads, parity) for parity in (1, -1))
    except MemoryError as error:
        raise TactileError("compliance", "out of memory", "1.3 GB of free memory", "Close other programs") from error
    return even, odd


def kept_nodes(solid: Solid) -> tuple[np.ndarray, np.ndarray]:
    """Return the surface nodes (k,) with z >= 0, and the indices (r,) of ``answered_nodes`` in that list."""
    rest = solid.lattice.rest
    half = np.flatnonzero(rest[:, 2] >= -ON_PLANE)
    return half, np.searchsorted(half, answered_nodes(solid.lattice, solid.touchable, mirror_nodes(rest)))


def kept_loads(solid: Solid) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the sensing points (v,) whose unit loads are solved; and, for each of all w points, the index (w,) in that
    list of the point whose answer it takes (`images`), and a sign (w,), -1 if it takes the mirror image of that."""
    source, mirrored = images(solid.name, solid.mesh, len(sensing_points_of(solid.name, solid.mesh).gap))
    kept = np.unique(source)
    return kept, np.searchsorted(kept, source), np.where(mirrored, -1.0, 1.0)


def assembled(solid: Solid, even: Half, odd: Half) -> Iterator[tuple[str, np.ndarray]]:
    """Yield name and values of each float array of ``Compliance``, one by one to save memory: joins the halves that
    ``condensed`` returns and adds the fluid. Overwrites the halves."""
    name, lattice, touchable, mesh, _ = solid
    (half, touched), gap = kept_nodes(solid), sensing_points_of(name, mesh).gap
    kept, column, sign = kept_loads(solid)
    place, touch_dofs = MirrorSymmetry(half, mirror_nodes(lattice.rest)), axes_of(touchable)
    filled = len(mesh.inner) > 0
    if filled:
        column, sign = np.r_[column, len(kept)], np.r_[sign, 1.0]
    inner_pressure, pressure, pressed = np.zeros(len(gap)), np.zeros(len(touch_dofs)), np.zeros(3 * len(touched))
    swell, under_last = np.zeros(3 * len(lattice.rest), np.float32), np.zeros(len(gap))
    every = np.ix_(column, column)
    among = odd.among[every]
    among *= sign[:, None]
    among *= sign
    among += even.among[every]
    if filled:  # the fluid keeps its volume: its pressure is one more force, and takes one more row away
        under_last, stiffness = among[-1, :-1].copy(), 1 / float(even.among[-1, -1])
        [swell] = place.loads(even.under_loads, odd.under_loads, column[-1:], sign[-1:])
        inner_pressure, pressure = -stiffness * under_last, -stiffness * swell[touch_dofs].astype(float)
        pressed = -stiffness * swell[axes_of(half[touched])]
        column, sign, among = column[:-1], sign[:-1], among[:-1, :-1]
    yield from {"watch_gap": gap, "pressure": pressure, "inner_pressure": inner_pressure}.items()
    among = among.astype(np.float32)
    _add_outer(among, inner_pressure, under_last.astype(np.float32))
    yield "inner_watch", among
    del among
    on_plane = axes_of(np.flatnonzero(np.abs(lattice.rest[half, 2]) < ON_PLANE)).reshape(-1, 3)
    for answer, axes in ((even.answer, [2]), (odd.answer, [0, 1])):  # not moved there: what ships has rounded that
        held = on_plane[:, axes].ravel()
        answer[:, held], answer[np.isin(axes_of(touched), held)] = 0, 0
    move = place.forces(even.answer, odd.answer)
    _add_outer(move, pressed, swell)
    yield "move", move
    del move  # 132 MB less while the next two are made
    inner_move = place.loads(even.under_loads, odd.under_loads, column, sign)
    _add_outer(inner_move, inner_pressure, swell)
    yield "inner_move", inner_move
    yield "watch", np.ascontiguousarray(inner_move[:, touch_dofs].T)


def _add_outer(rows: np.ndarray, factor: np.ndarray, line: np.ndarray) -> None:
    """Add factor (r,) times line (n,) to rows (r, n) float32, row by row: the whole product would double the memory."""
    if line.any():
        for row, by in zip(rows, factor.astype(np.float32), strict=True):
            row += by * line


def answered_nodes(lattice: Lattice, touchable: np.ndarray, image: np.ndarray) -> np.ndarray:
    """Return the nodes (r,) with z >= 0 that are solved: of the touchable ones (m,) each itself, or its mirror image.
    image : (n,), index of each surface node's mirror image"""
    return np.unique(np.where(lattice.rest[touchable, 2] >= -ON_PLANE, touchable, image[touchable]))
