"""Make the geometry-node groups of the styles. They work without the add-on, and the asset library holds them.

Each writes colours to the attribute ``Tactile colour`` of a mesh's points, which its material and Solid views show, and
the attribute ``displacement`` (a vector, in the object's units). They read Blender's attribute ``rest_position`` and
those that ``frame_attribute`` and ``electrode_markers`` add.
"""

from __future__ import annotations

from collections.abc import Callable

import bpy

from . import digit_materials, electrode_markers, frame_attribute
from .node_group import NodeGroup
from .surfaces import new_material

COLOUR, DISPLACEMENT = "Tactile colour", "displacement"
MATERIAL, LEGEND = "Tactile style", "Tactile legend"
LARGEST, EXAGGERATION, ERROR = "Largest", "Exaggeration", "Error"
SENSOR, FORCE, LENGTH = "Sensor", "Force", "Length a Newton"
STILL = (0.50, 0.50, 0.53)
RAMPS = {
    "DISPLACEMENT": ((0.0, STILL), (0.05, (0.10, 0.15, 0.45)), (0.35, (0.0, 0.45, 0.55)), (0.65, (0.35, 0.72, 0.25)),
                     (1.0, (0.98, 0.85, 0.10))),
    "CONTACT_PATCH": ((0.0, STILL), (0.5, (0.95, 0.35, 0.05))),
    "ELECTRODES": ((0.0, (0.02, 0.05, 0.60)), (0.35, (0.10, 0.35, 0.95)), (0.5, (0.85, 0.85, 0.85)),
                   (0.65, (0.98, 0.35, 0.10)), (1.0, (0.60, 0.01, 0.03))),
}  # fmt: skip
ARROW = (0.95, 0.15, 0.55)
NAMES = {"DISPLACEMENT": "Tactile Displacement", "CONTACT_PATCH": "Tactile Contact Patch",
         "ELECTRODES": "Tactile Electrodes", "FORCE_ARROW": "Tactile Force Arrow"}  # fmt: skip
_EDGE = (1.3e-3, 1.7e-3)  # m from an electrode, between which its colour fades


def group(style: str) -> bpy.types.NodeTree:
    """Return the node group of a style, a key of ``NAMES``; make it if the file lacks it."""
    found = bpy.data.node_groups.get(NAMES[style])
    return found if found is not None else _BUILD[style](style)


def input_of(tree: bpy.types.NodeTree, name: str) -> str:
    """Return the key by which a modifier holds the value of the input ``name`` of its node group ``tree``."""
    return next(item.identifier for item in tree.interface.items_tree if item.name == name and item.in_out == "INPUT")


def input_property(modifier: bpy.types.NodesModifier, name: str) -> tuple[bpy.types.bpy_struct, str]:
    """Return the first two arguments of ``UILayout.prop`` for the input ``name`` of a modifier's node group.

    Blender 5.2 holds inputs as properties, not by their keys.
    """
    key = input_of(modifier.node_group, name)
    if hasattr(modifier, "properties"):
        return getattr(modifier.properties.inputs, key), "value"
    return modifier, f'["{key}"]'


def set_input(modifier: bpy.types.NodesModifier, name: str, value: object) -> None:
    """Set the value of the input ``name`` of a modifier's node group."""
    if hasattr(modifier, "properties"):
        setattr(*input_property(modifier, name), value)
    else:
        modifier[input_of(modifier.node_group, name)] = value


def get_input(modifier: bpy.types.NodesModifier, name: str) -> object:
    """Return the value of the input ``name`` of a modifier's node group."""
    if hasattr(modifier, "properties"):
        return getattr(*input_property(modifier, name))
    return modifier[input_of(modifier.node_group, name)]


def input_path(modifier: bpy.types.NodesModifier, name: str) -> str:
    """Return the data path of the input ``name`` of a modifier's node group, to append to the modifier's own path."""
    key = input_of(modifier.node_group, name)
    return f".properties.inputs.{key}.value" if hasattr(modifier, "properties") else f'["{key}"]'


def material() -> bpy.types.Material:
    """Return the material that shows the attribute ``Tactile colour`` under the scene's light; make it if missing."""
    return _material(MATERIAL, "Base Color")


