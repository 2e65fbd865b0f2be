"""Read from a scene the unit that it shows: a calibration with LEDs, coating and camera as their objects are now."""

from __future__ import annotations

import dataclasses
import math

import bpy
import numpy as np
from mathutils import Matrix

from ...tactile_core.errors import TactileError
from ...tactile_core.pictures.mitsuba.gel_scene import Lamp, Occluder, Surroundings
from ...tactile_core.sensors.calibration import DIFFUSE, ROUGH_PLASTIC, Calibration, Coating
from ...tactile_core.sensors.camera import Camera
from ..settings import properties
from . import axes, digit_body, digit_materials, motion, surfaces

_ROUNDING = 1e-5  # relative: float32's, of objects that nobody has moved
LINEAR = "OPEN_EXR", "HDR", "DPX", "CINEON"  # how the names of file formats of linear light begin
_VIEWS = "Raw", "Standard"  # by which a rendered file has the picture's own levels
_DRAWN = "GPENCIL", "GREASEPENCIL"  # types of objects that Blender itself draws over each engine's picture
_STEP = 1e-7  # m, largest movement taken for rounding
_STRAIGHT = 1e-3  # largest component of a turn of the camera's axes taken for none
_OFF_BAND = 1e-6  # brightness, levels m^2, taken for none: a hundred-thousandth of an LED's


@dataclasses.dataclass(frozen=True)
class ShownUnit:
    """Unit and surroundings that a scene shows.
    unit : calibration with LEDs, coating and camera as the scene has them; around : other lamps and bodies"""

    unit: Calibration
    around: Surroundings


def shown_unit(gel: bpy.types.Object, depsgraph: bpy.types.Depsgraph, unit: Calibration) -> ShownUnit:
    """Return the unit as the scene shows it: missing LEDs are dark, other missing parts are ``unit``'s. Raises
    TactileError for an LED above the gel, and for a camera that is shifted or turned other than by 180 degrees."""
    reflectance = gel.evaluated_get(depsgraph).tactile.object_reflectance or unit.object_reflectance
    unit = dataclasses.replace(unit, object_reflectance=reflectance)
    if not digit_body.has_body(gel):
        return ShownUnit(unit, Surroundings())
    camera = _camera(gel, depsgraph, unit.camera)
    rendered = properties.rendered(depsgraph.view_layer, depsgraph)
    leds, others = _leds(gel, depsgraph, unit, camera, rendered)
    coating = _coating(gel, depsgraph, unit.coating)
    lamps = (*others, *_lamps(gel, depsgraph, camera, rendered))
    around = Surroundings(lamps, tuple(_occluders(gel, depsgraph, camera, unit, rendered)))
    changed = (leds, coating, camera) != (unit.leds, unit.coating, unit.camera) or around
    # A photograph shows the unit's own parts: with others the picture at rest is the model's.
    photograph = "" if changed else unit.photograph
    shown = dataclasses.replace(unit, leds=leds, coating=coating, camera=camera, photograph=photograph)
    return ShownUnit(shown, around)


def _places(gel: bpy.types.Object, depsgraph: bpy.types.Depsgraph, points: np.ndarray, camera: Camera) -> np.ndarray:
    """Convert points (n, 3) in world axes and Blender units to the picture's frame (right, down, toward camera), m."""
    inverse = np.array(axes.from_world(gel.evaluated_get(depsgraph)))
    own = np.asarray(points, float) @ inverse[:3, :3].T + inverse[:3, 3]
    return axes.from_gel(own, camera, gel.tactile.per_metre)


def _leds(gel, depsgraph, unit: Calibration, camera: Camera, rendered: set[bpy.types.Object]):  # noqa: ANN001, ANN202
    """Return the unit's LEDs as the scene has them, and lamps for their light of other colours than their own."""
    found, others = [], []
    things = digit_body.leds_of(gel)
    for k, led in enumerate(unit.leds):
        thing = things.get(led.colour)
        if thing not in rendered or thing.data.type != "POINT":  # deleted, switched off, or a sun
            found.append(dataclasses.replace(led, radiance=0.0))
            continue
        lamp = _lamp(thing, gel, depsgraph, camera)
        if not lamp.position[2] > lamp.radius:
            raise TactileError(
                thing.name, f"{1e3 * (lamp.position[2] - lamp.radius):.1f} mm above the gel's lowest point",
                "an LED inside the sensor, below the gel's surface", "Move it back, or Reset to Calibration",
            )  # fmt: skip
        new = dataclasses.replace(
            led, position=lamp.position, radius=max(lamp.radius, 1e-6),
            radiance=lamp.brightness[k] / max(lamp.radius, 1e-6) ** 2,
        )  # fmt: skip
        found.append(led if _same(new, led) else new)
        rest = tuple(0.0 if j == k else value for j, value in enumerate(lamp.brightness))
        if max(rest) > _OFF_BAND:
            others.append(dataclasses.replace(lamp, brightness=rest))
    return tuple(found), others


