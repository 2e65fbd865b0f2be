"""What hard contacts look like.

Heights are held against the gel's own nodes, the fast picture against Mitsuba's standard preset, which shares no code
with it from the visibility of lights on.
"""

import dataclasses
import functools

import numpy as np
from gel_pictures import levels, with_leds
from plain_unit import plain_unit
from scipy.ndimage import distance_transform_edt

from hard_cases.case import FAST_PICTURE, HEIGHT_MAP, MITSUBA, PRESETS, Found, case, refusal
from hard_cases.contacts import press
from hard_cases.test_shapes import CONTACTS, HARD_OF, SHOWN
from tactile_core import sensors
from tactile_core.pictures.height_map import HeightMapper, gel_mapper, rest_height_map
from tactile_core.pictures.perspective import bilinear
from tactile_core.pictures.renderer import Renderer
from tactile_core.sensors.camera import HEIGHT_ZERO_Y

UNIT = plain_unit()
HALF = plain_unit().at_size(120, 160)  # a quarter of the pixels: the time of Mitsuba's scalar variant
GREY = np.full((*UNIT.camera.shape, 3), 128)
BOTH = [(preset,) for preset in PRESETS]
FAR = 3e-3  # m from a dent of 20 um, where its picture must be that of the resting gel to half a level


@functools.cache
def moved(name: str) -> np.ndarray:
    """Displacement (M, 3) m of the gel in a hard contact, fast tier."""
    _, indenter, place, depth, friction = CONTACTS[name]
    return press("digit", indenter, place, friction).at_depth(depth).corrected.displacement


@case("{}_heights", HARD_OF, HEIGHT_MAP,
      "99 of 100 nodes are where the map says, to 5 um (a pixel is 53 um wide)", *((name,) for name in SHOWN)
      )  # fmt: skip
def test_heights(name: str) -> Found:
    """At each displaced node, looked up among the pixels, against the node's own height."""
    mapper, displacement = gel_mapper(), moved(name)
    at = sensors.digit_surface().rest + displacement
    row, column = mapper.camera.to_pixel(at[:, 0], at[:, 2])
    height, width = mapper.camera.shape
    seen = (row > 1) & (row < height - 2) & (column > 1) & (column < width - 2)
    heights = mapper(displacement)
    found = bilinear(heights, row[seen].astype(np.float32)[None], column[seen].astype(np.float32)[None])[0]
    off = np.abs(found - (at[seen, 1] - HEIGHT_ZERO_Y))
    broken = () if np.isfinite(heights).all() else ("heights that are not finite",)
    words = f"{seen.sum()} nodes, rms {np.sqrt((off**2).mean()) * 1e6:.2f} um, largest {off.max() * 1e6:.0f} um"
    return Found(float(np.quantile(off, 0.99)) * 1e6, "um", 5.0, words=words, broken=broken)


@case("{}_pictures", HARD_OF, MITSUBA,
      "fast and Mitsuba's picture differ by 1.5 levels rms at most (docs/optics.md: 1.2 and 1.4 off the reference)",
      *((name,) for name in SHOWN), slow=["rim", "deep", "two_patches"])  # fmt: skip
def test_pictures(name: str) -> Found:
    """The change that the contact makes, fast against Mitsuba."""
    heights = HeightMapper(sensors.digit_surface(), HALF.camera)(moved(name))
    changes = []
    for preset in ("fast", "standard"):
        drawn = Renderer(HALF, preset, rest=rest_height_map(HALF.camera))
        changes.append(levels(HALF, drawn.radiance(heights) - drawn.rest_radiance))
    off, size = (float(np.sqrt((change**2).mean())) for change in (changes[0] - changes[1], changes[1]))
    broken = () if np.isfinite(changes).all() else ("radiance that is not finite",)
    return Found(off, "levels", 1.5, words=f"of a change of {size:.1f} levels rms", broken=broken)


@case("{}_far_off", HARD_OF, FAST_PICTURE, "3 mm away nothing changes by more than half a level",
      ("edge",), ("two_patches",), ("sharp_corner",))  # fmt: skip
def test_far_off(name: str) -> Found:
    """How much the picture changes away from the contact."""
    heights = gel_mapper()(moved(name))
    unit = plain_unit(camera=gel_mapper().camera)
    drawn = Renderer(unit, "fast", background=GREY)
    change = np.abs(drawn(heights).astype(int) - drawn(rest_height_map(unit.camera)))
    dent = heights - rest_height_map(unit.camera) > 20e-6
    far = distance_transform_edt(~dent) > FAR / unit.camera.pixel_size[0]
    near = change[~far].mean()
    return Found(float(change[far].mean()) if far.any() else 0.0, "levels", 0.5, words=f"near it {near:.1f} levels")


@case("gel_over_the_lights_{}", "grazing light", PRESETS,
      "a gel higher than its lights is refused, in words", *BOTH)  # fmt: skip
def test_below(preset: str) -> Found:
    """Lights 1 mm high beside a dome of 1.6 mm."""
    low = with_leds(HALF, radius=0.1e-3)
    low = dataclasses.replace(
        low, leds=tuple(dataclasses.replace(led, position=(*led.position[:2], 1e-3)) for led in low.leds)
    )
    rest = rest_height_map(HALF.camera)
    return refusal(lambda: Renderer(low, preset)(rest), "below LEDs")