def legend_material() -> bpy.types.Material:
    """Return the material that shows the attribute ``Tactile colour`` unlit, for legends; make it if missing."""
    made = _material(LEGEND, "Emission Color")
    shader = next(node for node in made.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value, shader.inputs["Emission Strength"].default_value = (0, 0, 0, 1), 1.0
    shader.inputs["Specular IOR Level"].default_value = 0.0
    return made


def _material(name: str, takes: str) -> bpy.types.Material:
    """Return the file's material ``name``, made if missing; takes : the shader's input that gets ``Tactile colour``"""
    found = bpy.data.materials.get(name)
    if found is not None:
        return found
    made, shader = new_material(name)
    shader.inputs["Roughness"].default_value = 0.5
    colour = made.node_tree.nodes.new("ShaderNodeVertexColor")
    colour.layer_name = COLOUR
    made.node_tree.links.new(colour.outputs["Color"], shader.inputs[takes])
    if name == MATERIAL:
        digit_materials.keep_leds_inside(made)
    return made


def _painted(nodes: NodeGroup, geometry: bpy.types.NodeSocket) -> bpy.types.NodeTree:
    """Give the geometry the styles' material and make it the group's output; return the finished group."""
    painted = nodes.add("GeometryNodeSetMaterial", geometry)
    painted.inputs["Material"].default_value = material()
    return nodes.end(painted.outputs[0])


def _surface(style: str) -> bpy.types.NodeTree:
    """Make the node group of a style that colours a sensor's own surface, and can draw its dent larger."""
    nodes = NodeGroup(NAMES[style])
    quantity = "Change of the reading, counts," if style == "ELECTRODES" else "Displacement, in the object's units,"
    nodes.input(LARGEST, "Float", f"{quantity} at the colours' upper end", 1.0, 1e-6)
    nodes.input(EXAGGERATION, "Float", "How many times the dent is drawn; pictures keep the true one", 1.0, 0.0)
    if style == "DISPLACEMENT":
        nodes.input(ERROR, "Float", "Expected error, in the object's units: colours fade below it", 0.0, 0.0)
    given = nodes.tree.nodes.new("NodeGroupInput")
    here = nodes.output("GeometryNodeInputPosition")
    rest = nodes.attribute("rest_position", "FLOAT_VECTOR")
    # A style before this one, as dragged from the asset library, has drawn the dent larger already.
    before = nodes.add("GeometryNodeInputNamedAttribute", DISPLACEMENT, data_type="FLOAT_VECTOR").outputs
    moved = nodes.vector("SUBTRACT", here, rest)
    moved = nodes.output("GeometryNodeSwitch", before["Exists"], moved, before["Attribute"], input_type="VECTOR")
    kept = nodes.store(given.outputs["Geometry"], DISPLACEMENT, moved, "FLOAT_VECTOR")
    again = nodes.attribute(DISPLACEMENT, "FLOAT_VECTOR")
    ramp = nodes.add("ShaderNodeValToRGB", _SHARE[style](nodes, given.outputs[LARGEST], again))
    _fill(ramp.color_ramp, style)
    colour = ramp.outputs["Color"]
    if style == "ELECTRODES":
        # Grey far from electrodes; distances are in metres in any file.
        near = nodes.output("ShaderNodeMapRange", nodes.attribute(electrode_markers.DISTANCE), *_EDGE, 1.0, 0.0)
        colour = _over_grey(nodes, near, colour)
    elif style == "DISPLACEMENT":
        colour = _above_error(nodes, colour, again, given.outputs[ERROR])
    shown = nodes.store(kept, COLOUR, colour, "FLOAT_COLOR")
    more = nodes.math("SUBTRACT", given.outputs[EXAGGERATION], 1.0)
    extra = nodes.vector("SCALE", again, more)
    return _painted(nodes, nodes.output("GeometryNodeSetPosition", shown, None, None, extra))


def _moved(nodes: NodeGroup, largest: bpy.types.NodeSocket, moved: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    length = nodes.vector("LENGTH", moved)
    return nodes.math("DIVIDE", length, largest)


def _changed(nodes: NodeGroup, largest: bpy.types.NodeSocket, _moved: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    """Add nodes that map a reading's change to 0..1: -largest to 0, none to 0.5, +largest to 1. _moved is unused."""
    share = nodes.math("DIVIDE", nodes.attribute(frame_attribute.COUNTS), largest)
    return nodes.math("MULTIPLY_ADD", share, 0.5, 0.5)


def _above_error(
    nodes: NodeGroup, colour: bpy.types.NodeSocket, moved: bpy.types.NodeSocket, error: bpy.types.NodeSocket
) -> bpy.types.NodeSocket:
    """Add nodes that fade ``colour`` to grey where the displacement ``moved`` is below ``error``; return the output."""
    length = nodes.vector("LENGTH", moved)
    share = nodes.math("DIVIDE", length, nodes.math("MAXIMUM", error, 1e-9))
    return _over_grey(nodes, nodes.math("MINIMUM", share, 1.0), colour)


def _over_grey(nodes: NodeGroup, share: bpy.types.NodeSocket, colour: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    return nodes.output("ShaderNodeMix", share, (*STILL, 1.0), colour, data_type="RGBA")


_SHARE: dict[str, Callable] = {
    "DISPLACEMENT": _moved, "ELECTRODES": _changed,
    "CONTACT_PATCH": lambda nodes, *_: nodes.attribute(frame_attribute.PATCH),
}  # fmt: skip


def _fill(ramp: bpy.types.ColorRamp, style: str) -> None:
    stops = RAMPS[style]
    ramp.interpolation = "CONSTANT" if style == "CONTACT_PATCH" else "LINEAR"
    for place, _ in stops[2:]:
        ramp.elements.new(place)
    for element, (place, colour) in zip(ramp.elements, stops, strict=True):
        element.position, element.color = place, (*colour, 1.0)


def _arrow(style: str) -> bpy.types.NodeTree:
    """Make the node group that makes an arrow of a mesh 1 unit high along +Z: it scales and turns it by the force, and
    puts its lower end, the arrow's head, into the sensor's dent."""
    nodes = NodeGroup(NAMES[style])
    nodes.input(SENSOR, "Object", "A BioTac's skin or a DIGIT's gel")
    nodes.input(FORCE, "Vector", "Force on the sensor, N, in its axes")
    nodes.input(LENGTH, "Float", "Length of 1 N, in the object's units", 5.0, 1e-6)
    given = nodes.tree.nodes.new("NodeGroupInput")
    seen = nodes.add("GeometryNodeObjectInfo", given.outputs[SENSOR], transform_space="RELATIVE")
    force = given.outputs[FORCE]
    newtons = nodes.vector("LENGTH", force)
    length = nodes.math("MULTIPLY", newtons, given.outputs[LENGTH])
    back = nodes.vector("SCALE", force, -1.0)
    turn = nodes.tree.nodes.new("FunctionNodeAlignRotationToVector")
    turn.axis = "Z"
    nodes.tree.links.new(back, turn.inputs["Vector"])
    placed = nodes.add("GeometryNodeTransform", given.outputs["Geometry"])
    for name, socket in (("Translation", _mean_dent(nodes, seen.outputs["Geometry"])), ("Rotation", turn.outputs[0]),
                         ("Scale", length)):  # fmt: skip
        nodes.tree.links.new(socket, placed.inputs[name])
    return _painted(nodes, nodes.store(placed.outputs[0], COLOUR, (*ARROW, 1.0), "FLOAT_COLOR"))


def _mean_dent(nodes: NodeGroup, sensor: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    """Add nodes for the mean of a sensor's node places, weighted by squared displacement; return the output."""
    here = nodes.output("GeometryNodeInputPosition")
    rest = nodes.attribute("rest_position", "FLOAT_VECTOR")
    moved = nodes.vector("SUBTRACT", here, rest)
    weight = nodes.vector("DOT_PRODUCT", moved, moved)
    weighed = nodes.vector("SCALE", here, weight)
    sums = []
    for kind, value in (("FLOAT_VECTOR", weighed), ("FLOAT", weight)):
        node = nodes.add("GeometryNodeAttributeStatistic", sensor, None, value, data_type=kind, domain="POINT")
        sums.append(next(s for s in node.outputs if s.enabled and s.name == "Sum"))
    # Blender divides by zero to zero: nothing has moved, and there is no arrow.
    share = nodes.math("DIVIDE", 1.0, sums[1])
    return nodes.vector("SCALE", sums[0], share)


_BUILD = {"DISPLACEMENT": _surface, "CONTACT_PATCH": _surface, "ELECTRODES": _surface, "FORCE_ARROW": _arrow}
