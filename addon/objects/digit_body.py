"""The body of a gel's sensor, as a DIGIT: three LEDs, camera, acrylic and housing, as children of the gel."""

from __future__ import annotations

import math

import bpy
import numpy as np

from ...tactile_core import sensors
from ...tactile_core.pictures.mitsuba.window import ACRYLIC
from ...tactile_core.sensors.calibration import LARGEST_LEVEL, Calibration
from ...tactile_core.sensors.camera import Camera, Led
from ..settings import properties
from . import digit_materials, held_light, image_frame, surfaces

_CHIP = np.array([1.6e-3, 0.8e-3, 0.6e-3])  # m, sides of an LED package (0603)
_WALL = 1.5e-3  # m of housing beyond the LEDs' reach, and its depth below them
_DEPTH = 13e-3  # m from the gel's lowest point to the housing's lower end: below the LEDs (assumed)
_RIM = 2.2e-3  # m over height zero: the cover round the gel, below the LEDs
_COLOURS = {"red": (1.0, 0.0, 0.0), "green": (0.0, 1.0, 0.0), "blue": (0.0, 0.0, 1.0)}


def parts_of(gel: bpy.types.Object) -> list[bpy.types.Object]:
    """The gel's parts that a scene shows; with a gel that is appended alone Blender brings others, out of sight."""
    return [thing for thing in gel.children_recursive if thing.users_scene]


def has_body(gel: bpy.types.Object) -> bool:
    """Return true if a body was made for the gel: without LEDs it is then dark. A gel appended alone has none."""
    return any(thing.tactile.role == "BODY" for thing in parts_of(gel))


def leds_of(gel: bpy.types.Object) -> dict[str, bpy.types.Object]:
    """The gel's LEDs by colour; renamed ones are known by their role."""
    return {thing.tactile.colour: thing for thing in parts_of(gel) if thing.tactile.role == "LED"}


def camera_of(gel: bpy.types.Object) -> bpy.types.Object | None:
    """The gel's camera, if any."""
    return next((thing for thing in parts_of(gel) if thing.type == "CAMERA"), None)


def coating_of(gel: bpy.types.Object) -> bpy.types.Material | None:
    """The gel's coating: the first of its materials that is one."""
    materials = (slot.material for slot in gel.material_slots)
    return next((each for each in materials if each and digit_materials.is_coating(each)), None)


def add_body(gel: bpy.types.Object, unit: Calibration) -> None:
    """Add the missing parts of a unit's body to the gel; parts that exist stay as the user has changed them."""
    first = not has_body(gel)
    if coating_of(gel) is None:
        gel.data.materials.clear()
        gel.data.materials.append(digit_materials.new_coating(unit.coating))
    if first:
        for led in unit.leds:
            if led.colour not in leds_of(gel):
                _place_led(_add_led(gel, led), gel, led, unit)
        _add_shell(gel, unit)
    if camera_of(gel) is None:
        name = f"{sensors.title(unit.camera.sensor)} camera"
        lens = _child(gel, name, bpy.data.cameras.new(name), "NONE")
        place_camera(lens, gel, unit.camera)
    if first and coating_of(gel).users > 1:  # of a copied gel: its light is that of its own LEDs
        slot = next(slot for slot in gel.material_slots if slot.material == coating_of(gel))
        slot.link, slot.material = "OBJECT", slot.material.copy()
    if first or held_light.NODE not in coating_of(gel).node_tree.nodes:
        _hold_light(gel, unit)
    _link_light(gel)


def reset(gel: bpy.types.Object, unit: Calibration) -> None:
    """Put LEDs, coating and camera back to a unit's calibration; their keys and drivers are removed."""
    add_body(gel, unit)
    for led in unit.leds:
        thing = leds_of(gel).get(led.colour) or _add_led(gel, led)
        thing.animation_data_clear(), thing.data.animation_data_clear()
        _place_led(thing, gel, led, unit)
    _link_light(gel)
    lens = camera_of(gel)
    lens.animation_data_clear(), lens.data.animation_data_clear()
    place_camera(lens, gel, unit.camera)
    digit_materials.set_coating(coating_of(gel), unit.coating)
    _hold_light(gel, unit)


