"""Add the body of an optical sensor, such as a DIGIT, to its gel: LEDs, camera, acrylic, housing, all its children."""

from __future__ import annotations

import math

import bpy
from bpy.app.handlers import persistent

from ...tactile_core import sensors
from ...tactile_core.sensors.calibration import LARGEST_LEVEL, Calibration
from ...tactile_core.sensors.camera import Camera, Led
from ..settings import properties
from . import axes, digit_materials, held_light, sensor_bodies, surfaces

_INSIDE = 9e-3  # m below the gel's lowest point, under its window: there the camera's view in Cycles begins
_LINKS = "receiver_collection", "blocker_collection"
# Names of the collections that the extension makes to link light.
_LIT, _THROUGH = "DIGIT lit by its LEDs", "DIGIT shone through by its LEDs"
_COLOURS = {"red": (1.0, 0.0, 0.0), "green": (0.0, 1.0, 0.0), "blue": (0.0, 0.0, 1.0)}


def parts_of(gel: bpy.types.Object) -> list[bpy.types.Object]:
    """Return the gel's children that are in a scene; those that came along with an appended gel are in none."""
    return [thing for thing in gel.children_recursive if thing.users_scene]


def has_body(gel: bpy.types.Object) -> bool:
    """Return true if the gel has a body: then its LEDs alone light it. A gel that was appended alone has none."""
    return any(thing.tactile.role == "BODY" for thing in parts_of(gel))


def leds_of(gel: bpy.types.Object) -> dict[str, bpy.types.Object]:
    """Return the gel's LED objects by colour ("red", "green", "blue"), whatever they are called in the scene."""
    return {thing.tactile.colour: thing for thing in parts_of(gel) if thing.tactile.role == "LED"}


def camera_of(gel: bpy.types.Object) -> bpy.types.Object | None:
    """Return the camera object among the gel's parts, None without one."""
    return next((thing for thing in parts_of(gel) if thing.type == "CAMERA"), None)


def coating_of(gel: bpy.types.Object) -> bpy.types.Material | None:
    """Return the gel's coating, the first of its materials that holds a coating's numbers; None without one."""
    materials = (slot.material for slot in gel.material_slots)
    trees = ((each, each.node_tree) for each in materials if each)
    return next((each for each, tree in trees if tree is not None and digit_materials.ALBEDO in tree.nodes), None)


def add_body(gel: bpy.types.Object, unit: Calibration) -> None:
    """Add the missing parts of a unit's body to the gel; parts that exist stay as the user has changed them."""
    first = not has_body(gel)
    if coating_of(gel) is None:
        materials = [slot.material for slot in gel.material_slots]
        own = [each for each in materials if each and each.name != surfaces.OBJECT_COLOUR]
        gel.data.materials.clear()
        for material in (digit_materials.new_coating(unit.coating), *own):  # the user's are kept, in slots of no face
            gel.data.materials.append(material)
    if first:
        gel.tactile.calibrated = unit.unit
        for led in unit.leds:
            if led.colour not in leds_of(gel):
                _place_led(_add_led(gel, led), gel, led, unit)
        sensor_bodies.add_parts(gel)
    if camera_of(gel) is None:
        name = f"{sensors.title(unit.camera.sensor)} camera"
        lens = _child(gel, name, bpy.data.cameras.new(name), "NONE")
        place_camera(lens, gel, unit.camera)
    lamps, leds = held_light.driven_by(coating_of(gel)), leds_of(gel).values()
    copied = bool(lamps and leds) and lamps.isdisjoint(leds)
    shared = coating_of(gel).users > 1 or gel.data.users > 1
    if (first or copied) and shared:  # of a copied gel: its light is that of its own LEDs
        slot = next(slot for slot in gel.material_slots if slot.material == coating_of(gel))
        slot.link, slot.material = "OBJECT", slot.material.copy()
    if first or copied or held_light.NODE not in coating_of(gel).node_tree.nodes:
        _hold_light(gel, unit)
    _link_light(gel)


def reset(gel: bpy.types.Object, unit: Calibration) -> None:
    """Put LEDs, coating and camera back to a unit's calibration; their keys and drivers are removed."""
    add_body(gel, unit)
    gel.tactile.calibrated = unit.unit
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
    """Let LEDs light the gel alone, and shine through the body, by Blender's light linking.

    The calibration places some LEDs outside the housing, which must not hide them. Without linking, their light would
    fall on what stands around, as gel and housing throw no shadow. LEDs that the user has linked stay as they are.
    """
    leds = leds_of(gel).values()
    new = [led for led in leds if _lights_another(led, gel)]
    if new:
        known = next((led.light_linking.receiver_collection for led in leds if led not in new), None)
        lit = known or bpy.data.collections.new(_LIT)
        if gel.name not in lit.objects:
            lit.objects.link(gel)
        through = bpy.data.collections.new(_THROUGH)
        for part in parts_of(gel):
            if part.tactile.role == "BODY":
                through.objects.link(part)
        for entry in through.collection_objects:
            entry.light_linking.link_state = "EXCLUDE"
    for led in new:
        led.light_linking.receiver_collection, led.light_linking.blocker_collection = lit, through
    for led in leds:
        # Blender does not see that a library override's LEDs need these: it would make a second, unlit gel with them.
        for name in (name for name in _LINKS if getattr(led.light_linking, name) is not None):
            led[name] = getattr(led.light_linking, name)
            led.property_overridable_library_set(f'["{name}"]', True)


