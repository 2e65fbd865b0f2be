"""The indenters that a scene can name: one struct per kind, millimetres in, metres out. Structs of simple shapes are
made from the shapes' own files; those of meshes and groups are here.
"""

from __future__ import annotations

import functools
import operator
import os
import pathlib
import types
from typing import TYPE_CHECKING, Annotated, Any, Literal

import msgspec
import numpy as np
from msgspec import Meta

from ..errors import TactileError
from ..files import outside
from ..geometry.indenters import Indenter, MeshIndenter, Pose, Several
from ..geometry.indenters.indenter import SceneForm, forms

Positive = Annotated[float, Meta(gt=0)]
NotNegative = Annotated[float, Meta(ge=0)]


class SizedSpec(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """A shape given by its sizes, mm; the struct of each kind adds these as fields. name : the user's name for it"""

    name: str

    def build(self) -> Indenter:
        """Build the indenter, in metres."""
        return forms()[str(self.__struct_config__.tag)].build(msgspec.structs.asdict(self))


def _spec_of(form: SceneForm) -> type[SizedSpec]:
    """Define the struct of a form."""
    fields: list[tuple[str, Any, Any]] = [
        (
            size.field,
            Positive if size.count == 1 else types.GenericAlias(tuple, (Positive,) * size.count),
            msgspec.NODEFAULT if size.default is None else size.default,
        )
        for size in form.sizes.values()
    ]
    # msgspec names no base in the type of what it defines
    return msgspec.defstruct(  # type: ignore[return-value]
        f"{form.shape.__name__}Spec", fields, bases=(SizedSpec,), namespace={"__doc__": f"{form.says}."},
        module=__name__, tag=form.kind, tag_field="kind", forbid_unknown_fields=True, frozen=True,
    )  # fmt: skip


class MeshSpec(msgspec.Struct, tag="mesh", tag_field="kind", forbid_unknown_fields=True, frozen=True):
    """A closed triangle mesh (STL, PLY, OBJ, OFF) in the scene's folder or below it. name : the user's name for it
    file : its path from that folder, by /; unit_mm : mm per unit of the file
    up : the file's axis that points out of the sensor; spacing_mm : of the grid that holds the distance to the mesh"""

    name: str
    file: str
    unit_mm: Positive = 1.0
    up: Literal["x", "y", "z", "-x", "-y", "-z"] = "z"
    spacing_mm: Positive = 0.1

    def build(self) -> Indenter:
        """Build the indenter, in metres."""
        return MeshIndenter.from_file(self.file, self.unit_mm * 1e-3, self.up, self.spacing_mm * 1e-3)


if TYPE_CHECKING:
    Single = SizedSpec | MeshSpec
else:
    Single = functools.reduce(operator.or_, map(_spec_of, forms().values()), MeshSpec)


class PartSpec(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Part of a group: a ``body`` moved by x_mm, y_mm along the group's axes and turned by turn_deg about z, from x
    toward y; its lower end is z_mm above the plane in which the group first touches."""

    body: Single
    x_mm: float = 0.0
    y_mm: float = 0.0
    z_mm: NotNegative = 0.0
    turn_deg: float = 0.0

    def build(self) -> tuple[Indenter, Pose]:
        """Build the indenter, in metres, and its pose in the group, rotated about z."""
        c, s = np.cos(np.deg2rad(self.turn_deg)), np.sin(np.deg2rad(self.turn_deg))
        apex = np.array([self.x_mm, self.y_mm, self.z_mm]) * 1e-3
        return self.body.build(), Pose(apex, np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]))


class SeveralSpec(msgspec.Struct, tag="several", tag_field="kind", forbid_unknown_fields=True, frozen=True):
    """Several bodies, ``parts``, pressed as one; the lowest has z_mm = 0. name : the user's name for the group"""

    name: str
    parts: Annotated[list[PartSpec], Meta(min_length=1, max_length=64)]

    def build(self) -> Indenter:
        """Build the indenter, in metres."""
        return Several(tuple(part.build() for part in self.parts))


IndenterSpec = Single | SeveralSpec


def with_files_of(folder: pathlib.Path, spec: IndenterSpec) -> IndenterSpec:
    """Return the spec with its mesh files, named within the scene's ``folder``, as full paths. Raises TactileError for
    a file that is missing or outside of the folder."""
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
    path = outside.inside(folder, "/".join(names.parts), expected)
    if not path.exists():
        raise TactileError(where, f"{spec.file!r} is not there", expected)
    return path
