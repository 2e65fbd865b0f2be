"""What strains a solver: no compressibility, too large steps, too coarse meshes, bad starts, too deep, too small."""

import dataclasses
import functools

import numpy as np
from benchmarks.mechanics.axisymmetric import disc_mesh, pressed
from benchmarks.mechanics.golden import GOLDEN_BALL, GOLDEN_RADIUS, GOLDEN_THICKNESS, exact_layer
from slab import slab_compliance

from hard_cases.case import HEIGHT_MAP, MECHANICS_FAST, MECHANICS_FULL, TIERS, TRANSLATION, Found, case, refusal
from hard_cases.contacts import MIDDLE, broken_fast, broken_full, full, over_stated, press
from hard_cases.test_chain import prepared
from tactile_core import sensors
from tactile_core.geometry.indenters import Sphere, pose_on
from tactile_core.mechanics.fast.contact import ContactProblem
from tactile_core.mechanics.fast.press import FastContact
from tactile_core.mechanics.finite_strain.body import graded_body
from tactile_core.mechanics.placement import DEPTH_LIMIT, pose_at, thickness_under
from tactile_core.mechanics.solids.finite_strain import FiniteStrainSolid, NeoHookean, State
from tactile_core.mechanics.solve import Step, solve, solve_path
from tactile_core.pictures.height_map import gel_mapper
from tactile_core.sensors import Material
from tactile_core.sensors.camera import HEIGHT_ZERO_Y
from tactile_core.translation import networks

BALL = Sphere(3.5e-3)
YOUNGS = 0.4e6  # Pa, about the gel's


@case("nu_{:g}_fast", "near-incompressible gel", MECHANICS_FAST, "within 3 % of the exact force on a bonded layer",
      (0.49,), (0.499,), slow=[0.49])  # fmt: skip
def test_layer_fast(poisson: float) -> Found:
    """A ball on a bonded layer: the fast tier's own condensation and contact, against the exact small-strain answer."""
    radius, thickness, depth = 7e-3, 2e-3, 0.06e-3
    outside = np.linspace(1.4e-3, 6e-3, 6)
    line = np.concatenate([-outside[::-1], np.linspace(-1.1e-3, 1.1e-3, 23), outside])
    slab = slab_compliance(line, line, -np.linspace(0, thickness, 7), Material(YOUNGS, poisson), 1e-3)
    top = pose_on(Sphere(radius), np.array([0.0, -thickness, 0.0]), np.array([0.0, -1.0, 0.0]))
    found = ContactProblem(slab, Sphere(radius), top, depth).at_depth(depth)
    exact = exact_layer(depth, radius, thickness, YOUNGS, poisson)[2]
    broken = () if found.converged else ("did not converge",)
    words = f"{found.axial_force:.4g} N, exactly {exact:.4g} N"
    return Found(100 * (found.axial_force / exact - 1), "percent", 3.0, words=words, broken=broken)


@case("nu_{:g}_full", "near-incompressible gel", MECHANICS_FULL,
      "in 10 Newton iterations at most, as prototypes took 3 to 7", (0.49,), (0.499,))  # fmt: skip
def test_gel_full(poisson: float) -> Found:
    """The gel itself, made of another material, 0.6 mm deep in one step from rest."""
    pose = pose_at("digit", BALL, MIDDLE)
    body = graded_body("digit", BALL, pose, 0.6e-3)
    law = NeoHookean.from_material(Material(sensors.describe("digit").material.youngs, poisson), split=True)
    body = dataclasses.replace(body, solid=FiniteStrainSolid(body.solid.mesh, law, body.graded.pattern))
    problem = body.contact(BALL, pose, 0.6e-3, 0.0)
    touch = problem.move(pose.moved(0.6e-3), problem.start(), 5e-3)
    ratio = body.solid.deformation(touch.state.displacement)[1]
    volume = float((ratio * body.solid.weight).sum() / body.solid.weight.sum() - 1)
    broken = () if ratio.min() > 0.5 else (f"det F falls to {ratio.min():.3g}",)
    words = f"{np.linalg.norm(touch.force):.4g} N, volume {volume:.2%}, det F {ratio.min():.3f} at least"
    return Found(touch.iterations, "iterations", 10, words=words, broken=broken)


def _disc(poisson: float, spacing: float) -> float:
    mesh = disc_mesh(GOLDEN_RADIUS, GOLDEN_THICKNESS, 3e-3, spacing, 0.4e-3, 1.25)
    touch = pressed(mesh, Material(1e6, poisson), Sphere(GOLDEN_BALL), 3e-3).press(0.6e-3, step=0.3e-3)
    return float(np.linalg.norm(touch.force))