def _lights_another(led: bpy.types.Object, gel: bpy.types.Object) -> bool:
    """Return true if an LED is not linked yet, or was copied, linked to another gel."""
    group = led.light_linking.receiver_collection
    gels = [] if group is None else [thing for thing in group.objects if thing.tactile.role == "DIGIT"]
    return group is None or (bool(gels) and gel not in gels)


def _hold_light(gel: bpy.types.Object, unit: Calibration) -> None:
    """Let the gel's material add the light scattered in gel and acrylic (``held_light``) and scale it by LED power."""
    held_light.write(gel, unit)
    gel.visible_shadow = False  # its dome, higher than the calibrated gel's, would hide the LEDs from its edges
    material = coating_of(gel)
    if held_light.NODE not in material.node_tree.nodes:
        held_light.add_nodes(material)
    held_light.drive(material, leds_of(gel), {led.colour: _power(led, gel) for led in unit.leds})


def _power(led: Led, gel: bpy.types.Object) -> float:
    """Return Blender's power, W, of an LED's lamp in the scene of a gel."""
    return led.radiance * led.radius**2 * watts_per_brightness(gel.tactile.per_metre)


def watts_per_brightness(per_metre: float) -> float:
    """Return the power, W, of Blender's lamp for a brightness (radiance x radius^2) of 1 level m^2, with white at 255.
    per_metre : Blender units in a metre

    A point lamp of power P lights a matte coating of albedo a at distance d to a P / (4 pi^2 d^2); the calibration's
    sphere of radiance L and radius r to a L r^2 / d^2 levels.
    """
    return 4 * math.pi**2 / LARGEST_LEVEL * per_metre**2


@persistent
def _keep_links_out_of_scenes(context: bpy.types.BlendImportContext) -> None:
    """Put what an appended or pasted LED lights beside it: Blender shows the collections that link light instead."""
    things = {item.id for item in context.import_items if item.id_type == "OBJECT" and item.id is not None}
    leds = [thing for thing in things if thing.tactile.role == "LED" and thing.library is None]
    for led in (thing for thing in leds if thing.users_collection):
        for group in filter(None, (getattr(led.light_linking, name) for name in _LINKS)):
            if not group.name.startswith((_LIT, _THROUGH)):
                continue  # the user's own
            for parent in (*bpy.data.collections, *(scene.collection for scene in bpy.data.scenes)):
                if group in parent.children.values():
                    parent.children.unlink(group)
            home = properties.home_of(led)
            for thing in group.objects:
                if thing not in home.objects.values():
                    home.objects.link(thing)


def place_camera(lens: bpy.types.Object, gel: bpy.types.Object, camera: Camera) -> None:
    """Put the camera object ``lens`` at the apparent place of a calibration's ``camera``, after refraction by gel and
    acrylic, with its angle of view."""
    per_metre, high = gel.tactile.per_metre, camera.apparent_height
    lens.location = axes.to_gel([[0, 0, high]], camera, per_metre)[0]
    # It looks up into the gel, its own -Z along the scene's Z; the fingertip, -X, is up in the picture.
    lens.rotation_mode, lens.rotation_euler = "XYZ", (math.pi, 0.0, -math.pi / 2 * camera.down_x)
    lens.scale = (1, 1, 1)
    size = camera.height * camera.pixel_size[1]
    data = lens.data
    data.sensor_fit, data.lens_unit, data.angle = "VERTICAL", "FOV", 2 * math.atan(size / 2 / high)
    data.clip_start, data.display_size = (high - _INSIDE) * per_metre, 2e-3 * per_metre


def _child(gel: bpy.types.Object, name: str, data: bpy.types.ID, role: str) -> bpy.types.Object:
    thing = bpy.data.objects.new(name, data)
    properties.set_up_part(thing, gel, role)
    return thing


def _add_led(gel: bpy.types.Object, led: Led) -> bpy.types.Object:
    name = f"LED {led.colour}"
    thing = _child(gel, name, bpy.data.lights.new(name, "POINT"), "LED")
    thing.tactile.colour = led.colour
    return thing


def _place_led(thing: bpy.types.Object, gel: bpy.types.Object, led: Led, unit: Calibration) -> None:
    per_metre = gel.tactile.per_metre
    thing.matrix_parent_inverse.identity()
    thing.location = axes.to_gel([led.position], unit.camera, per_metre)[0]
    thing.data.type = "POINT"
    lamp = thing.data
    lamp.color = _COLOURS[led.colour]
    lamp.shadow_soft_size, lamp.use_soft_falloff = led.radius * per_metre, False
    lamp.energy = _power(led, gel)
    for name, value in (("exposure", 0.0), ("use_temperature", False), ("normalize", True)):  # since Blender 4.5
        if hasattr(lamp, name):
            setattr(lamp, name, value)


HANDLERS = ((bpy.app.handlers.blend_import_post, _keep_links_out_of_scenes),) if bpy.app.version >= (4, 3, 0) else ()
