"""A fingertip in a simulator's loop: the pose of an indenter in, the contact and the camera's picture out."""

from __future__ import annotations

import copy
import dataclasses
import itertools
import logging
import os
from collections.abc import Iterable, Iterator
from contextlib import suppress
from typing import Any

import numpy as np

from .. import sensors
from ..errors import TactileError, finite_number
from ..files.installed import require
from ..geometry.indenters import Indenter, Pose, as_indenter
from ..mechanics.fast.active_set import UnsolvedError, Work
from ..mechanics.fast.compliance import compliance_of
from ..mechanics.fast.press import CorrectedPress, FastContact
from ..mechanics.node_areas import node_areas, traction
from ..mechanics.penetration import PenetrationError
from ..mechanics.placement import DEPTH_LIMIT, FRICTION, first_touch_on_line, friction_of, same_line, thickness_under
from ..pictures.height_map import folds_counted, gel_mapper
from ..pictures.known_body import out_of_body, reflectance_on
from ..pictures.light import checked_reflectance
from ..pictures.presets import FAST, NAMES
from ..pictures.renderer import Renderer
from ..sensors.calibration import Calibration
from ..sensors.calibration_file import calibration_of, load_calibration
from .gel_contact import PUSH, GelContact, given, matrix_of, too_far

_log = logging.getLogger(__name__)
_NO_FORCE = 1e-5  # N, the weight of 1 mg: less is lost in rounding
_LARGEST_DROP = 1e3  # largest factor by which a force falls in one search; else an intermediate one is sought (assumed)
_SHALLOWER = (1.0, 0.8, 0.6, 0.4, 0.2)  # shares of the greatest depth, tried in turn if a force is not reached
# Budget of ``Work``: 5 to 10 s on a core, and the solve begun then (assumed). From rest, a ball of 300 mm diameter at
# 10 N, which touches 900 nodes of the DIGIT's gel, takes half of it, at 100 N five times.
_WORK = 1e12
_ENDED: Any = object()  # stands for poses or forces that are used up
_BEGUN_INSIDE = 0.2e-3  # m: a first step deeper than this has begun inside (assumed: 20 mm/s at 100 Hz)