def _link_light(gel: bpy.types.Object) -> None:
    """Let LEDs light the gel, its acrylic and its housing alone, by Blender's light linking; not those linked by hand.

    The gel throws no shadow, so that without it their light would fall on what stands around.
    """
    leds = leds_of(gel).values()
    new = [led for led in leds if led.light_linking.receiver_collection is None]
    if not new:
        return
    known = (led.light_linking.receiver_collection for led in leds)
    lit = next(filter(None, known), None) or bpy.data.collections.new("DIGIT lit by its LEDs")
    for thing in (gel, *parts_of(gel)):
        if thing.tactile.role in ("DIGIT", "BODY") and thing.name not in lit.objects:
            lit.objects.link(thing)
    for led in new:
        led.light_linking.receiver_collection = lit


def _hold_light(gel: bpy.types.Object, unit: Calibration) -> None:
    """Add the light that gel and acrylic hold, which goes with the LEDs' power."""
    held_light.write(gel, unit)
    gel.visible_shadow = False  # its dome, higher than the calibrated gel's, would hide the LEDs from its edges
    material = coating_of(gel)
    if held_light.NODE not in material.node_tree.nodes:
        held_light.add_nodes(material)
    held_light.drive(material, leds_of(gel), {led.colour: _power(led, gel) for led in unit.leds})


def _power(led: Led, gel: bpy.types.Object) -> float:
    """Blender's power, W, of an LED's lamp."""
    return led.radiance * led.radius**2 * watts_per_brightness(gel.tactile.per_metre)


def watts_per_brightness(per_metre: float) -> float:
    """Blender's power, W, of a lamp of radiance x radius^2 = 1 level m^2, with which 255 levels render as white.

    A point lamp of power P lights a matte coating of albedo a at distance d to a P / (4 pi^2 d^2); the calibration's
    sphere of radiance L and radius r to a L r^2 / d^2 levels.
    """
    return 4 * math.pi**2 / LARGEST_LEVEL * per_metre**2


def place_camera(lens: bpy.types.Object, gel: bpy.types.Object, camera: Camera) -> None:
    """Put a camera where the sensor's own seems to be, with its angle of view."""
    per_metre, high = gel.tactile.per_metre, camera.apparent_height
    lens.location = image_frame.to_gel([[0, 0, high]], camera, per_metre)[0]
    # It looks up into the gel, its own -Z along the scene's Z; the fingertip, -X, is up in the picture.
    lens.rotation_mode, lens.rotation_euler = "XYZ", (math.pi, 0.0, -math.pi / 2 * camera.down_x)
    lens.scale = (1, 1, 1)
    size = camera.height * camera.pixel_size[1]
    data = lens.data
    data.sensor_fit, data.lens_unit, data.angle = "VERTICAL", "FOV", 2 * math.atan(size / 2 / high)
    data.clip_start, data.display_size = 1e-4 * per_metre, 2e-3 * per_metre


def _child(gel: bpy.types.Object, name: str, data: bpy.types.ID, role: str) -> bpy.types.Object:
    thing = bpy.data.objects.new(name, data)
    properties.set_up_part(thing, gel, role)
    return thing


def _add_led(gel: bpy.types.Object, led: Led) -> bpy.types.Object:
    """A lamp with its package, which glows in the lamp's colour."""
    name = f"LED {led.colour}"
    thing = _child(gel, name, bpy.data.lights.new(name, "POINT"), "LED")
    thing.tactile.colour = led.colour
    half = _CHIP * gel.tactile.per_metre / 2
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
    faces = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    faces = np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
    chip = surfaces.new_mesh_object(f"{name} package", corners, faces, smooth=False)
    properties.set_up_part(chip, thing, "BODY")
    chip.hide_select = True
    chip.visible_shadow = False  # it stands inside its lamp
    chip.data.materials.append(digit_materials.glow())
    for index in range(3):
        _drive(chip, index, thing.data)
    return thing


def _drive(chip: bpy.types.Object, index: int, lamp: bpy.types.Light) -> None:
    """Let a package show its lamp's colour, black where that is off; works without the add-on."""
    driver = chip.driver_add("color", index).driver
    driver.type = "SCRIPTED"
    for name, path in (("shade", f"color[{index}]"), ("power", "energy")):
        variable = driver.variables.new()
        variable.name, target = name, variable.targets[0]
        target.id_type, target.id, target.data_path = "LIGHT", lamp, path
    driver.expression = "shade * min(power, 1)"


