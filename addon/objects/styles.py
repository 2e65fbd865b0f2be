"""Give a sensor's surface a style: geometry nodes that colour it, in Solid views too; and an arrow for its force."""

from __future__ import annotations

import bpy
import numpy as np

from ...tactile_core.geometry.lattice import grid_faces
from ..settings import properties
from . import style_nodes, surfaces

MODIFIER = "Tactile style"
ERROR = "expected_error_um"  # property of what was translated; negative where it is not known
STYLES = (
    ("DISPLACEMENT", "Displacement", "Colour by how far each place has moved"),
    ("CONTACT_PATCH", "Contact Patch", "Colour what is touched; of a gel"),
    ("ELECTRODES", "Electrodes", "Colour round each electrode by how far its reading has changed; of a skin"),
    ("NONE", "Material", "Show the surface's own material"),
)
_ONLY = {"CONTACT_PATCH": "DIGIT", "ELECTRODES": "BIOTAC"}  # style -> the one role that has it


def can_show(thing: bpy.types.Object, style: str) -> bool:
    """Return true if a style suits a sensor: a contact patch needs a gel, electrodes need a skin."""
    return _ONLY.get(style, thing.tactile.role) == thing.tactile.role


def get_ready(thing: bpy.types.Object) -> None:
    """Let a sensor take any style, also from the asset library: keep its rest, let Solid views show its colours."""
    thing.add_rest_position_attribute = True
    make_colour_active(thing.data)


def set_style(thing: bpy.types.Object, style: str, largest: float, exaggeration: float) -> None:
    """Give a sensor a style, "DISPLACEMENT", "CONTACT_PATCH", "ELECTRODES" or "NONE", in place of its present one.

    largest : value at the colours' upper end: displacement in the object's units, for "ELECTRODES" counts
    exaggeration : factor by which the dent is drawn larger
    """
    old = thing.modifiers.get(MODIFIER)
    if old is not None:
        thing.modifiers.remove(old)
        drivers = thing.animation_data.drivers if thing.animation_data else []
        for curve in [each for each in drivers if each.data_path.startswith(f'modifiers["{MODIFIER}"]')]:
            drivers.remove(curve)
    if style == "NONE":
        return
    get_ready(thing)
    modifier = _add_nodes(thing, style, {style_nodes.LARGEST: largest, style_nodes.EXAGGERATION: exaggeration})
    if style == "DISPLACEMENT" and ERROR in thing:
        path = style_nodes.input_path(modifier, style_nodes.ERROR)
        driver = thing.driver_add(f'modifiers["{MODIFIER}"]{path}').driver
        driver.type, variable = "SCRIPTED", driver.variables.new()
        variable.name, variable.targets[0].id, variable.targets[0].data_path = "error", thing, f'["{ERROR}"]'
        driver.expression = f"max(error, 0) * {1e-6 * thing.tactile.per_metre!r}"


def style_of(thing: bpy.types.Object) -> str:
    """Return a sensor's style, as ``set_style`` takes it; "NONE" also if the modifier has the user's own nodes."""
    modifier = thing.modifiers.get(MODIFIER)
    names = [name for name, _, _ in STYLES if name != "NONE"]
    shown = None if modifier is None else modifier.node_group
    return next((name for name in names if shown is not None and shown == style_nodes.group(name)), "NONE")


def add_arrow(sensor: bpy.types.Object, length: float) -> None:
    """Add an arrow to a sensor, as its child, that shows its custom property ``force``; it works without the add-on.

    length : of an arrow for 1 N, in the object's units
    """
    get_ready(sensor)
    arrow = surfaces.new_mesh_object(f"{sensor.name} force", *_upright(), smooth=False)
    properties.set_up_part(arrow, sensor, "LEGEND")
    arrow.hide_select = True
    make_colour_active(arrow.data)
    modifier = _add_nodes(arrow, "FORCE_ARROW", {style_nodes.SENSOR: sensor, style_nodes.LENGTH: length})
    path = style_nodes.input_path(modifier, style_nodes.FORCE)
    for axis in range(3):
        driver = arrow.driver_add(f'modifiers["{MODIFIER}"]{path}', axis).driver
        driver.type = "SUM"
        variable = driver.variables.new()
        variable.targets[0].id, variable.targets[0].data_path = sensor, f'["force"][{axis}]'


def arrow_of(sensor: bpy.types.Object) -> bpy.types.Object | None:
    """Return the arrow of a sensor, None if it has none."""
    known = (thing for thing in sensor.children if MODIFIER in thing.modifiers and thing.tactile.role == "LEGEND")
    return next(known, None)


def make_colour_active(mesh: bpy.types.Mesh) -> None:
    """Let Solid views colour a mesh by the styles' attribute; a mesh without it has the object's own colour there."""
    mesh.attributes.active_color_name = style_nodes.COLOUR


def _add_nodes(thing: bpy.types.Object, style: str, values: dict[str, object]) -> bpy.types.NodesModifier:
    modifier = thing.modifiers.new(MODIFIER, "NODES")
    modifier.node_group = style_nodes.group(style)
    for name, value in values.items():
        style_nodes.set_input(modifier, name, value)
    return modifier


def _upright() -> tuple[np.ndarray, np.ndarray]:
    """Return nodes (n, 3) and triangles (m, 3) of an arrow 1 high that stands on its tip at the origin."""
    around = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    rings = [(0.0, 0.0), (0.12, 0.3), (0.05, 0.3), (0.05, 1.0), (0.0, 1.0)]  # radius and height
    nodes = np.concatenate([np.stack([r * np.cos(around), r * np.sin(around), 0 * around + h], -1) for r, h in rings])
    return nodes, grid_faces(len(rings), len(around), closed=True)
