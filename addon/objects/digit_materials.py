"""Make a DIGIT's materials for Cycles and EEVEE; the coating has the numbers by which the toolkit draws its picture.

Acrylic and housing reflect into the camera alone: what they reflect onto the gel is part of its ``held_light``.
"""

from __future__ import annotations

import bpy

from ...tactile_core.sensors.calibration import DIFFUSE, Coating
from .node_group import Nodes
from .surfaces import new_material

LIT = "Lit by LEDs"  # attribute of a gel's points, 1; other meshes with the material lack it
ALBEDO, ROUGHNESS, GLOSS = "Albedo", "Roughness", "Gloss"
_PLACES = {ALBEDO: (-300, 200), ROUGHNESS: (-300, 0), GLOSS: (-300, -150)}


def new_coating(coating: Coating) -> bpy.types.Material:
    """Make the material of the gel's coating. Albedo, roughness and gloss are nodes, so that they can be keyed."""
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
    """Tilt the shading normals of a gel's outer side up in its material: LEDs below its rim must not light that side,
    and the body, which would shade it, throws no shadow. Normals of the inner side stay."""
    nodes = Nodes(material.node_tree)
    lit = nodes.add("ShaderNodeAttribute", attribute_name=LIT).outputs["Fac"]
    own = nodes.add("ShaderNodeTexCoord").outputs["Normal"]
    outer = nodes.math("SUBTRACT", 1.0, nodes.add("ShaderNodeNewGeometry").outputs["Backfacing"])
    tilted = nodes.vector("ADD", own, nodes.vector("SCALE", (0.0, 0.0, 1.0), nodes.math("MULTIPLY", lit, outer)))
    to_world = {"vector_type": "NORMAL", "convert_from": "OBJECT", "convert_to": "WORLD"}
    turned = nodes.output("ShaderNodeVectorTransform", tilted, **to_world)
    shader = next(node for node in nodes.tree.nodes if node.type == "BSDF_PRINCIPLED")
    nodes.tree.links.new(turned, shader.inputs["Normal"])


def set_coating(material: bpy.types.Material, coating: Coating) -> None:
    """Write a coating's numbers into its material and remove its keys and drivers; a matte coating gets gloss 0."""
    if material.node_tree.animation_data:
        material.node_tree.animation_data_clear()
    gloss = 0.0 if coating.bsdf == DIFFUSE else coating.gloss
    values = {ALBEDO: (*coating.albedo, 1.0), ROUGHNESS: coating.roughness, GLOSS: gloss}
    for name, socket in sockets_of(material).items():
        socket.default_value = values[name]


def sockets_of(material: bpy.types.Material) -> dict[str, bpy.types.NodeSocket]:
    """Return name -> socket of a coating's "Albedo", "Roughness" and "Gloss"; nodes that were deleted are left out."""
    nodes = material.node_tree.nodes
    return {name: nodes[name].outputs[0] for name in _PLACES if name in nodes}


def acrylic() -> bpy.types.Material:
    """Make or find clear acrylic: all light passes, as the calibration has its losses, and reflections are added."""
    found = bpy.data.materials.get("DIGIT acrylic")
    if found is not None:
        return found
    material, shader = _new("DIGIT acrylic", (0.7, 0.8, 0.85, 0.25))
    nodes = Nodes(material.node_tree)
    nodes.tree.nodes.remove(shader)
    fresnel = nodes.output("ShaderNodeFresnel", 1.49)  # refractive index of acrylic
    gloss = nodes.output("ShaderNodeBsdfGlossy", toward_camera(nodes, fresnel), 0.05)  # colour, roughness
    both = nodes.output("ShaderNodeAddShader", nodes.output("ShaderNodeBsdfTransparent"), gloss)
    nodes.tree.links.new(both, surface_of(material))
    material.surface_render_method = "BLENDED"
    return material


def of_body(name: str, colour: list[float], roughness: float, metallic: float = 0.0) -> bpy.types.Material:
    """Make or find the material ``name`` of a body: colour (3,) linear RGB, roughness and metallic, all 0 to 1, as in
    ``materials`` of ``sensor_bodies.toml``."""
    label = f"Tactile {name}"
    found = bpy.data.materials.get(label)
    if found is not None:
        return found
    material, shader = _new(label, (*colour, 1.0))
    shader.inputs["Roughness"].default_value, shader.inputs["Metallic"].default_value = roughness, metallic
    nodes = Nodes(material.node_tree)
    own = nodes.output("ShaderNodeRGB")
    own.default_value = (*colour, 1.0)
    seen = nodes.vector("SCALE", own, toward_camera(nodes, 1.0))
    nodes.tree.links.new(seen, shader.inputs["Base Color"])
    nodes.tree.links.new(toward_camera(nodes, 0.5), shader.inputs["Specular IOR Level"])
    return material


def toward_camera(nodes: Nodes, value: bpy.types.NodeSocket | float) -> bpy.types.NodeSocket:
    """Add nodes whose output is ``value`` for rays from the camera and 0 for all others; return that output."""
    return nodes.math("MULTIPLY", nodes.add("ShaderNodeLightPath").outputs["Is Camera Ray"], value)


def surface_of(material: bpy.types.Material) -> bpy.types.NodeSocket:
    """Return the socket of a material's output node that takes the shader of its surface."""
    return next(node for node in material.node_tree.nodes if node.type == "OUTPUT_MATERIAL").inputs["Surface"]


def _new(name: str, shown: tuple[float, ...]) -> tuple[bpy.types.Material, bpy.types.Node]:
    material, shader = new_material(name)
    material.diffuse_color = shown  # in the Solid view
    return material, shader
