"""What hard contacts look like, and cameras, lights and gels at the end of their range.

Heights are held against the gel's own nodes, the fast picture against Mitsuba's standard preset, which shares no code
with it from the visibility of lights on; both against formulas where there are some.
"""

from __future__ import annotations

import dataclasses
import functools
import logging

import numpy as np
from gel_pictures import levels, with_leds
from plain_unit import plain_unit
from scipy.ndimage import distance_transform_edt

from hard_cases.case import FAST_PICTURE, HEIGHT_MAP, MITSUBA, PRESETS, Found, case, refusal
from hard_cases.contacts import press
from hard_cases.test_shapes import CONTACTS, HARD_OF, SHOWN
from tactile_core import sensors
from tactile_core.geometry.cubic_spline import EvenSpline
from tactile_core.pictures.height_map import HeightMapper, gel_mapper, rest_height_map
from tactile_core.pictures.perspective import bilinear
from tactile_core.pictures.renderer import Renderer
from tactile_core.sensors.camera import HEIGHT_ZERO_Y, Led

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
    return _compared(HALF, heights, rest_height_map(HALF.camera), 1.5)


def _compared(unit, heights: np.ndarray, rest: np.ndarray, most: float) -> Found:
    changes = []
    for preset in ("fast", "standard"):
        drawn = Renderer(unit, preset, rest=rest)
        changes.append(levels(unit, drawn.radiance(heights) - drawn.rest_radiance))
    off, size = (float(np.sqrt((change**2).mean())) for change in (changes[0] - changes[1], changes[1]))
    broken = () if np.isfinite(changes).all() else ("radiance that is not finite",)
    return Found(off, "levels", most, words=f"of a change of {size:.1f} levels rms", broken=broken)


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


@case("nothing_touches_heights", "zero contact", HEIGHT_MAP, "exactly the resting gel")
def test_still_heights() -> Found:
    """No displacement."""
    still = gel_mapper()(np.zeros((len(sensors.digit_surface().rest), 3)))
    return Found(float(np.abs(still - rest_height_map()).max()) * 1e6, "um", 0.0)


@case("nothing_touches_{}", "zero contact", PRESETS,
      "bit-equal to the background", *BOTH)  # fmt: skip
def test_still(preset: str) -> Found:
    background = np.random.default_rng(0).integers(0, 256, (*HALF.camera.shape, 3), dtype=np.uint8)
    drawn = Renderer(HALF, preset, background=background)(rest_height_map(HALF.camera))
    return Found(float(np.abs(drawn.astype(int) - background).max()), "levels", 0.0)


@case("depth_0.1um_{}_picture", "tiny depth (0.1 um)", PRESETS,
      "less than half a level anywhere", *BOTH)  # fmt: skip
def test_faint(preset: str) -> Found:
    """A press of 0.1 um: it must not show, and its noise neither."""
    rest = rest_height_map(HALF.camera)
    right, down = np.meshgrid(HALF.camera.right, HALF.camera.down)
    dent = 0.1e-6 * np.exp(-(right**2 + down**2) / (2 * (0.5e-3) ** 2))
    drawn = Renderer(HALF, preset)
    change = levels(HALF, drawn.radiance(rest + dent) - drawn.rest_radiance)
    return Found(float(np.abs(change).max()), "levels", 0.5)


@case("2_px_per_mm", "extreme px/mm", HEIGHT_MAP, "a picture wider than the gel's window is refused, in words")
def test_wide() -> Found:
    """120 mm of gel across."""
    camera = dataclasses.replace(UNIT.camera, px_per_mm_x=2.0, px_per_mm_y=2.0)
    return refusal(lambda: HeightMapper(sensors.digit_surface(), camera), "Raise px_per_mm_y to 18.4")


