"""The contacts of one press on both sensors, as rows of a file of pairs."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator

import numpy as np

from ..geometry.indenters import Indenter
from ..mechanics.electrodes.law import SHEET, signal_of
from ..mechanics.fast.compliance import biotac_compliance, compliance_of, digit_compliance
from ..mechanics.fast.contact_state import Contact
from ..mechanics.fast.press import CorrectedPress, FastContact
from ..mechanics.penetration import PenetrationError
from ..mechanics.placement import Placement, on_gel, pose_at
from ..mechanics.thickness import depth_at
from ..sensors import digit as digit_shape
from ..sensors import unrolling
from .pairs_file import quantise
from .scene import PairSpec, Scene

_SLIDE_FROM, _SLIDE_TO = 2, 10  # steps of a path's force at which a slide may begin (assumed)
_SLIDE_STEPS = 3  # contacts of a slide: sticking, partly and wholly slipping ones (assumed)


def press_rows(scene: Scene, seed: int, press: int, electrodes: str = SHEET) -> list[dict[str, np.ndarray]]:
    """The contacts of one press: force grows by the scene's ratio until the first sensor reaches its greatest depth.

    Forces begin log-uniformly within one ratio, so over many presses they are log-uniform. A press that slides ends
    with its slide, at the force it had reached, by the same way on both sensors. A scene with ``depth_steps`` pairs
    contacts of the same depth in place of those of the same force. electrodes : their law, of ``law.LAWS``
    """
    spec = scene.pairs
    random = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(press,)))
    which = int(random.integers(len(scene.indenters)))
    indenter = scene.indenters[which].build()
    place = draw_place(random, spec)
    on_both = [_press(sensor, indenter, place, spec) for sensor in ("biotac", "digit")]
    rows, stood = [], np.array(dataclasses.astuple(place), np.float32)
    path = _by_depth(random, spec, on_both) if spec.depth_steps else _by_force(random, spec, on_both)
    for (biotac, digit), slide in path:
        if biotac is None or digit is None:
            break
        named = {
            "press": np.int32(press),
            "indenter": np.int16(which),
            "slide": slide.astype(np.float32),
            "place": stood,
        }
        rows.append({**named, **pair_row(biotac, digit, electrodes)})
    return rows


_OnBoth = tuple[FastContact | None, FastContact | None]


def _by_force(
    random: np.random.Generator, spec: PairSpec, on_both: list[CorrectedPress]
) -> Iterator[tuple[_OnBoth, np.ndarray]]:
    """Contacts of the same force on both sensors, None where there is none, and slide (2,), m, while both follow."""
    for force, slide in _path(random, spec):
        try:
            found = tuple(on_one.at_force(force, on_one.pose.slid(*slide)) for on_one in on_both)
        except PenetrationError:  # an edge sinks in between the surface's nodes: there the fast tier ends
            return
        yield found, slide


def _by_depth(
    random: np.random.Generator, spec: PairSpec, on_both: list[CorrectedPress]
) -> Iterator[tuple[_OnBoth, np.ndarray]]:
    """Contacts of the same depth on both sensors: depths evenly apart, from a random start."""
    least, most, start = 1e-3 * spec.depth_min_mm, 1e-3 * spec.depth_max_mm, random.uniform()
    for step in range(spec.depth_steps):
        depth = least + (most - least) * (step + start) / spec.depth_steps
        yield tuple(_at_depth(on_one, depth) for on_one in on_both), np.zeros(2)


def _at_depth(on_one: CorrectedPress, depth: float) -> FastContact | None:
    found = on_one.at_depth(depth) if depth <= on_one.limit else None
    return found if found and found.linear.converged and len(found.linear.nodes) else None


def _path(random: np.random.Generator, spec: PairSpec) -> Iterator[tuple[float, np.ndarray]]:
    """Force, N, and slide (2,), m, of each contact of a press, without an end unless it slides."""
    force = spec.force_min_n * spec.force_ratio ** random.uniform()
    begin = int(random.integers(_SLIDE_FROM, _SLIDE_TO)) if random.uniform() < spec.slide_share else None
    heading, length = random.uniform(0, 2 * np.pi), 1e-3 * spec.slide_max_mm * random.uniform()
    for step in itertools.count():
        yield force, np.zeros(2)
        if step == begin:
            break
        force *= spec.force_ratio
    for share in np.arange(1, _SLIDE_STEPS + 1) / _SLIDE_STEPS:
        yield force, share * length * np.array([np.cos(heading), np.sin(heading)])


def _press(sensor: str, indenter: Indenter, place: Placement, spec: PairSpec) -> CorrectedPress:
    pose = pose_at(sensor, indenter, place)
    limit = depth_at(spec.depth_max_percent / 100, sensor, indenter, pose)
    return CorrectedPress(compliance_of(sensor), indenter, pose, limit, spec.friction)


def draw_place(random: np.random.Generator, spec: PairSpec) -> Placement:
    """Draw the place and tilt of a press: evenly over the gel inside its rim, leaning evenly over directions."""
    while True:
        x = random.uniform(digit_shape.X_TIP, digit_shape.X_BASE)
        z = random.uniform(-digit_shape.HALF_WIDTH, digit_shape.HALF_WIDTH)
        if on_gel(x, z, spec.rim_margin_mm * 1e-3):
            break
    lean = np.arccos(random.uniform(np.cos(np.radians(spec.tilt_max_deg)), 1))
    return Placement(x, z, float(lean), float(random.uniform(0, 2 * np.pi)))


def pair_row(biotac: FastContact, digit: FastContact, electrodes: str = SHEET) -> dict[str, np.ndarray]:
    """Arrays stored of one paired contact, as in the file, see ``DATASETS``. Electrodes' films are not corrected."""
    skin, gel = biotac_compliance(), digit_compliance()
    return {
        "displacement_biotac": quantise(biotac.corrected.displacement),
        "displacement_digit": quantise(digit.corrected.displacement),
        "signal": signal_of(biotac.linear, electrodes).astype(np.float32),
        "gap": biotac.linear.electrode_gaps.astype(np.float32),
        "force": biotac.force.astype(np.float32),
        "force_digit": digit.force.astype(np.float32),
        "pressure": np.float32(biotac.pressure),
        "depth_biotac": np.float32(biotac.linear.depth),
        "depth_digit": np.float32(digit.linear.depth),
        "contact_center": contact_center(digit.linear).astype(np.float32),
        "beyond_digit": beyond_digit(skin.touchable[biotac.linear.nodes]),
        "contact_patch_biotac": _patch(len(skin.surface.rest), skin.touchable[biotac.linear.nodes]),
        "contact_patch_digit": _patch(len(gel.surface.rest), gel.touchable[digit.linear.nodes]),
    }


def contact_center(digit: Contact) -> np.ndarray:
    """Centre of pressure (2,) = (x, z) m on the resting gel: touching nodes weighted by their force."""
    gel = digit_compliance()
    weight = np.linalg.norm(digit.nodal_force, axis=1)
    return weight @ gel.surface.rest[gel.touchable[digit.nodes]][:, [0, 2]] / weight.sum()


def beyond_digit(touched: np.ndarray) -> np.bool_:
    """Return true if these nodes of the BioTac (indices or a mask) reach beside what rolls onto the DIGIT's gel.

    No contact of the gel is their equal.
    """
    x, z = unrolling.unrolled_nodes()[touched].T
    return (digit_shape.outline_distance(x, z) <= 0).any()  # it is 0 everywhere outside


def _patch(size: int, nodes: np.ndarray) -> np.ndarray:
    patch = np.zeros(size, bool)
    patch[nodes] = True
    return patch
