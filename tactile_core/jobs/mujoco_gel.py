"""Convert contacts of ``mujoco.MjData`` with a fingertip's geom to contacts of a ``Gel``."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import TactileError
from ..geometry.indenters import Box, Cylinder, Indenter, LyingCylinder, MeshIndenter, Sphere
from ..mechanics.placement import FRICTION
from ..pictures.presets import FAST
from ..sensors import TARGET
from .gel import Gel
from .gel_contact import GelContact

if TYPE_CHECKING:
    import mujoco


_log = logging.getLogger(__name__)
_EDGE, _MOST_EDGE = 0.4e-3, 0.25  # m, and of the least side: edges of boxes and cylinders, which MuJoCo has sharp
# Share of the missing shear corrected per frame; m, largest shift per frame; m, largest shift, reached if the gel slips
# before it bears MuJoCo's shear (assumed).
_SHEAR_GAIN, _SHEAR_STEP, _MOST_SHIFT = 0.5, 0.1e-3, 2e-3
_BALL_FACES = 4  # subdivisions of the icosphere that ellipsoids are made of: 2,562 vertices


class MujocoGel:
    """A DIGIT's gel or a BioTac's skin on a body of a MuJoCo model; any geom that touches it may press it.

    model : mujoco.MjModel, metres
    geom : name of the geom that stands for the gel in MuJoCo's contacts
    site : name of a site with the sensor's frame: x along the finger, tip toward -x, y into the gel
    sensor : "digit" or "biotac"; friction : Coulomb's coefficient of the gel; preset : name of its pictures' preset
    gel : the `Gel` that pressed last, one per geom; None before the first contact
    Of several geoms that touch, the one with MuJoCo's largest force presses the gel; planes never do. Raises
    TactileError for names that the model lacks."""

    def __init__(
        self,
        model: mujoco.MjModel,
        geom: str,
        site: str,
        sensor: str = TARGET,
        *,
        friction: float = FRICTION,
        preset: str = FAST,
    ) -> None:
        self.model, self.sensor, self.friction, self.preset = model, sensor, friction, preset
        self._geom = _number(model, "geom", geom)
        self._site = _number(model, "site", site)
        # By geom, where the indenter's frame is in the geom's, and the size of the geom that it was made of.
        self._gels: dict[int, tuple[Gel, np.ndarray, np.ndarray]] = {}
        self._shift = np.zeros(3)  # m, along the gel
        self._ignored: set[int] = set()
        self.gel: Gel | None = None  # the one that pressed last

    def __call__(self, data: mujoco.MjData) -> GelContact | None:
        """Return the gel's contact at MuJoCo's state; None before anything touched.

        Its force along +y is MuJoCo's; that along the surface follows MuJoCo's within a few frames. Call it after
        ``mj_step`` or ``mj_forward``, at least 100 times per second while something moves."""
        pressing = {geom: force for geom, force in self.forces(data).items() if self._presses(geom)}
        if not pressing:
            self._shift = np.zeros(3)
            if self.gel is None:
                return None
            self.gel.reset()
            return self.gel.contact
        body = max(pressing, key=lambda geom: (pressing[geom][1], -geom))
        size = self.model.geom_size[body]  # which may be another in each episode
        if body not in self._gels or not np.array_equal(self._gels[body][2], size):
            indenter, offset = indenter_of(self.model, body)
            gel = Gel(self.sensor, indenter, friction=self.friction, preset=self.preset)
            self._gels[body] = gel, offset, size.copy()
        gel, offset, _ = self._gels[body]
        gel.friction, gel.preset = self.friction, self.preset
        if gel is not self.gel:
            gel.reset()
            self._shift = np.zeros(3)
        self.gel, force = gel, pressing[body]
        pose = self._pose(data, body) @ offset
        pose[:3, 3] += self._shift
        contact = gel.press(pose, force=max(float(force[1]), 0.0))
        self._shear(contact, force)
        return contact

    def _shear(self, contact: GelContact, force: np.ndarray) -> None:
        """Shift the next pose along the gel so that its force there approaches MuJoCo's ``force`` (3,) N.

        MuJoCo's contacts creep and have no shear stiffness, so its poses say little about shear. A ball's shear
        stiffness, by Mindlin, is 2 (1 - nu) / (2 - nu), 0.68, times the normal one, by Hertz 3/2 of force over
        depth."""
        if contact.force[1] <= 0 or contact.depth <= 0:
            self._shift = np.zeros(3)
            return
        missing = (force - contact.force) * [1, 0, 1]
        stiffness = 0.68 * 1.5 * contact.force[1] / contact.depth
        step = _SHEAR_GAIN * missing / stiffness
        step *= min(1.0, _SHEAR_STEP / max(float(np.linalg.norm(step)), 1e-12))
        self._shift = np.clip(self._shift + step, -_MOST_SHIFT, _MOST_SHIFT)

    def forces(self, data: mujoco.MjData) -> dict[int, np.ndarray]:
        """Return geom's id -> MuJoCo's force (3,) N on the gel, in the sensor's frame, for the geoms that touch it."""
        import mujoco

        found: dict[int, np.ndarray] = {}
        wrench, axes = np.zeros(6), data.site_xmat[self._site].reshape(3, 3)
        for number in range(data.ncon):
            contact = data.contact[number]
            if self._geom not in (first := int(contact.geom[0]), second := int(contact.geom[1])):
                continue
            mujoco.mj_contactForce(self.model, data, number, wrench)
            on_second = contact.frame.reshape(3, 3).T @ wrench[:3]
            other, sign = (first, 1.0) if second == self._geom else (second, -1.0)
            found[other] = found.get(other, 0.0) + sign * (axes.T @ on_second)
        return found

    def _presses(self, geom: int) -> bool:
        """Return false if a geom is a plane or height field, which have no bounds, and log that once."""
        import mujoco

        endless = self.model.geom_type[geom] in (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD)
        if endless and geom not in self._ignored:
            self._ignored.add(geom)
            name = self.model.geom(geom).name or geom
            _log.warning("geom %s touches the gel and is ignored: a plane or height field has no bounds", name)
        return not endless

    def _pose(self, data: mujoco.MjData, geom: int) -> np.ndarray:
        """Return the pose (4, 4) of a geom in the sensor's frame."""
        axes, pose = data.site_xmat[self._site].reshape(3, 3), np.eye(4)
        pose[:3, :3] = axes.T @ data.geom_xmat[geom].reshape(3, 3)
        pose[:3, 3] = axes.T @ (data.geom_xpos[geom] - data.site_xpos[self._site])
        return pose


