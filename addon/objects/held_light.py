"""Add "held light", which gel and acrylic scatter, for Cycles and EEVEE: a DIGIT's picture at rest less direct light.

Three attributes of the gel's points hold it, one per LED, in levels of each channel at the calibration's power and an
albedo of 1. The coating's material adds them to the lamps' light, scaled by the present power and albedo. As the
camera's response mixes the LEDs' colours, a lamp can be brighter than the picture: the held light is then negative.
"""

from __future__ import annotations

import bpy
import numpy as np

from ...tactile_core.pictures.background import by_led, open_radiance, resting_picture
from ...tactile_core.pictures.perspective import lookup
from ...tactile_core.sensors.calibration import LARGEST_LEVEL, Calibration
from ...tactile_core.sensors.camera import COLOURS
from ...tactile_core.sensors.unrolling import node_normals
from . import digit_materials
from .node_group import Nodes

NODE = "Held light"  # the sum of the LEDs' parts, in the material
_DARKEST = 1e-3  # least albedo or radiance to divide by


def attribute(colour: str) -> str:
    """Return the name of the mesh attribute of one LED's held light; colour : "red", "green" or "blue", the LED's"""
    return f"{NODE} {colour}"


def write(gel: bpy.types.Object, unit: Calibration) -> None:
    """Give the gel's points a unit's held light, in place of another's."""
    levels = held_light(unit)
    mesh = gel.data
    lit = mesh.attributes.get(digit_materials.LIT) or mesh.attributes.new(digit_materials.LIT, "FLOAT", "POINT")
    lit.data.foreach_set("value", np.ones(len(levels), np.float32))
    for k, colour in enumerate(COLOURS):
        name = attribute(colour)
        held = mesh.attributes.get(name) or mesh.attributes.new(name, "FLOAT_VECTOR", "POINT")
        scaled = levels[..., k] / max(unit.coating.albedo[k], _DARKEST)
        held.data.foreach_set("vector", np.ascontiguousarray(scaled, np.float32).ravel())


def held_light(unit: Calibration) -> np.ndarray:
    """Return grey levels (n, 3, 3) at the gel's nodes, by channel and LED, each red, green, blue: the picture at rest
    less the lamps' direct light."""
    radiance = open_radiance(unit)
    levels = by_led(unit, radiance)
    diagonal = np.arange(3)
    levels[..., diagonal, diagonal] += resting_picture(unit, radiance) - levels.sum(-1)  # a photograph's
    camera = unit.camera
    x, y, z = camera.surface.rest.T
    look_up = lookup(*camera.to_pixel(x, z, y - camera.height_zero_y), camera.shape)
    maps = np.ascontiguousarray(levels.reshape(*camera.shape, 9).transpose(2, 0, 1))
    held = np.stack([look_up(part) for part in maps], -1).reshape(-1, 3, 3)
    held[:, diagonal, diagonal] -= _lamp_light(unit)
    return held


def _lamp_light(unit: Calibration) -> np.ndarray:
    """Return the grey levels (n, 3) that the lamp of each LED gives the resting gel's nodes, by Lambert's law."""
    surface, camera = unit.camera.surface, unit.camera

    def in_image(points: np.ndarray) -> np.ndarray:
        return np.stack([camera.right_z * points[:, 2], camera.down_x * points[:, 0], points[:, 1]], -1)

    middle = np.array([[camera.centre_x, camera.height_zero_y, camera.centre_z]])
    places, inward = in_image(surface.rest - middle), -in_image(node_normals(surface.rest, surface.faces))
    light = np.empty((len(places), 3))
    for k, led in enumerate(unit.leds):
        toward = np.asarray(led.position) - places
        distance = np.linalg.norm(toward, axis=1)
        facing = np.maximum((toward * inward).sum(1), 0.0) / distance
        light[:, k] = led.radiance * unit.coating.albedo[k] * led.radius**2 * facing / distance**2
    return light


def add_nodes(material: bpy.types.Material) -> None:
    """Let a coating's inner side emit the held light, for rays from the camera alone.

    Blender must not let that side light itself: the held light includes this, less than a level at rest, and Blender's
    gel, whose dome (the public mesh's) is three times as high, would add more.
    """
    nodes = Nodes(material.node_tree)
    for left in [node for node in nodes.tree.nodes if node.name.startswith(NODE)]:
        nodes.tree.nodes.remove(left)
    albedo = nodes.tree.nodes[digit_materials.ALBEDO].outputs[0]
    colour = nodes.add("ShaderNodeSeparateColor", albedo)
    total = None
    for k, name in enumerate(map(attribute, COLOURS)):
        held = nodes.add("ShaderNodeAttribute", attribute_name=name).outputs["Vector"]
        share = nodes.math("MULTIPLY", nodes.output("ShaderNodeValue", name=name, label=name), colour.outputs[k])
        part = nodes.vector("SCALE", held, share)
        total = part if total is None else nodes.vector("ADD", total, part)
    inner = nodes.add("ShaderNodeNewGeometry").outputs["Backfacing"]
    seen = digit_materials.toward_camera(nodes, inner)
    glow = nodes.output("ShaderNodeEmission", total, nodes.math("DIVIDE", seen, LARGEST_LEVEL), name=NODE, label=NODE)
    surface = digit_materials.surface_of(material)
    both = nodes.output("ShaderNodeAddShader", *[link.from_socket for link in surface.links], glow)
    nodes.tree.links.new(both, surface)
    between = nodes.math("SUBTRACT", inner, seen)
    lit = nodes.vector("SCALE", albedo, nodes.math("SUBTRACT", 1.0, between))
    for link in [link for link in albedo.links if link.to_socket.name == "Base Color"]:
        nodes.tree.links.new(lit, link.to_socket)


def driven_by(material: bpy.types.Material) -> set[bpy.types.ID]:
    """Return the LED objects, and their lamps, that drive the held light in a coating."""
    moves = material.node_tree.animation_data
    variables = [each for curve in (moves.drivers if moves else ()) for each in curve.driver.variables]
    return {target.id for variable in variables for target in variable.targets if target.id is not None}


def drive(material: bpy.types.Material, leds: dict[str, bpy.types.Object], full: dict[str, float]) -> None:
    """Let each LED's held light in a coating follow that LED's power, by drivers, which work without the add-on.

    leds : colour ("red", ...) -> its LED object; full : colour -> power, W, of its lamp by the calibration
    """
    for k, name in enumerate(COLOURS):
        socket = material.node_tree.nodes[attribute(name)].outputs[0]
        socket.driver_remove("default_value")
        socket.default_value = 0.0
        if name not in leds or not full[name] > 0:
            continue
        driver = socket.driver_add("default_value").driver
        driver.type, lamp = "SCRIPTED", leds[name].data
        follows = [("power", "LIGHT", lamp, "energy"), ("shade", "LIGHT", lamp, f"color[{k}]"),
                   ("off", "OBJECT", leds[name], "hide_render")]  # fmt: skip
        expression = f"power * shade * (1 - off) / {full[name]!r}"
        if hasattr(lamp, "exposure"):  # since Blender 4.5
            follows += [("stops", "LIGHT", lamp, "exposure"), ("warm", "LIGHT", lamp, "use_temperature"),
                        ("tint", "LIGHT", lamp, f"temperature_color[{k}]")]  # fmt: skip
            expression += " * pow(2, stops) * (1 - warm + warm * tint)"
        for label, kind, thing, path in follows:
            variable = driver.variables.new()
            variable.name, target = label, variable.targets[0]
            target.id_type, target.id, target.data_path = kind, thing, path
        driver.expression = expression