@case("nu_{:g}_full_force", "near-incompressible gel", MECHANICS_FULL,
      "within 1 % on nodes twice as far apart: no locking", (0.49,), (0.499,))  # fmt: skip
def test_locking(poisson: float) -> Found:
    return _against_fine(poisson, 0.2e-3, 1.0)


def _against_fine(poisson: float, spacing: float, most: float) -> Found:
    coarse, fine = _disc(poisson, spacing), _fine_disc(poisson)
    words = f"{coarse:.4g} N, on nodes 0.1 mm apart {fine:.4g} N"
    return Found(100 * (coarse / fine - 1), "percent", most, words=words)


@case("nodes_{:g}mm_apart", "coarse and fine meshes", MECHANICS_FULL,
      "within 2 % of a mesh of 0.1 mm: the contact, 2.9 mm wide, ends between nodes", (0.4,), (0.8,))  # fmt: skip
def test_coarse(millimetres: float) -> Found:
    return _against_fine(0.49, 1e-3 * millimetres, 2.0)


@functools.cache
def _fine_disc(poisson: float) -> float:
    return _disc(poisson, 0.1e-3)


@case("beyond_60_percent", "indentation beyond 60 % of the thickness", MECHANICS_FAST, "refused, in words")
def test_beyond() -> Found:
    """61 % of the thickness."""
    deep = 0.61 * thickness_under("digit", BALL, pose_at("digit", BALL, MIDDLE))
    return refusal(lambda: solve("digit", BALL, MIDDLE, depth=deep), "60% of the thickness")


@case("beyond_60_percent_by_force", "indentation beyond 60 % of the thickness", MECHANICS_FAST, "refused, in words")
def test_beyond_by_force() -> Found:
    """A force that no depth within the limit bears."""
    return refusal(lambda: solve("digit", BALL, MIDDLE, force=500.0), "found within")


@case("at_60_percent_fast", "indentation beyond 60 % of the thickness", MECHANICS_FAST, "converges right at the limit")
def test_at_limit_fast() -> Found:
    """60 % of the thickness, with the sensor's own friction."""
    deep = DEPTH_LIMIT * thickness_under("digit", BALL, pose_at("digit", BALL, MIDDLE))
    found = press("digit", BALL, MIDDLE, 0.78).at_depth(deep)
    words = f"{deep * 1e3:.2f} mm, {np.linalg.norm(found.force):.3g} N"
    return Found(found.linear.penetration * 1e6, "um", 1.0, words=words, broken=broken_fast(found, BALL, 0.78))


@case("at_60_percent_full", "indentation beyond 60 % of the thickness", MECHANICS_FULL, "converges right at the limit")
def test_at_limit_full() -> Found:
    """60 % of the thickness under a ball of 14 mm, in one step."""
    ball = Sphere(7e-3)
    pose = pose_at("digit", ball, MIDDLE)
    deep = DEPTH_LIMIT * thickness_under("digit", ball, pose)
    found = full("digit", ball, MIDDLE, deep, 0.0)
    words = f"{deep * 1e3:.2f} mm, {np.linalg.norm(found.force):.3g} N, {found.load_steps} load steps"
    return Found(found.penetration * 1e6, "um", 1.0, words=words,
                 broken=broken_full(found, "digit", ball, pose.moved(deep), 0.0))  # fmt: skip


@case("ten_steps_at_once_full", "load step ten times too large", MECHANICS_FULL,
      "the same answer to 1 um without friction: equilibrium knows no path",
      slow=["ten_steps_at_once_full"])  # fmt: skip
def test_steps_full() -> Found:
    """0.8 mm at once and in ten steps."""
    depth = 0.8e-3
    one, many = (
        list(solve_path("digit", BALL, MIDDLE, [Step(depth=depth * part) for part in way], "full", 0.0))[-1]
        for way in ([1.0], np.arange(1, 11) / 10)
    )
    off = np.linalg.norm(one.displacement - many.displacement, axis=1).max()
    broken = broken_full(one, "digit", BALL, pose_at("digit", BALL, MIDDLE).moved(depth), 0.0)
    words = f"{one.load_steps} load steps; force {np.linalg.norm(one.force) / np.linalg.norm(many.force) - 1:.2%} off"
    return Found(off * 1e6, "um", 1.0, words=words, broken=broken)


