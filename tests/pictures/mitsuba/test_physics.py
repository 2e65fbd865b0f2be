"""The pictures against Mitsuba's own path tracer, analytic light, and the order of their convergence."""

import dataclasses
import math
import zlib

import numpy as np
from gel_pictures import Press, levels, with_leds, works
from plain_unit import LEVELS, plain_unit

from tactile_core.accuracy import order
from tactile_core.pictures.height_map import rest_height_map
from tactile_core.pictures.mitsuba.gel_mesh import MM, GelMesh
from tactile_core.pictures.mitsuba.matte_light import MatteLight, irradiance
from tactile_core.pictures.mitsuba.variant import LLVM, activate
from tactile_core.pictures.perspective import slopes
from tactile_core.pictures.presets import REFERENCE, STANDARD, Gather
from tactile_core.pictures.renderer import Renderer
from tactile_core.sensors.calibration import Coating

UNBOUNCED = dataclasses.replace(STANDARD, gather=None)
DIRECT = dataclasses.replace(REFERENCE, gather=None, window=False)
SIGNIFICANCE = 0.01  # of all pixels' tests together


def path_traced(unit, height, variant, *, depth: int, spp: int, renders: int, point: bool = False):
    """Mean (H, W, 3) and its variance of independent renders by Mitsuba's path integrator, levels.

    An own scene: diffuse gel with smooth normals, LEDs as glowing spheres (or points), a stock camera. depth : 2 for
    direct light, 3 with one bounce
    """
    mi = activate(variant)
    mesh = GelMesh(unit.camera, spacing=0.0)
    gel = mi.Mesh("gel", len(mesh.vertices(height)), len(mesh.faces), has_vertex_normals=True)
    values = mi.traverse(gel)
    values["faces"], values["vertex_positions"] = mesh.faces.ravel(), mesh.vertices(height).ravel()
    values.update()
    gel.set_bsdf(mi.load_dict({"type": "diffuse", "reflectance": {"type": "rgb", "value": list(unit.coating.albedo)}}))
    scene = mi.load_dict({"type": "scene", "gel": gel, "eye": eye(unit.camera, mi), **lamps(unit, point)})
    tracer = mi.load_dict({"type": "path", "max_depth": depth, "hide_emitters": True})
    found = [np.array(mi.render(scene, integrator=tracer, spp=spp, seed=k)) for k in range(renders)]
    return np.mean(found, 0), np.var(found, 0, ddof=1) / renders


def eye(camera, mi):
    """A stock camera of the same view."""
    half = camera.width / 2 * camera.pixel_size[0]
    distance = camera.apparent_height
    return {
        "type": "perspective", "fov_axis": "x", "fov": 2 * math.degrees(math.atan(half / distance)),
        "near_clip": 1.0, "far_clip": 1e3,
        "to_world": mi.ScalarTransform4f().look_at(origin=[0, 0, distance * MM], target=[0, 0, 0], up=[0, 1, 0]),
        "film": {"type": "hdrfilm", "width": camera.width, "height": camera.height, "rfilter": {"type": "box"},
                 "pixel_format": "rgb", "component_format": "float32"},
    }  # fmt: skip


def lamps(unit, point: bool) -> dict:
    """Each LED in its own channel, in levels."""
    found = {}
    for led, level in zip(unit.leds, unit.facing, strict=True):
        place = (np.array(led.position) * [MM, -MM, MM]).tolist()
        colour = [0.0, 0.0, 0.0]
        square = float(np.square(place).sum())  # times albedo / pi is what the coating scatters back
        if point:
            colour[led.channel] = math.pi * square / unit.coating.albedo[led.channel] * level
            found[led.colour] = {"type": "point", "position": place, "intensity": {"type": "rgb", "value": colour}}
        else:
            colour[led.channel] = led.radiance
            glow = {"type": "area", "radiance": {"type": "rgb", "value": colour}}
            found[led.colour] = {"type": "sphere", "center": place, "radius": led.radius * MM, "emitter": glow}
    return found