def _same(new, old) -> bool:  # noqa: ANN001
    numbers = [np.hstack([value for value in dataclasses.astuple(each) if not isinstance(value, str)])
               for each in (new, old)]  # fmt: skip
    return bool(np.allclose(*numbers, rtol=_ROUNDING, atol=_STEP))


def _lamp(thing: bpy.types.Object, gel: bpy.types.Object, depsgraph: bpy.types.Depsgraph, camera: Camera) -> Lamp:
    now = thing.evaluated_get(depsgraph)
    place = _places(gel, depsgraph, [_world(thing, depsgraph).translation[:]], camera)[0]
    per_metre = gel.tactile.per_metre
    lamp = now.data
    energy = max(lamp.energy, 0.0) * 2 ** getattr(lamp, "exposure", 0.0)  # it and temperature: since Blender 4.5
    brightness = energy / digit_body.watts_per_brightness(per_metre)
    colour = np.array(lamp.color[:3])
    if getattr(lamp, "use_temperature", False):
        colour *= lamp.temperature_color[:3]
    return Lamp(tuple(place.tolist()), lamp.shadow_soft_size / per_metre, tuple((brightness * colour).tolist()))


def _world(thing: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Matrix:
    """Return an object's matrix to world axes. Blender does not move one that is disabled in views, by itself or by its
    collection, with its parent."""
    now, parent = thing.evaluated_get(depsgraph), thing.parent
    if parent is None or thing.parent_type != "OBJECT" or depsgraph.mode == "RENDER" or _shown(thing, depsgraph):
        return now.matrix_world
    return _world(parent, depsgraph) @ now.matrix_parent_inverse @ now.matrix_basis


def _shown(thing: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> bool:
    layer = depsgraph.view_layer
    return thing.visible_get(view_layer=layer) or thing.hide_get(view_layer=layer)  # the eye hides what still moves


def _lamps(gel, depsgraph, camera: Camera, rendered: set[bpy.types.Object]) -> list[Lamp]:  # noqa: ANN001
    """List the scene's point lamps that are no LEDs."""
    things = [t for t in depsgraph.scene.objects if t.type == "LIGHT" and t.tactile.role != "LED" and t in rendered]
    lamps = [_lamp(t, gel, depsgraph, camera) for t in things if t.data.type == "POINT"]
    return [lamp for lamp in lamps if any(lamp.brightness)]


def output_of(scene: bpy.types.Scene) -> bpy.types.Scene | bpy.types.ImageFormatSettings:
    """Return what holds the colour management of rendered files: the scene, or the output if it has its own."""
    image = scene.render.image_settings
    return image if image.color_management == "OVERRIDE" else scene


def left_out(scene: bpy.types.Scene, gel: bpy.types.Object, preset: str = "") -> list[str]:
    """List in words what pictures of a gel leave out of the scene, and which settings change their levels in files.
    preset : by which they are drawn; "" lists what all presets leave out"""
    rendered = {thing for layer in scene.view_layers for thing in properties.rendered(layer)}
    lamps = [t for t in scene.objects if t.type == "LIGHT" and t.tactile.role in ("NONE", "LED") and t in rendered]
    found = [f"{lamp.name}: no point lamp, left out" for lamp in lamps if lamp.data.type != "POINT"]
    shining = [t for t in lamps if t.data.type == "POINT" and (preset != "fast" or t.tactile.role == "LED")]
    found += [
        f"{lamp.name}: drawn as if Normalize were on" for lamp in shining if not getattr(lamp.data, "normalize", True)
    ]  # since Blender 4.5
    found += [f"{lamp.name}: its light linking is left out" for lamp in shining
              if lamp.tactile.role == "NONE" and lamp.light_linking.receiver_collection is not None]  # fmt: skip
    if preset == "fast":
        found += [f"{lamp.name}: left out by the preset fast" for lamp in lamps
                  if lamp.data.type == "POINT" and lamp.tactile.role == "NONE"]  # fmt: skip
    if digit_body.has_body(gel) and rendered.isdisjoint(digit_body.leds_of(gel).values()):
        found.append(f"{gel.name}: its LEDs are hidden or deleted, so that only other lamps light it")
    played = motion.played(gel)
    if played and not played[0] <= scene.frame_current_final <= played[1]:
        words = f"stands still, it moves from {played[0]:g} to {played[1]:g}"
        found.append(f"Frame {scene.frame_current}: {gel.name} {words}")
    camera = scene.camera
    if camera is not None and camera.type == "CAMERA" and camera.data.dof.use_dof:
        found.append(f"{camera.name}: depth of field is left out")
    found += ["Motion blur is left out: a picture is of one instant"] * scene.render.use_motion_blur
    drawn = [thing.name for thing in scene.objects if thing.type in _DRAWN and thing in rendered]
    strips = getattr(scene.sequence_editor, "strips_all" if bpy.app.version >= (4, 4, 0) else "sequences_all", ())
    seen = any(strip.type != "SOUND" and not strip.mute for strip in strips)
    drawn += ["sequencer"] * (scene.render.use_sequencer and seen)
    found += [f"Blender draws over the picture: {', '.join(drawn)}; hide it, or switch it off"] * bool(drawn)
    words = "The compositor's nodes change the picture: join Render Layers' Image to their output"
    found += [words] * _composited(scene)
    space = bpy.data.colorspace.working_space if bpy.app.version >= (5, 0, 0) else "Linear Rec.709"
    words = f"Working space {space} changes colours of LEDs and files; set Linear Rec.709"
    found += [words] * (space != "Linear Rec.709")
    output = output_of(scene)
    view, device = output.view_settings, output.display_settings.display_device
    if scene.render.image_settings.file_format.startswith(LINEAR):
        words = "EXR, HDR, DPX and Cineon hold linear light: the view transform Standard shows it as the picture is"
        return found + [words] * (view.view_transform == "Raw")
    changes = {
        f"View transform {view.view_transform}": view.view_transform not in _VIEWS,
        f"Look {view.look}": view.look != "None",
        "Exposure": view.exposure != 0, "Gamma": view.gamma != 1, "Curves": view.use_curve_mapping,
        "White balance": getattr(view, "use_white_balance", False),  # since Blender 4.3
        "Color BW": scene.render.image_settings.color_mode == "BW",
        "Dither": scene.render.dither_intensity > 0, "Burn Into Image": scene.render.use_stamp,
        f"Display {device}": device != "sRGB" and view.view_transform != "Raw",
    }  # fmt: skip
    names = [name for name, there in changes.items() if there]
    verb = "changes" if len(names) == 1 else "change"
    return found + [f"{', '.join(names)} {verb} the levels; Set Up Render sets Raw alone"] * bool(names)


def _composited(scene: bpy.types.Scene) -> bool:
    """Return true if a compositor's nodes stand between what is rendered and what is written."""
    since = bpy.app.version >= (5, 0, 0)
    tree = scene.compositing_node_group if since else scene.node_tree if scene.use_nodes else None
    if tree is None or not scene.render.use_compositing:
        return False
    ends = [node.inputs[0] for node in tree.nodes if node.type in ("COMPOSITE", "GROUP_OUTPUT") and node.inputs]
    for end in ends:
        for link in end.links:
            if link.from_node.type == "REROUTE" and link.from_node.inputs[0] not in ends:  # they may form a circle
                ends.append(link.from_node.inputs[0])
            if link.from_node.type == "R_LAYERS" and link.from_socket.name == "Image":
                return link.from_node.scene not in (None, scene)  # a group may be another scene's
    return True


def _occluders(gel, depsgraph, camera: Camera, unit: Calibration, rendered):  # noqa: ANN001, ANN202
    """Yield the user's own meshes that reach into the housing, on the camera's side of the gel."""
    reach = max(float(np.abs(np.array(led.position[:2])).max()) + led.radius for led in unit.leds)
    for thing in depsgraph.scene.objects:
        if thing.type != "MESH" or thing.tactile.role != "NONE" or thing not in rendered:
            continue
        now = thing.evaluated_get(depsgraph)
        nodes, faces = surfaces.triangles_of(now.data)
        if not len(faces):
            continue
        world = np.array(now.matrix_world)
        places = _places(gel, depsgraph, nodes @ world[:3, :3].T + world[:3, 3], camera)
        inside = (np.abs(places[:, :2]) < reach).all(1) & (places[:, 2] > 0)
        if inside.any() and not (places[:, 2] > camera.apparent_height).all():
            yield Occluder(places, faces)


def _coating(gel: bpy.types.Object, depsgraph: bpy.types.Depsgraph, coating: Coating) -> Coating:
    """Return the calibration's coating with the numbers that the gel's material has; itself if they are the same."""
    material = digit_body.coating_of(gel)
    if material is None:
        return coating
    sockets = digit_materials.sockets_of(material.evaluated_get(depsgraph))
    albedo, roughness, gloss = coating.albedo, coating.roughness, coating.gloss
    if digit_materials.ALBEDO in sockets:
        albedo = tuple(float(min(max(value, 0.0), 1.0)) for value in sockets[digit_materials.ALBEDO].default_value[:3])
    if digit_materials.ROUGHNESS in sockets:
        roughness = float(min(max(sockets[digit_materials.ROUGHNESS].default_value, 0.02), 1.0))
    matte = coating.bsdf == DIFFUSE
    shown_gloss = 0.0 if matte else gloss
    if digit_materials.GLOSS in sockets:
        shown_gloss = float(min(max(sockets[digit_materials.GLOSS].default_value, 0.0), 1.0))
    kind = ROUGH_PLASTIC if matte and shown_gloss > 0 else coating.bsdf
    gloss = gloss if matte and not shown_gloss else shown_gloss
    new = dataclasses.replace(coating, bsdf=kind, albedo=albedo, roughness=roughness, gloss=gloss)
    return coating if kind == coating.bsdf and _same(new, coating) else new


def _camera(gel: bpy.types.Object, depsgraph: bpy.types.Depsgraph, camera: Camera) -> Camera:
    """Return the calibration's camera, moved and zoomed as its object in the scene is; its pixels' aspect stays."""
    thing = digit_body.camera_of(gel)
    if thing is None:
        return camera
    now = thing.evaluated_get(depsgraph)
    lens = now.data
    if lens.type != "PERSP" or lens.sensor_fit != "VERTICAL" or lens.shift_x or lens.shift_y:
        found = f"type {lens.type}, sensor fit {lens.sensor_fit}, shift {lens.shift_x:g} and {lens.shift_y:g}"
        expected = "a perspective camera, its sensor fit vertical, without shift"
        raise TactileError(thing.name, found, expected, "Set them so, or Reset to Calibration")
    relative = axes.from_world(gel.evaluated_get(depsgraph)) @ _world(thing, depsgraph)
    own = np.array(relative.to_3x3().normalized())
    forward, right = -own[:, 2], own[:, 0]
    if forward[2] < 1 - _STRAIGHT or abs(abs(right[1]) - 1) > _STRAIGHT:
        found = f"{math.degrees(math.acos(max(-1.0, min(1.0, forward[2])))):.1f} degrees off the gel's normal"
        advice = "Clear its rotation, or Reset to Calibration"
        raise TactileError(thing.name, found, "a camera that looks straight at the gel, turned by 0 or 180", advice)
    sign = 1 if right[1] * camera.right_z > 0 else -1
    right_z, down_x = camera.right_z * sign, camera.down_x * sign
    place = axes.from_gel(np.array(relative.translation), camera, gel.tactile.per_metre)
    scale = camera.height * camera.pixel_size[1] / (2 * math.tan(lens.angle_y / 2) * place[2])
    new = dataclasses.replace(
        camera, apparent_height=float(place[2]), right_z=right_z, down_x=down_x,
        centre_x=camera.centre_x + camera.down_x * float(place[1]),
        centre_z=camera.centre_z + camera.right_z * float(place[0]),
        px_per_mm_x=camera.px_per_mm_x * scale, px_per_mm_y=camera.px_per_mm_y * scale,
    )  # fmt: skip
    return camera if (right_z, down_x) == (camera.right_z, camera.down_x) and _same(new, camera) else new
