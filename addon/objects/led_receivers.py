"""Restrict a DIGIT's LEDs to its own gel and body, by Blender's light linking.

The gel throws no shadow (``digit_body``), so that without it their light would fall on what stands around.
"""

from __future__ import annotations

import bpy

NAME = "DIGIT lit by its LEDs"


def link(gel: bpy.types.Object, leds: dict[str, bpy.types.Object]) -> None:
    """Let LEDs light the gel, its acrylic and its housing; those that are linked by hand stay so."""
    new = [led for led in leds.values() if led.light_linking.receiver_collection is None]
    if not new:
        return
    known = (led.light_linking.receiver_collection for led in leds.values())
    lit = next(filter(None, known), None) or bpy.data.collections.new(NAME)
    for thing in (gel, *gel.children_recursive):
        if thing.tactile.role in ("DIGIT", "BODY") and thing.name not in lit.objects:
            lit.objects.link(thing)
    for led in new:
        led.light_linking.receiver_collection = lit