def test_direct_light_is_that_of_mitsubas_path_tracer(any_variant, small, press):
    """Each pixel's z-test with Sidak's correction for their number; Gauss's tails need some twenty renders."""
    height = press.on(small.camera)
    mean, variance = path_traced(small, height, any_variant, depth=2, spp=16, renders=24)
    ours = MatteLight(small, DIRECT, rest_height_map(small.camera), 0).radiance(height)
    # Pixels of 0.2 mm: triangles' normals against the map's slopes, and our own rest of noise, half a per cent.
    deviation = np.sqrt(variance + (0.005 * ours) ** 2 + (1e-3 * LEVELS) ** 2)
    z = np.abs(ours - mean) / deviation
    tests = z.size
    single = 1 - (1 - SIGNIFICANCE) ** (1 / tests)
    # Student's t of 23 degrees has wider tails than Gauss's: the quantile of p is near 1.45 times as far out there.
    limit = 1.45 * math.sqrt(2) * inverse_erfc(single)
    assert z.max() < limit
    assert abs(mean.mean() / ours.mean() - 1) < 2e-3


def inverse_erfc(p: float) -> float:
    """By bisection."""
    low, high = 0.0, 10.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if math.erfc(middle) > p else (low, middle)
    return low


def test_one_bounce_is_that_of_mitsubas_path_tracer(small):
    """Point lights, so that direct light has next to no noise to subtract; means of blocks of 10 x 10 pixels.

    By LLVM alone: there both of the path tracer's renders see the same places in a pixel, whose noise then cancels.
    """
    llvm = works(LLVM)
    unit = with_leds(small, radius=1e-6)
    height = Press(depth=1.2e-3).on(unit.camera)
    light = path_traced(unit, height, llvm, depth=3, spp=96, renders=2, point=True)[0]
    light -= path_traced(unit, height, llvm, depth=2, spp=96, renders=2, point=True)[0]
    fine = dataclasses.replace(STANDARD, gather=Gather(step=1, azimuths=24, growth=0.1, bounces=1))
    found = []
    for preset in (fine, UNBOUNCED):
        found.append(MatteLight(unit, preset, rest_height_map(unit.camera), 0).radiance(height))
    ours = found[0] - found[1]
    expected, ours = (values.reshape(8, 10, 6, 10, 3).mean((1, 3)) for values in (light, ours))
    print(expected.mean((0, 1)), ours.mean((0, 1)))
    error, size = np.sqrt(np.mean((expected - ours) ** 2)), np.sqrt(np.mean(expected**2))
    assert error < 0.15 * size  # noise of the path tracer is 5 %; 0.2 mm between places on a press


def test_inside_a_glowing_sphere_light_is_even():
    """A spherical cap that glows evenly lights each of its points by its area over that of the whole sphere."""
    steps, errors = [0.1e-3, 0.05e-3, 0.025e-3], []
    for step in steps:
        found, share = lit_cap(step)
        errors.append(abs(found.mean() / share - 1))
        assert np.ptp(found) < 4 * errors[-1] * share
    assert order(steps, errors) > 0.8  # a horizon ends up to a step short of the cap's rim: first order
    assert errors[-1] < 0.03


def lit_cap(step: float) -> tuple[np.ndarray, float]:
    """Irradiance of places inside a cap of radiance 1, and what it should be."""
    radius, rim = 2e-3, 1e-3
    margin = round(2.2e-3 / step)  # across the whole cap
    count = margin + round(1.1e-3 / step)
    right, down = np.meshgrid(*2 * [np.arange(-count, count + 1) * step])
    distance = np.hypot(right, down)
    height = radius - np.sqrt(radius**2 - np.minimum(distance, rim) ** 2)
    glow = np.repeat((distance < rim)[..., None], 3, -1).astype(np.float32)
    found = irradiance(height, glow, margin, (step, step), Gather(step=1, azimuths=16, growth=0.0, bounces=1))
    near = distance[margin:-margin, margin:-margin] < 0.6 * rim
    return found[near][:, 0], (1 - math.sqrt(1 - (rim / radius) ** 2)) / 2