def _place_led(thing: bpy.types.Object, gel: bpy.types.Object, led: Led, unit: Calibration) -> None:
    per_metre = gel.tactile.per_metre
    thing.matrix_parent_inverse.identity()
    thing.location = image_frame.to_gel([led.position], unit.camera, per_metre)[0]
    lamp = thing.data
    lamp.color = _COLOURS[led.colour]
    lamp.shadow_soft_size, lamp.use_soft_falloff = led.radius * per_metre, False
    lamp.energy = _power(led, gel)


def _add_shell(gel: bpy.types.Object, unit: Calibration) -> None:
    """Acrylic under the gel; a cover round it and four walls that enclose the LEDs, open below."""
    camera = unit.camera
    outline, title = _outline(camera.sensor), sensors.title(camera.sensor)
    top = sensors.shape_of(camera.sensor).back_y
    bottom = top + ACRYLIC
    _add_solid(gel, f"{title} acrylic", _prism(outline, top, bottom), digit_materials.acrylic())
    rim = _wide(outline, unit)
    cover, wall = camera.height_zero_y + _RIM, camera.height_zero_y + _DEPTH
    count = len(outline)
    rings = [(outline, cover), (rim, cover), (rim, wall)]
    nodes = np.concatenate([_at(points, level) for points, level in rings])
    index = np.arange(count)
    after = np.roll(index, -1)
    quads = [
        np.stack([k * count + index, k * count + after, (k + 1) * count + after, (k + 1) * count + index], -1)
        for k in range(len(rings) - 1)
    ]
    _add_solid(gel, f"{title} housing", (nodes, _triangles(np.concatenate(quads))), digit_materials.housing())


def _add_solid(gel, name: str, mesh: tuple[np.ndarray, np.ndarray], material: bpy.types.Material) -> None:  # noqa: ANN001
    from . import axes

    nodes, faces = mesh
    thing = surfaces.new_mesh_object(name, axes.to_blender(nodes, gel.tactile.per_metre), faces, smooth=False)
    properties.set_up_part(thing, gel, "BODY")
    thing.hide_select = True
    thing.data.materials.append(material)
    thing.color = material.diffuse_color


def _outline(sensor: str) -> np.ndarray:
    """The gel's outline (n, 2) m, x and z, from the side of +z over the tip: the border of its lattice."""
    surface = sensors.sensor_surface(sensor)
    grid = surface.grid(surface.rest)[..., [0, 2]]
    return np.concatenate([grid[::-1, -1], grid[0, -2::-1], grid[1:, 0], grid[-1, 1:-1]])


def _wide(outline: np.ndarray, unit: Calibration) -> np.ndarray:
    """The outline moved out so that the housing encloses all LEDs."""
    leds = np.array([image_frame.to_gel([led.position], unit.camera, 1.0)[0] for led in unit.leds])[:, :2]
    reach = np.array([led.radius for led in unit.leds])[:, None] + _WALL
    low = np.minimum((leds - reach).min(0), outline.min(0) - _WALL)
    high = np.maximum((leds + reach).max(0), outline.max(0) + _WALL)
    middle, half = (low + high) / 2, (high - low) / 2
    toward = outline - (outline.min(0) + outline.max(0)) / 2
    toward = toward / np.abs(outline - (outline.min(0) + outline.max(0)) / 2).max(0)
    rounded = np.abs(toward) ** 0.5 * np.sign(toward)  # a box with round corners
    largest = np.abs(rounded).max(1, keepdims=True)
    blend = rounded / np.maximum(largest, 1e-9)
    return middle + (0.85 * blend + 0.15 * rounded) * half


def _at(points: np.ndarray, level: float) -> np.ndarray:
    return np.stack([points[:, 0], np.full(len(points), level), points[:, 1]], -1)


def _prism(outline: np.ndarray, top: float, bottom: float) -> tuple[np.ndarray, np.ndarray]:
    count, index = len(outline), np.arange(len(outline))
    after = np.roll(index, -1)
    sides = _triangles(np.stack([index, after, count + after, count + index], -1))
    middle = outline.mean(axis=0, keepdims=True)  # inside: no outline here is bent inward
    nodes = np.concatenate([_at(outline, top), _at(outline, bottom), _at(middle, top), _at(middle, bottom)])
    upper = np.stack([np.full(count, 2 * count), after, index], -1)
    lower = np.stack([np.full(count, 2 * count + 1), count + index, count + after], -1)
    return nodes, np.concatenate([sides, upper, lower])


def _triangles(quads: np.ndarray) -> np.ndarray:
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
