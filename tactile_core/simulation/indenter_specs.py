"""The indenters that a scene can name: one struct a kind, millimetres in, metres out."""

from __future__ import annotations

import os
import pathlib
from typing import Annotated, Literal

import msgspec
import numpy as np
from msgspec import Meta

from ..errors import TactileError
from ..geometry.indenters import (
    Box,
    BumpyCube,
    Cylinder,
    Edge,
    Indenter,
    LyingCylinder,
    MeshIndenter,
    Pose,
    Ring,
    Several,
    Sphere,
)

Positive = Annotated[float, Meta(gt=0)]
NotNegative = Annotated[float, Meta(ge=0)]


class SphereSpec(msgspec.Struct, tag="sphere", tag_field="kind", forbid_unknown_fields=True, frozen=True):
    """A ball."""

    name: str
    radius_mm: Positive

    def build(self) -> Indenter:
        """The indenter, in metres."""
        return Sphere(self.radius_mm * 1e-3)


class CylinderSpec(msgspec.Struct, tag="cylinder", tag_field="kind", forbid_unknown_fields=True, frozen=True):
    """An upright cylinder that touches with its flat, rounded end."""

    name: str
    radius_mm: Positive
    edge_mm: Positive = 0.5
    length_mm: Positive = 10.0

    def build(self) -> Indenter:
        """The indenter, in metres."""
        return Cylinder(self.radius_mm * 1e-3, self.edge_mm * 1e-3, self.length_mm * 1e-3)


class LyingCylinderSpec(
    msgspec.Struct, tag="lying_cylinder", tag_field="kind", forbid_unknown_fields=True, frozen=True
):
    """A cylinder that touches with its side; an edge as large as the radius makes its ends half balls."""

    name: str
    radius_mm: Positive
    edge_mm: Positive = 0.5
    length_mm: Positive = 20.0

    def build(self) -> Indenter:
        """The indenter, in metres."""
        return LyingCylinder(self.radius_mm * 1e-3, self.edge_mm * 1e-3, self.length_mm * 1e-3)


class BoxSpec(msgspec.Struct, tag="box", tag_field="kind", forbid_unknown_fields=True, frozen=True):
    """A box or cube that touches with a flat face."""

    name: str
    sizes_mm: tuple[Positive, Positive, Positive]
    edge_mm: Positive = 0.5

    def build(self) -> Indenter:
        """The indenter, in metres."""
        x, y, z = self.sizes_mm
        return Box((x * 1e-3, y * 1e-3, z * 1e-3), self.edge_mm * 1e-3)


class RingSpec(msgspec.Struct, tag="ring", tag_field="kind", forbid_unknown_fields=True, frozen=True):
    """A ring of round wire that lies flat; its outer diameter is 2 (radius_mm + tube_mm)."""

    name: str
    radius_mm: Positive
    tube_mm: Positive

    def build(self) -> Indenter:
        """The indenter, in metres."""
        return Ring(self.radius_mm * 1e-3, self.tube_mm * 1e-3)


class EdgeSpec(msgspec.Struct, tag="edge", tag_field="kind", forbid_unknown_fields=True, frozen=True):
    """A wedge that touches with its rounded ridge."""

    name: str
    angle_deg: Positive
    radius_mm: Positive = 0.5
    length_mm: Positive = 20.0
    height_mm: Positive = 10.0

    def build(self) -> Indenter:
        """The indenter, in metres."""
        lengths = (self.radius_mm, self.length_mm, self.height_mm)
        return Edge(float(np.deg2rad(self.angle_deg)), *(value * 1e-3 for value in lengths))


class BumpyCubeSpec(msgspec.Struct, tag="bumpy_cube", tag_field="kind", forbid_unknown_fields=True, frozen=True):
    """A cube with five bumps on its lower face, placed like the dots of a die."""

    name: str
    size_mm: Positive
    bump_radius_mm: Positive
    bump_height_mm: Positive
    spacing_mm: Positive
    edge_mm: Positive = 0.5

    def build(self) -> Indenter:
        """The indenter, in metres."""
        lengths = (self.size_mm, self.edge_mm, self.bump_radius_mm, self.bump_height_mm, self.spacing_mm)
        return BumpyCube(*(value * 1e-3 for value in lengths))


