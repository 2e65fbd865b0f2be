"""Materials of a DIGIT's body for Cycles and EEVEE; the coating's numbers are those that the picture is made with.

Acrylic and housing reflect toward a camera alone: what they give the gel is part of the light held
in it (``held_light``), as the calibration counts it.
"""

from __future__ import annotations

import bpy

from ...tactile_core.sensors.calibration import DIFFUSE, Coating
from .surfaces import new_material

LIT = "Lit by LEDs"  # attribute of a gel's points, 1: only these have an outer side with LEDs below it
ALBEDO, ROUGHNESS, GLOSS = "Albedo", "Roughness", "Gloss"
_PLACES = {ALBEDO: (-300, 200), ROUGHNESS: (-300, 0), GLOSS: (-300, -150)}


def is_coating(material: bpy.types.Material) -> bool:
    """Return true for a material that holds a coating's numbers."""
    return material.node_tree is not None and ALBEDO in material.node_tree.nodes


def new_coating(coating: Coating) -> bpy.types.Material:
    """Make the paint on the gel: albedo, roughness and gloss are nodes, which can be keyed and driven."""
    material, shader = _new("DIGIT coating", (0.75, 0.75, 0.78, 1.0))
    nodes, links = material.node_tree.nodes, material.node_tree.links
    for name, kind, socket in ((ALBEDO, "ShaderNodeRGB", "Base Color"), (ROUGHNESS, "ShaderNodeValue", "Roughness"),
                               (GLOSS, "ShaderNodeValue", "Specular IOR Level")):  # fmt: skip
        node = nodes.new(kind)
        node.name = node.label = name
        node.location = _PLACES[name]
        links.new(node.outputs[0], shader.inputs[socket])
    keep_leds_inside(material)
    set_coating(material, coating)
    return material


def keep_leds_inside(material: bpy.types.Material) -> None:
    """Tilt the normals of a lit gel's outer side up, so that LEDs below its rim do not colour it; its inner side stays.

    Light goes through the whole body, so that the gel's outer side has no shadow from it either.
    """
    nodes = material.node_tree.nodes
    lit, own, turn = (nodes.new(f"ShaderNode{kind}") for kind in ("Attribute", "TexCoord", "VectorTransform"))
    lit.attribute_name = LIT
    turn.vector_type, turn.convert_from, turn.convert_to = "NORMAL", "OBJECT", "WORLD"
    outer = math(material, "SUBTRACT", 1.0, nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"])
    up = math(
        material, "SCALE", (0.0, 0.0, 1.0), math(material, "MULTIPLY", lit.outputs["Fac"], outer), kind="VectorMath"
    )
    tilted = math(material, "ADD", own.outputs["Normal"], up, kind="VectorMath")
    material.node_tree.links.new(tilted, turn.inputs[0])
    shader = next(node for node in nodes if node.type == "BSDF_PRINCIPLED")
    material.node_tree.links.new(turn.outputs[0], shader.inputs["Normal"])


def set_coating(material: bpy.types.Material, coating: Coating) -> None:
    """Write a coating's numbers; a matte one has no gloss."""
    if material.node_tree.animation_data:
        material.node_tree.animation_data_clear()
    sockets = sockets_of(material)
    sockets[ALBEDO].default_value = (*coating.albedo, 1.0)
    sockets[ROUGHNESS].default_value = coating.roughness
    sockets[GLOSS].default_value = 0.0 if coating.bsdf == DIFFUSE else coating.gloss


def sockets_of(material: bpy.types.Material) -> dict[str, bpy.types.NodeSocket]:
    """Return the coating's numbers as sockets, by name, without those whose node was deleted."""
    nodes = material.node_tree.nodes
    return {name: nodes[name].outputs[0] for name in _PLACES if name in nodes}


def acrylic() -> bpy.types.Material:
    """Make clear acrylic: it lets all light through, as the calibration has its losses; reflections come on top."""
    found = bpy.data.materials.get("DIGIT acrylic")
    if found is not None:
        return found
    material, shader = _new("DIGIT acrylic", (0.7, 0.8, 0.85, 0.25))
    nodes, links = material.node_tree.nodes, material.node_tree.links
    clear, gloss, both = (nodes.new(f"ShaderNode{kind}") for kind in ("BsdfTransparent", "BsdfGlossy", "AddShader"))
    fresnel = nodes.new("ShaderNodeFresnel")
    fresnel.inputs["IOR"].default_value = 1.49  # of acrylic
    gloss.inputs["Roughness"].default_value = 0.05
    output = next(node for node in nodes if node.type == "OUTPUT_MATERIAL")
    nodes.remove(shader)
    links.new(toward_camera(material, fresnel.outputs[0]), gloss.inputs["Color"])
    links.new(clear.outputs[0], both.inputs[0]), links.new(gloss.outputs[0], both.inputs[1])
    links.new(both.outputs[0], output.inputs["Surface"])
    if hasattr(material, "surface_render_method"):
        material.surface_render_method = "BLENDED"
    return material


def of_body(name: str, colour: list[float], roughness: float, metallic: float = 0.0) -> bpy.types.Material:
    """Make a body's material, or find it; the arguments are a row of ``materials`` in ``sensor_bodies.toml``."""
    label = f"Tactile {name}"
    found = bpy.data.materials.get(label)
    if found is not None:
        return found
    material, shader = _new(label, (*colour, 1.0))
    shader.inputs["Roughness"].default_value, shader.inputs["Metallic"].default_value = roughness, metallic
    own = material.node_tree.nodes.new("ShaderNodeRGB").outputs[0]
    own.default_value = (*colour, 1.0)
    ray = toward_camera(material, 1.0)
    material.node_tree.links.new(math(material, "SCALE", own, ray, kind="VectorMath"), shader.inputs["Base Color"])
    material.node_tree.links.new(toward_camera(material, 0.5), shader.inputs["Specular IOR Level"])
    return material


def toward_camera(material: bpy.types.Material, value: bpy.types.NodeSocket | float) -> bpy.types.NodeSocket:
    """Return a node's output: ``value`` for rays that come from a camera, 0 for all others."""
    ray = material.node_tree.nodes.new("ShaderNodeLightPath").outputs["Is Camera Ray"]
    return math(material, "MULTIPLY", ray, value)


def math(material: bpy.types.Material, operation: str, *values: object, kind: str = "Math") -> bpy.types.NodeSocket:
    """Add a math node and return its output; values : its inputs; kind : ``VectorMath`` for one of vectors"""
    node = material.node_tree.nodes.new(f"ShaderNode{kind}")
    node.operation = operation
    for socket, value in zip([socket for socket in node.inputs if socket.enabled], values, strict=False):
        if isinstance(value, bpy.types.NodeSocket):
            material.node_tree.links.new(value, socket)
        else:
            socket.default_value = value
    return node.outputs[0]


def _new(name: str, shown: tuple[float, ...]) -> tuple[bpy.types.Material, bpy.types.Node]:
    material, shader = new_material(name)
    material.diffuse_color = shown  # in the Solid view
    return material, shader