@case("500_px_per_mm", "extreme px/mm", HEIGHT_MAP, "heights are the gel's cubic surface to 0.05 um, at 2 um a pixel")
def test_narrow() -> Found:
    """A picture of 0.24 mm in the middle of a dent, against the splines themselves."""
    camera = dataclasses.replace(UNIT.camera, px_per_mm_x=500.0, px_per_mm_y=500.0, width=120, height=160)
    mapper, gel = HeightMapper(sensors.digit_surface(), camera), sensors.digit_surface()
    displacement = np.zeros_like(gel.rest)
    bell = np.exp(-(((gel.rest[:, 0] + 7.4e-3) / 1e-3) ** 2 + (gel.rest[:, 2] / 1e-3) ** 2) / 2)
    displacement[:, 1] = 0.5e-3 * bell
    window = gel.grid(gel.rest + displacement)[gel.window]
    along, across = (
        EvenSpline(nodes[0], (nodes[-1] - nodes[0]) / (len(nodes) - 1), len(nodes))
        for nodes in (window[:, 0, 0], window[0, :, 2])
    )
    truth = along.matrix(camera.gel_x) @ (window[..., 1] - HEIGHT_ZERO_Y) @ across.matrix(camera.gel_z).T
    return Found(float(np.abs(mapper(displacement) - truth).max()) * 1e6, "um", 0.05)


@case("{:g}_px_per_mm_pictures", "extreme px/mm", MITSUBA, "fast and Mitsuba's agree to 1.5 levels", (18.8,), (400.0,))
def test_scaled(px_per_mm: float) -> Found:
    """The same bump, seen by a camera so near that it fills the picture, with lights as near."""
    factor = 18.8 / px_per_mm
    camera = dataclasses.replace(HALF.camera, px_per_mm_x=px_per_mm / 2, px_per_mm_y=px_per_mm / 2)
    unit = dataclasses.replace(HALF, camera=camera)
    right, down = np.meshgrid(camera.right, camera.down)
    bump = (0.2e-3 * factor * np.exp(-(right**2 + down**2) / (2 * (0.8e-3 * factor) ** 2))).astype(np.float32)
    return _compared(unit, bump, np.zeros_like(bump), 1.5)


@case("grazing_plane_{}", "grazing light", PRESETS,
      "Lambert's law on a plane to 0.2 % (a pixel's middle is 3 um off in Mitsuba)", *BOTH)  # fmt: skip
def test_lambert(preset: str) -> Found:
    """A small light 0.1 mm over the plane, 13 mm away: it comes in at half a degree."""
    led = Led("green", (-13e-3, -3e-3, 0.1e-3), 1e-5, 1.0)
    unit = dataclasses.replace(HALF, leds=(HALF.leds[0], led, HALF.leds[2])).with_gain(HALF.gain)
    flat = np.zeros(unit.camera.shape, np.float32)
    right, down = np.meshgrid(unit.camera.right, unit.camera.down)
    x, y, z = led.position
    truth = (x**2 + y**2 + z**2) * z / ((right - x) ** 2 + (down - y) ** 2 + z**2) ** 1.5
    found = Renderer(unit, preset, rest=flat).radiance(flat)[..., 1]
    return Found(100 * float(np.abs(found / truth / unit.facing[1] - 1).max()), "percent", 0.2)


@case("grazing_bump", "grazing light", MITSUBA, "fast and Mitsuba's agree to 1.5 levels where lights are 1 mm high")
def test_grazing_bump() -> Found:
    """A bump of 0.3 mm on a plane, lights at 4 degrees: its shadows are 4 mm long."""
    leds = tuple(dataclasses.replace(led, position=(*led.position[:2], 1e-3), radius=0.2e-3) for led in HALF.leds)
    unit = dataclasses.replace(HALF, leds=leds).with_gain(HALF.gain)
    right, down = np.meshgrid(unit.camera.right, unit.camera.down)
    bump = (0.3e-3 * np.exp(-(right**2 + down**2) / (2 * (0.8e-3) ** 2))).astype(np.float32)
    return _compared(unit, bump, np.zeros_like(bump), 1.5)


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


@case("cliff_{}", "depth discontinuities", PRESETS,
      "the shadow of a step is as long as it should be, to 1.5 pixels", *BOTH)  # fmt: skip