class MeshSpec(msgspec.Struct, tag="mesh", tag_field="kind", forbid_unknown_fields=True, frozen=True):
    """A closed triangle mesh (STL, PLY, OBJ, OFF) in the scene's folder or below it.

    unit_mm : mm per unit of the file; up : the file's axis that points out of the sensor
    spacing_mm : of the grid that holds its distance
    """

    name: str
    file: str
    unit_mm: Positive = 1.0
    up: Literal["x", "y", "z", "-x", "-y", "-z"] = "z"
    spacing_mm: Positive = 0.1

    def build(self) -> Indenter:
        """The indenter, in metres."""
        return MeshIndenter.from_file(self.file, self.unit_mm * 1e-3, self.up, self.spacing_mm * 1e-3)


Single = SphereSpec | CylinderSpec | LyingCylinderSpec | BoxSpec | RingSpec | EdgeSpec | BumpyCubeSpec | MeshSpec


class PartSpec(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Part of a group: moved along the group's axes, then its lower end is ``z_mm`` above the plane of contact."""

    body: Single
    x_mm: float = 0.0
    y_mm: float = 0.0
    z_mm: NotNegative = 0.0
    turn_deg: float = 0.0

    def build(self) -> tuple[Indenter, Pose]:
        """The indenter, in metres, and its pose in the group, turned about z."""
        c, s = np.cos(np.deg2rad(self.turn_deg)), np.sin(np.deg2rad(self.turn_deg))
        apex = np.array([self.x_mm, self.y_mm, self.z_mm]) * 1e-3
        return self.body.build(), Pose(apex, np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]))


class SeveralSpec(msgspec.Struct, tag="several", tag_field="kind", forbid_unknown_fields=True, frozen=True):
    """Several bodies that press as one; the lowest of them has z_mm = 0."""

    name: str
    parts: Annotated[list[PartSpec], Meta(min_length=1, max_length=64)]

    def build(self) -> Indenter:
        """The indenter, in metres."""
        return Several(tuple(part.build() for part in self.parts))


IndenterSpec = Single | SeveralSpec


def with_files_of(folder: pathlib.Path, spec: IndenterSpec) -> IndenterSpec:
    """The spec with its mesh files found in the scene's folder.

    Raises TactileError for a file that is missing or lies, by its name or by a link, outside of the folder.
    """
    if isinstance(spec, SeveralSpec):
        parts = [msgspec.structs.replace(part, body=with_files_of(folder, part.body)) for part in spec.parts]
        return msgspec.structs.replace(spec, parts=parts)
    if isinstance(spec, MeshSpec):
        return msgspec.structs.replace(spec, file=os.fspath(_found(folder, spec)))
    return spec


def _found(folder: pathlib.Path, spec: MeshSpec) -> pathlib.Path:
    where, expected = f"{folder}, indenter {spec.name!r}, file", "a file in the scene's folder, such as ball.stl"
    # Read as a Windows path too: a scene means the same file, or none, on every system.
    names = pathlib.PureWindowsPath(spec.file)
    if names.anchor or ".." in names.parts or "\0" in spec.file:
        raise TactileError(where, repr(spec.file), expected, "Give a name without .. that does not begin with /")
    try:
        path = folder.joinpath(*names.parts).resolve(strict=True)
        base = folder.resolve(strict=True)
    except (OSError, RuntimeError) as error:  # RuntimeError: links in a circle, before Python 3.13
        raise TactileError(where, f"{spec.file!r} cannot be read ({error})", expected) from error
    if not path.is_relative_to(base):
        raise TactileError(where, f"{spec.file!r} is a link to {path}", expected, "Copy the file")
    return path