def _ten_steps(friction: float) -> tuple[FastContact, FastContact, tuple[str, ...]]:
    """0.8 mm at once and in ten steps, in the fast tier; and the laws that the first breaks."""
    at_once, walk = press("digit", BALL, MIDDLE, friction).at_depth(0.8e-3), press("digit", BALL, MIDDLE, friction)
    for depth in np.arange(1, 11) * 0.08e-3:
        slow = walk.at_depth(float(depth))
    return at_once, slow, broken_fast(at_once, BALL, friction)


@case("ten_steps_at_once_fast", "load step ten times too large", MECHANICS_FAST, "the same answer to 1 um")
def test_steps_fast() -> Found:
    """Without friction."""
    one, many, broken = _ten_steps(0.0)
    off = np.abs(one.corrected.displacement - many.corrected.displacement).max()
    return Found(off * 1e6, "um", 1.0, broken=broken)


@case("ten_steps_at_once_friction_fast", "load step ten times too large", MECHANICS_FAST,
      "with friction the path matters: within 2 % of force, a fortieth of what the tier states")  # fmt: skip
def test_steps_friction_fast() -> Found:
    """With friction."""
    one, many, broken = _ten_steps(0.78)
    return Found(100 * (np.linalg.norm(one.force) / np.linalg.norm(many.force) - 1), "percent", 2.0, broken=broken)


@case("inverted_start_full", "inverted start", MECHANICS_FULL, "refused, in words: no step leads out of a turned cell")
def test_inverted() -> Found:
    """A state in which the gel's surface has been pulled through its back."""
    pose = pose_at("digit", BALL, MIDDLE)
    body = graded_body("digit", BALL, pose, 0.3e-3)
    problem = body.contact(BALL, pose, 0.3e-3, 0.0)
    turned = np.zeros_like(body.solid.mesh.nodes)
    turned[body.solid.mesh.surface, 1] = 3 * sensors.thickness("digit")
    start = dataclasses.replace(problem.start(), state=State(turned, problem.start().state.pressure))
    return refusal(lambda: problem.move(pose.moved(0.3e-3), start, 5e-3), "no equilibrium")


# name -> the difficulty, what is asked, um that a node may move
SMALL = {
    "depth_0.1um": ("tiny depth (0.1 um)", {"depth": 1e-7}, 0.1),
    "force_1uN": ("tiny force (1e-6 N)", {"force": 1e-6}, 2.0),
    "depth_zero": ("zero contact", {"depth": 0.0}, 0.0),
    "force_zero": ("zero contact", {"force": 0.0}, 0.0),
}


@case("{}_{}", {name: hard for name, (hard, *_) in SMALL.items()}, TIERS,
      "converges; nothing moves more than the depth asked for, 2 um by 1 uN, not at all by none; its error is honest",
      *((name, tier) for tier in TIERS for name in SMALL), slow=["force_1uN_full"])  # fmt: skip
def test_near(name: str, tier: str) -> Found:
    """A request too small for any lattice: nothing moves farther than was asked, and the error says so."""
    _, ask, most = SMALL[name]
    found = solve("digit", BALL, MIDDLE, tier=tier, friction=0.0, **ask)
    moved = float(np.linalg.norm(found.displacement, axis=1).max())
    broken = [] if found.converged and np.isfinite(found.displacement).all() else ["did not converge"]
    if not found.force.any() and found.depth > 0 and found.force_error < 1:
        broken.append(f"no force at a depth, and a stated error of {found.force_error:.0%}")
    words = (
        f"{np.linalg.norm(found.force):.3g} N at {found.depth * 1e6:.3g} um, {int(found.contact_patch.sum())} nodes, "
    )
    words += f"states {found.force_error:.0%} and {found.shape_error * 1e6:.2g} um"
    return Found(moved * 1e6, "um", most, words=words, broken=tuple(broken))


@case("force_1nN", "tiny force (1e-6 N)", MECHANICS_FAST, "a thousandth of that is refused, in words")
def test_smaller_force() -> Found:
    """1e-9 N."""
    return refusal(lambda: solve("digit", BALL, MIDDLE, force=1e-9), "at least 1e-06 N")


@case("ball_{:g}mm_{}_{}", "indenter much smaller than an element", TIERS,
      "0.3 mm deep it sinks in between nodes 0.35 and 0.5 mm apart: said in words",
      *((width, sensor, "fast") for sensor in ("digit", "biotac") for width in (0.1, 0.4)),
      (0.1, "digit", "full"))  # fmt: skip