def indenter_of(model: mujoco.MjModel, geom: int) -> tuple[Indenter, np.ndarray]:
    """Return a geom as an indenter, and the pose (4, 4) of the indenter's frame in the geom's.

    Spheres, capsules, boxes and cylinders are exact but for edges, which are rounded by 0.4 mm; meshes and ellipsoids
    become a grid of their distance, built once. Raises TactileError for planes and height fields."""
    import mujoco

    kind, size = mujoco.mjtGeom(int(model.geom_type[geom])), np.array(model.geom_size[geom])
    offset = np.eye(4)
    if kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        offset[2, 3] = -size[0]
        return Sphere(float(size[0])), offset
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        offset[2, 3] = -size[2]
        return Box(tuple((2 * size).tolist()), _edge(2 * size.min())), offset
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        offset[2, 3] = -size[1]
        return Cylinder(float(size[0]), _edge(2 * min(size[0], size[1])), float(2 * size[1])), offset
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:  # a lying cylinder that is all edge
        offset[:3] = [[0, 0, 1, -size[0]], [0, -1, 0, 0], [1, 0, 0, 0]]
        return LyingCylinder(float(size[0]), float(size[0]), float(2 * (size[0] + size[1]))), offset
    return MeshIndenter.from_trimesh(_trimesh(model, geom, kind, size)), offset


def _edge(least_side: float) -> float:
    return float(min(_EDGE, _MOST_EDGE * least_side))


def _trimesh(model: mujoco.MjModel, geom: int, kind: Any, size: np.ndarray) -> Any:
    import mujoco
    import trimesh

    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = int(model.geom_dataid[geom])
        vertex, face = int(model.mesh_vertadr[mesh]), int(model.mesh_faceadr[mesh])
        vertices = model.mesh_vert[vertex : vertex + int(model.mesh_vertnum[mesh])]
        faces = model.mesh_face[face : face + int(model.mesh_facenum[mesh])]
        return trimesh.Trimesh(np.array(vertices, float), np.array(faces))
    if kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID:
        ball = trimesh.creation.icosphere(_BALL_FACES)
        return trimesh.Trimesh(ball.vertices * size, ball.faces)
    found = str(kind).rpartition("mjGEOM_")[2].lower()
    raise TactileError(f"MuJoCo, geom {geom}", f"a {found}", "a sphere, box, cylinder, capsule, ellipsoid or mesh")


def _number(model: mujoco.MjModel, kind: str, name: str) -> int:
    """Return the id of the geom or site (`kind`) of that name. Raises TactileError for none."""
    try:
        return getattr(model, kind)(name).id
    except KeyError as error:
        names = [getattr(model, kind)(each).name for each in range(getattr(model, f"n{kind}"))]
        expected = f"one of {', '.join(names) or 'none'}"
        raise TactileError("MuJoCo model", f"no {kind} {name!r}", expected) from error