class Gel:
    """A DIGIT's gel or a BioTac's skin that one indenter presses; each contact goes on from the one before.

    Keep one per thread: instances share nothing that changes. The same poses give the same numbers.

    >>> gel = Gel("digit", indenter=Sphere(3e-3))        # m
    >>> pose = gel.touching(x=-8e-3, z=0.0, depth=0.3e-3)
    >>> contact = gel.press(pose)                        # contact.force N, .displacement m, .traction Pa
    >>> picture = gel.picture()                          # (320, 240, 3) uint8

    sensor : name of a sensor, such as "digit" or "biotac"
    indenter : one of ``geometry.indenters``, or a closed ``trimesh.Trimesh`` in metres
    friction : Coulomb's coefficient, 0 for none; preset : of the pictures
    calibration : the camera and its lights, of ``load_calibration``, or their file; None for the one that ships
    texture : (h, w), 0 black to 1 white or uint8, of the indenter, which shows through the coating where it touches:
        columns along own x, rows from the greatest own y down, as a mirrored photograph; None for the calibration's
    Raises TactileError for another sensor, and for meshes and values that no indenter can have; ModuleNotFoundError
    without the extra [fem], and without [render] for presets other than ``fast``."""

    def __init__(
        self, sensor: str = sensors.TARGET, indenter: Any = None, *, friction: float = FRICTION, preset: str = FAST,
        calibration: Calibration | str | os.PathLike[str] | None = None, texture: np.ndarray | None = None,
    ) -> None:  # fmt: skip
        if preset not in NAMES:
            raise TactileError("Gel, preset", repr(preset), f"one of {', '.join(NAMES)}")
        require("fem", "scipy")
        if preset != FAST:
            require("render", "mitsuba")
        self.sensor, self.preset = sensor, preset
        self.friction = friction_of(friction, "Gel, friction")
        self.indenter: Indenter = as_indenter(indenter)
        self.texture = None if texture is None else checked_reflectance(texture, "Gel, texture")
        self.surface = sensors.sensor_surface(sensor)
        self._calibration = None if calibration is None else calibration_of(calibration, "Gel, calibration")
        if self._calibration is not None and self._calibration.camera.sensor != sensor:
            found = f"of a {sensors.title(self._calibration.camera.sensor)}"
            raise TactileError("Gel, calibration", found, f"one of a {sensors.title(sensor)}")
        self._drawer: Renderer | None = None
        self._by = self.indenter, self.friction  # of the last step
        self.reset()

    def __repr__(self) -> str:
        return f"<Gel of a {self.sensor}, friction {self.friction:g}, preset {self.preset}, under {self.indenter!r}>"

    __copy__ = copy.deepcopy  # copies move on independently

    def __getstate__(self) -> dict[str, Any]:
        return vars(self) | {"_drawer": None}  # a copy makes its own: Mitsuba's scenes cannot be copied

    def reset(self) -> None:
        """Remove the indenter; the next contact does not depend on earlier ones."""
        self._press: CorrectedPress | None = None
        self._work = Work()
        self._pose: Pose | None = None  # of the step before
        self._touch: tuple[Pose, float] | None = None  # the first touch found last, and the greatest depth there, m
        self._under = self.indenter, Pose(np.zeros(3), np.eye(3), PUSH)  # of the contact that was solved last
        self._contact = GelContact.untouched(len(self.surface.rest), self._under[1])

    def press(self, pose: Any, force: float | None = None) -> GelContact:
        """Move the indenter to a pose, along a straight line from the last one, and return the contact there.

        pose : (4, 4) matrix, or (position (3,) m, quaternion (4,) w, x, y, z), of the indenter's origin and axes
        force : N along +y; the indenter then moves on along +y, out or in, until it bears that force; 0 lifts it
        Raises TactileError for an invalid pose or force, and above 500 N, and keeps the contact before; all other
        trouble is in the result's ``flags``."""
        return self._step(*given(pose, force))

    def _step(self, here: Pose, force: float | None) -> GelContact:
        """Do the work of ``press`` for a checked pose and force, N."""
        flags: list[str] = []
        self._work.left = _WORK
        by = self.indenter, self.friction = as_indenter(self.indenter), friction_of(self.friction, "Gel, friction")
        other, self._by = by[0] is not self._by[0] or by[1] != self._by[1], by  # true if one was set since
        jumps = self._press is not None and self._contact.patch.any() and (other or too_far(self._pose, here))
        if jumps or other:
            self._press, self._touch = None, None
        before, self._pose = self._pose, here
        if force is not None and force < _NO_FORCE:
            self._press, self._contact = None, GelContact.untouched(len(self.surface.rest), here)
            return self._contact
        try:
            found = self._solved_at(here, force, flags, began=before is None)
            if jumps and found is not None:
                flags.insert(0, "jumped")
        except UnsolvedError as error:
            found = None
            why = {"too large": self._work.left <= 0, "too sharp": isinstance(error.__cause__, PenetrationError)}
            flags += ["unsolved", *(word for word, holds in why.items() if holds)]
        self._contact = self._described(found, here, flags)
        return self._contact

    def follow(self, poses: Iterable[Any], forces: Iterable[float | None] | None = None) -> Iterator[GelContact]:
        """Yield the contact at each of many poses. forces : N along +y or None, one for each pose

        For an invalid pose or force the contact before comes again, flagged ``refused``, and the reason is logged.
        Raises TactileError if poses and forces differ in number, or are no series."""
        if not (isinstance(poses, Iterable) and isinstance(forces, Iterable | None)):
            raise TactileError("Gel, follow", f"{poses!r:.80}, {forces!r:.80}", "a series of poses, forces or None")
        if forces is None:
            yield from map(self._press_or_keep, poses)
            return
        for pose, force in itertools.zip_longest(poses, forces, fillvalue=_ENDED):
            if pose is _ENDED or force is _ENDED:
                found = f"{'poses' if pose is _ENDED else 'forces'} end before the others"
                raise TactileError("Gel, follow", found, "a force for each pose, or None", "Give as many of both")
            yield self._press_or_keep(pose, force)

    def _press_or_keep(self, pose: Any, force: float | None = None) -> GelContact:
        """Return the contact at a pose and force, N; for an invalid one the last contact, flagged ``refused``."""
        try:
            asked = given(pose, force)
        except TactileError as error:
            _log.warning("%s", error)
            return dataclasses.replace(self._contact, flags=("refused",))
        return self._step(*asked)

    @property
    def contact(self) -> GelContact:
        """Return the last contact; an untouched one before the first step."""
        return self._contact

    @property
    def areas(self) -> np.ndarray:
        """Return the area (n,) m2 of the resting surface that belongs to each node."""
        return node_areas(self.sensor)

    def height_map(self) -> np.ndarray:
        """Return the heights (H, W) float32, m, of the gel under the camera's pixels in the last contact; it follows
        the indenter between its nodes, too. Where a hard slide folds it over itself a height is a guess. Raises
        TactileError for the BioTac, and for a gel without a calibration."""
        if not sensors.is_gel(self.sensor):
            found = f"the {sensors.title(self.sensor)}, of which no picture can be drawn"
            raise TactileError("Gel, picture", found, "a Gel of a sensor with a camera, as the DIGIT")
        camera = self._renderer.camera
        with folds_counted():
            heights = gel_mapper(camera)(self._contact.displacement)
        touching = (self.surface.rest + self._contact.displacement)[self._contact.patch]
        return out_of_body(heights, camera, *self._under, touching)

    def picture(self) -> np.ndarray:
        """Return the picture (H, W, 3) uint8 of the last contact. Raises TactileError for a sensor without camera."""
        heights, reflectance = self.height_map(), None
        if self.texture is not None and self._contact.patch.any():
            reflectance = reflectance_on(self.texture, heights, self._renderer.camera, *self._under)
        return self._renderer(heights, self._renderer.marks(self._contact.displacement), reflectance)

    def touching(self, x: float, z: float, depth: float = 0.0) -> np.ndarray:
        """Return the pose (4, 4) of the indenter, its own z out of the sensor, ``depth`` m past first touch.
        x, z : m, place of its origin in the sensor's frame. Raises TactileError if it misses the sensor."""
        x, z, depth = (finite_number(each, "Gel.touching", "x, z and depth in m", -1.0, 1.0) for each in (x, z, depth))
        axes = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])  # own x along the finger, own z to -y
        place = Pose(np.array([x, 0.0, z]), axes, PUSH)
        return matrix_of(first_touch_on_line(self.surface, as_indenter(self.indenter), place).moved(depth))

    def _touch_and_limit(self, pose: Pose) -> tuple[Pose, float]:
        """Return the pose at first touch and the greatest depth, m; the last ones if a pose differs in depth alone."""
        if self._touch is None or not same_line(self._touch[0], pose):
            touch = first_touch_on_line(self.surface, self.indenter, pose)
            self._touch = touch, DEPTH_LIMIT * thickness_under(self.sensor, self.indenter, touch)
        return self._touch

    @property
    def _renderer(self) -> Renderer:
        if self._drawer is None or self._drawer.preset != self.preset:
            self._drawer = Renderer(self._calibration or load_calibration(None, self.sensor), self.preset)
        return self._drawer

    def _solved_at(self, pose: Pose, force: float | None, flags: list[str], *, began: bool) -> FastContact | None:
        """Return the contact at a pose, or None; if none is solved, that of an indenter that comes straight in.
        force : N, None for the pose as it is; flags : list, extended; began : true if there was no pose before"""
        path = self._press
        try:
            return self._moved_to(pose, force, flags, began=began)
        except UnsolvedError:
            if path is None:
                raise
        again: list[str] = []
        self._press = None
        try:
            found = self._moved_to(pose, force, again, began=False)
        except UnsolvedError:
            self._press = path
            raise
        flags[:] = [*again, "friction forgotten"] if self.friction else again  # without friction the path is nothing
        return found

    def _moved_to(self, pose: Pose, force: float | None, flags: list[str], *, began: bool) -> FastContact | None:
        """Return the contact at a pose or force, N; None if nothing touches. Raises UnsolvedError.
        flags : list, extended; began : true if there was no pose before"""
        try:
            touch, limit = self._touch_and_limit(pose)
        except TactileError:  # it passes the sensor by
            if force is not None:
                flags.append("force not reached")
            self._press = None
            return None
        depth = float((pose.apex - touch.apex) @ PUSH)
        if force is None and depth <= 0:
            self._press = None
            return None
        if began and force is None and depth > _BEGUN_INSIDE:
            flags.append("began inside")
        if self._press is None:
            solid = compliance_of(self.sensor)
            self._press = CorrectedPress(solid, self.indenter, touch, limit, self.friction, self._work)
        self._press.limit = limit
        try:
            if force is not None:
                return self._at_force(self._press, touch, force, limit, flags)
            if depth > limit:
                flags.append("too deep")
            return self._at_depth(self._press, touch, min(depth, limit))
        except PenetrationError as error:
            raise UnsolvedError(str(error)) from error

    def _at_depth(self, press: CorrectedPress, touch: Pose, depth: float) -> FastContact:
        found = press.at_depth(depth, touch, touches=True)
        if not found.linear.converged:
            raise UnsolvedError(f"no contact at {depth * 1e3:g} mm")
        return found

    def _at_force(self, press: CorrectedPress, touch: Pose, force: float, limit: float, flags: list) -> FastContact:
        """Return the contact at force, N, searched from first touch, or the nearest one that was found.
        limit : m, greatest depth; flags : list, extended if the force is missed"""
        bears, above = float(self._contact.force[1]), None
        if bears > _LARGEST_DROP * force:
            above = press.at_force(float(np.sqrt(bears * force)), touch, touches=True)
        found = press.at_force(force, touch, touches=True)
        if found is not None:
            return found
        flags.append("force not reached")
        if above is not None:
            return above
        for share in _SHALLOWER if self._work.left > 0 else ():
            with suppress(UnsolvedError):
                return self._at_depth(press, touch, share * limit)
        if self._work.left <= 0:
            flags.append("too large")
        nearest = press.nearest()
        if nearest is None:
            raise UnsolvedError(f"no contact at {force:g} N")
        return nearest

    def _described(self, found: FastContact | None, pose: Pose, flags: list[str]) -> GelContact:
        if "unsolved" in flags:
            return dataclasses.replace(self._contact, pose=matrix_of(pose), flags=tuple(flags))
        if found is None:
            return dataclasses.replace(GelContact.untouched(len(self.surface.rest), pose), flags=tuple(flags))
        linear, nodes = found.linear, compliance_of(self.sensor).touchable[found.linear.nodes]
        self._under = self.indenter, linear.pose
        pressed = traction(self.sensor, nodes, found.corrected.factor * linear.nodal_force)
        patch = np.zeros(len(pressed), bool)
        patch[nodes] = True
        return GelContact(
            found.force, found.corrected.displacement, pressed, patch,
            float(linear.slipping.mean()) if len(nodes) and self.friction else 0.0, found.depth, found.pressure,
            matrix_of(linear.pose), tuple(flags),
        )  # fmt: skip