def test_cliff(preset: str) -> Found:
    """A step of 0.6 mm within one pixel, a far light at 30 degrees: the shadow is 0.6 mm / tan 30 degrees long."""
    height, angle = 0.6e-3, np.radians(30)
    camera = dataclasses.replace(HALF.camera, apparent_height=10.0)  # without perspective
    light = Led("red", (-0.4 * np.cos(angle), 0.0, 0.4 * np.sin(angle)), 1e-4, 1.0)
    unit = dataclasses.replace(HALF, camera=camera, leds=(light, *HALF.leds[1:])).with_gain(HALF.gain)
    right = np.meshgrid(camera.right, camera.down)[0]
    step = np.where(right < 0, height, 0.0).astype(np.float32)
    flat = np.zeros_like(step)
    light_on = Renderer(unit, preset, rest=flat).radiance(step)[..., 0]
    lit = np.median(light_on[:, right[0] > 3e-3])
    dark = (light_on < 0.5 * lit) & (right > 0)
    length = float(dark.sum(axis=1).mean()) * camera.pixel_size[0]
    broken = () if np.isfinite(light_on).all() and light_on.min() >= 0 else ("radiance is negative or not finite",)
    words = f"{length * 1e3:.3f} mm, by the formula {height / np.tan(angle) * 1e3:.3f} mm"
    return Found((length - height / np.tan(angle)) / camera.pixel_size[0], "pixels", 1.5, words=words, broken=broken)


@case("cliffs_heights", "depth discontinuities", HEIGHT_MAP,
      "one node pushed in by 0.5 mm: finite, overshot by a fifth at most, as cubic splines do")  # fmt: skip
def test_spike() -> Found:
    """A needle of one node."""
    gel = sensors.digit_surface()
    displacement = np.zeros_like(gel.rest)
    node = int(np.argmin(((gel.rest[:, [0, 2]] - [-7.5e-3, 0.0]) ** 2).sum(axis=1)))
    displacement[node, 1] = 0.5e-3
    rise = gel_mapper()(displacement) - rest_height_map()
    broken = () if np.isfinite(rise).all() and rise.max() < 0.55e-3 else (f"rises to {rise.max() * 1e3:.2f} mm",)
    return Found(100 * float(-rise.min() / 0.5e-3), "percent", 20.0, broken=broken)


@case("inverted_gel_heights", "inverted start", HEIGHT_MAP,
      "a gel folded over itself gives finite heights, and says so")  # fmt: skip
def test_folded() -> Found:
    """Sideways displacements of five times a press, toward its middle."""
    gel, heard = sensors.digit_surface(), []
    watch = logging.Handler()
    watch.emit = heard.append
    log = logging.getLogger("tactile_core.pictures.height_map")
    log.addHandler(watch)
    off = gel.rest[:, [0, 2]] - [-7e-3, 0.0]
    bell = np.exp(-(off**2).sum(axis=1) / (2 * (1.4e-3) ** 2))
    try:
        heights = gel_mapper()(np.column_stack([-3 * off[:, 0] * bell, 0.1e-3 * bell, -3 * off[:, 1] * bell]))
    finally:
        log.removeHandler(watch)
    words = heard[0].getMessage() if heard else "nothing was said"
    broken = () if np.isfinite(heights).all() else ("heights that are not finite",)
    return Found(float(bool(heard)), "said", 1.0, at_least=True, words=words, broken=broken)


@case("levels_in_single_precision", "single precision against double", FAST_PICTURE,
      "heights a float32 rounding apart differ by less than 0.05 levels")  # fmt: skip
def test_single_levels() -> Found:
    """A press, and the same press with its last bit changed."""
    rest = rest_height_map(HALF.camera)
    right, down = np.meshgrid(HALF.camera.right, HALF.camera.down)
    height = (rest + 0.6e-3 * np.exp(-(right**2 + down**2) / (2 * (0.8e-3) ** 2))).astype(np.float32)
    drawn = Renderer(HALF, "fast", background=np.full((*HALF.camera.shape, 3), 128))
    one, other = drawn.radiance(height), drawn.radiance(np.nextafter(height, np.float32(1)))
    return Found(float(np.abs(one - other).max()), "levels", 0.05)