def test_a_flat_gel_gives_itself_no_light():
    flat = np.zeros((60, 60), np.float32)
    found = irradiance(flat, np.ones((60, 60, 3), np.float32), 10, (1e-4, 1e-4), Gather(1, 16, 0.2, 1))
    np.testing.assert_allclose(found, 0, atol=1e-6)


def test_light_is_never_made(any_variant, small, press):
    """Every bounce adds less than the one before, and black gel adds nothing."""
    height, rest = press.on(small.camera), rest_height_map(small.camera)
    totals = []
    for bounces in (1, 2, 3):
        preset = dataclasses.replace(STANDARD, gather=Gather(4, 12, 0.3, bounces))
        totals.append(MatteLight(small, preset, rest, 0).radiance(height).sum())
    black = dataclasses.replace(small, coating=Coating(albedo=(0.0, 0.0, 0.0)))
    direct = MatteLight(small, UNBOUNCED, rest, 0).radiance(height).sum()
    assert not MatteLight(black, preset, rest, 0).radiance(height).any()
    steps = np.diff([direct, *totals])
    assert (steps > 0).all()
    assert (steps[1:] < 0.3 * steps[:-1]).all()  # albedo 0.5 times the small part of the gel that sees gel


def test_noise_falls_with_the_order_of_monte_carlo_or_faster(any_variant, small, press):
    """Half an order for numbers drawn one by one; these are spread evenly, which gains up to as much again."""
    height, rest = press.on(small.camera), rest_height_map(small.camera)
    passes, seeds = [2, 4, 8, 16], range(4)
    truth = MatteLight(small, dataclasses.replace(DIRECT, passes=96), rest, 99).radiance(height)
    noise = []
    for count in passes:
        preset = dataclasses.replace(DIRECT, passes=count)
        drawn = [MatteLight(small, preset, rest, seed).radiance(height) for seed in seeds]
        noise.append(float(np.sqrt(np.mean((np.array(drawn) - truth) ** 2))))
    assert -1.2 < order(passes, noise) < -0.45


def test_the_seed_matters_to_the_reference_alone(any_variant, small, press):
    height, rest = press.on(small.camera), rest_height_map(small.camera)
    for preset, same in ((STANDARD, True), (dataclasses.replace(DIRECT, passes=2), False)):
        one, other = (MatteLight(small, preset, rest, seed).radiance(height) for seed in (1, 2))
        assert np.array_equal(one, other) == same


def test_fast_is_the_reference_within_half_a_level_on_random_contacts(any_variant):
    """Presses of balls anywhere, up to 1.2 mm deep, at half the real number of pixels each way."""
    unit = plain_unit().at_size(120, 160)
    rest = rest_height_map(unit.camera)
    few = dataclasses.replace(DIRECT, passes=2)
    reference, shader = MatteLight(unit, few, rest, 0), Renderer(unit, "fast", rest=rest)
    resting = reference.radiance(rest), shader.radiance(rest)
    random = np.random.default_rng(zlib.crc32(b"ten random contacts"))
    squares = []
    for _ in range(4):
        place = random.uniform([-4e-3, -6e-3], [4e-3, 6e-3])
        press = Press(random.uniform(0.2e-3, 1.2e-3), *place, ball=random.uniform(1.5e-3, 4e-3))
        height = press.on(unit.camera)
        truth, fast = reference.radiance(height) - resting[0], shader.radiance(height) - resting[1]
        squares.append(np.mean(levels(unit, fast - truth) ** 2))
    # 0.5 is the promise at 240 x 320 (measure_presets.py); pixels twice as wide, and few passes, add as much.
    assert np.sqrt(np.mean(squares)) < 1.0


def test_slopes_are_those_of_the_map(small, press):
    """The normals of the fast picture and of Mitsuba's are one function."""
    height = press.on(small.camera)
    right, down = slopes(height, small.camera)
    np.testing.assert_allclose(
        right[:, 1:-1], (height[:, 2:] - height[:, :-2]) / (2 * small.camera.pixel_size[0]), rtol=1e-4, atol=1e-6
    )
    np.testing.assert_allclose(
        down[1:-1], (height[2:] - height[:-2]) / (2 * small.camera.pixel_size[1]), rtol=1e-4, atol=1e-6
    )