def test_narrow(millimetres: float, sensor: str, tier: str) -> Found:
    ball = Sphere(millimetres * 1e-3 / 2)
    return refusal(lambda: solve(sensor, ball, MIDDLE, depth=0.3e-3, tier=tier, friction=0.0), "sunk")


@case("ball_1mm_digit_fast", "indenter much smaller than an element", MECHANICS_FAST,
      "a ball of three spacings is within the stated error of the full tier")  # fmt: skip
def test_narrow_enough() -> Found:
    """A ball of 1 mm, 0.1 mm deep."""
    ball = Sphere(0.5e-3)
    found = press("digit", ball, MIDDLE, 0.0).at_depth(0.1e-3)
    answer = solve("digit", ball, MIDDLE, depth=0.1e-3, friction=0.0)
    value, words = over_stated(answer, full("digit", ball, MIDDLE, 0.1e-3, 0.0))
    return Found(value, "of stated", 1.0, words=words, broken=broken_fast(found, ball, 0.0))


@case("compliance_in_single_precision", "single precision against double", MECHANICS_FAST,
      "float32 matrices move no node of a solved contact by more than 0.1 um")  # fmt: skip
def test_single_compliance() -> Found:
    """The same nodal forces through the stored matrix, summed in single and in double precision."""
    contact = press("digit", BALL, MIDDLE, 0.0).at_depth(0.8e-3).linear
    compliance = contact.compliance
    rows, mirrored, _ = compliance.answers
    plain = contact.nodes[~mirrored[contact.nodes]]
    force = contact.nodal_force[np.searchsorted(contact.nodes, plain)]
    single, double = (
        sum(
            force[k, axis].astype(kind) * compliance.move[3 * rows[node] + axis].astype(kind)
            for k, node in enumerate(plain) for axis in range(3)
        )
        for kind in (np.float32, np.float64)
    )  # fmt: skip
    return Found(float(np.abs(single - double).max()) * 1e6, "um", 0.1)


class Double(networks.Networks):
    """The same networks in float64."""

    def __init__(self, nets: networks.Networks) -> None:
        super().__init__(nets.tensors, nets.card)
        self.tensors = {
            net: {name: array.astype(float) for name, array in found.items()} for net, found in nets.tensors.items()
        }

    def _blocks(self, function, x, shape, name):
        return function(np.asarray(x, float))


@case("networks_in_single_precision", "single precision against double", TRANSLATION,
      "from counts to the gel float32 moves no node by 0.5 um, a fortieth of the chain's own error")  # fmt: skip
def test_single_networks() -> Found:
    """Frames of the shipped recording through both."""
    nets = networks.load()
    change = prepared()[1].change[100::60]
    single, double = (n.decode_target(n.likely_latents(n.encode_signal(change))[1]) for n in (nets, Double(nets)))
    words = f"{len(change)} frames, nodes move up to {np.abs(double).max() * 1e6:.0f} um"
    return Found(float(np.abs(single - double).max()) * 1e6, "um", 0.5, words=words)


@case("height_map_in_single_precision", "single precision against double", HEIGHT_MAP,
      "float32 look-ups differ from double splines by less than 0.01 um")  # fmt: skip
def test_single_height() -> Found:
    """A dent without sideways movement, whose heights are splines that scipy makes in double precision."""
    from scipy.interpolate import RectBivariateSpline

    gel, mapper = sensors.digit_surface(), gel_mapper()
    bell = np.exp(-(((gel.rest[:, 0] + 7e-3) / 1.4e-3) ** 2 + (gel.rest[:, 2] / 1.4e-3) ** 2) / 2)
    moved = np.zeros_like(gel.rest)
    moved[:, 1] = 0.8e-3 * bell
    window = gel.grid(gel.rest + moved)[gel.window]
    x, z = window[:, 0, 0], window[0, :, 2]
    spline = RectBivariateSpline(x, z, window[..., 1] - HEIGHT_ZERO_Y, kx=3, ky=3)
    seen_x, seen_z = mapper.camera.gel_x, mapper.camera.gel_z
    inside_x = np.flatnonzero((seen_x > x[0]) & (seen_x < x[-1]))
    inside_z = np.flatnonzero((seen_z > z[0]) & (seen_z < z[-1]))
    order_x, order_z = np.sort(seen_x[inside_x]), np.sort(seen_z[inside_z])
    truth = spline(order_x, order_z)
    heights = mapper(moved)[np.ix_(inside_x[np.argsort(seen_x[inside_x])], inside_z[np.argsort(seen_z[inside_z])])]
    return Found(float(np.abs(heights - truth).max()) * 1e6, "um", 0.01)
