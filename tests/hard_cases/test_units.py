"""Fingers unlike the typical one: thin films, a core met at once, fluids that conduct little or much.

The law must stay finite and monotone there, and a translation that knows the unit within what it states, or flagged.
Deeper than is asked here, with a core that bears most of the force, it is not (docs/accuracy.md, Speed against error).
"""

import functools

import numpy as np
from benchmarks.translation.made_up_units import Unit

from hard_cases.case import MECHANICS_FAST, TRANSLATION, Found, case
from hard_cases.contacts import MIDDLE, broken_fast
from hard_cases.test_chain import over_bound
from tactile_core.geometry.indenters import Sphere
from tactile_core.mechanics.fast.press import FastContact
from tactile_core.mechanics.solve import solve
from tactile_core.recordings import PrepareOptions, prepare
from tactile_core.recordings.assemble import assemble
from tactile_core.sensors import COUNT_MAX
from tactile_core.sensors.fluid_sensor import FALLS

BALL = Sphere(5e-3)
DEPTHS = np.arange(1, 11) * 0.1e-3
# Films a little thinner than the thinnest found (.4), half, and thick; both ends of the range of fluids (assumed).
UNITS = [(film, fluid) for film in (0.35, 0.5, 1.25) for fluid in (0.45, 1.3)]


@functools.cache
def pressed(film: float) -> list[FastContact]:
    """A ball pressed deeper and deeper, without friction."""
    press = Unit(film).press(BALL, MIDDLE, 0.0)
    return [press.at_depth(float(depth)) for depth in DEPTHS]


@case("film_{:g}_fluid_{:g}", "thin films and other fluids", MECHANICS_FAST,
      "as a ball sinks in, the electrode under it falls until the core is met, never back by a count; all are readings",
      *UNITS)  # fmt: skip
def test_law(film: float, fluid: float) -> Found:
    unit, contacts = Unit(film, fluid), [each.linear for each in pressed(film)]
    counts = np.vstack([unit.rest(), unit.readings(contacts)])
    under = (counts[0] - counts[-1]).argmax()
    met = [f"{each.depth * 1e3:.1f} mm" for each in contacts if len(each.core_nodes)]
    words = (
        f"E{under + 1} {counts[0, under]:.0f} to {counts[-1, under]:.0f} counts, core met at {(met or ['no depth'])[0]}"
    )
    broken = [] if np.isfinite(counts).all() else ["counts that are not finite"]
    broken += [] if counts.min() > 0 and counts.max() < COUNT_MAX else ["counts that no converter gives"]
    return Found(max(0.0, np.diff(counts[:, under]).max()), "counts", 1.0, words=words, broken=tuple(broken))


@case("core_met_at_once_film_{:g}", "thin films and other fluids", MECHANICS_FAST,
      "bears from the first step on, or within half a millimetre (a typical film: not within 1 mm); no law broken",
      (0.02, 0.1), (0.2, 0.5))  # fmt: skip
def test_core(film: float, most: float) -> Found:
    contacts = pressed(film)
    on_core = [len(each.linear.core_nodes) > 0 for each in contacts]
    broken = tuple(text for each in contacts for text in broken_fast(each, BALL, 0.0))
    words = f"{contacts[-1].axial_force:.3g} N at 1 mm, {len(contacts[-1].linear.core_nodes)} places on the core"
    return Found(1e3 * DEPTHS[np.argmax(on_core)] if any(on_core) else np.inf, "mm", most, words=words, broken=broken)


@case("film_{:g}_fluid_{:g}_translated", "thin films and other fluids", TRANSLATION,
      "its film given, 0.6 mm deep: the largest node error lies below the bound of 95 of 100 frames, or it is flagged",
      *UNITS)  # fmt: skip
def test_translated(film: float, fluid: float) -> Found:
    unit, contact = Unit(film, fluid), pressed(film)[5]
    still = np.tile(unit.rest(), (60, 1))
    held = np.tile(unit.readings([contact.linear]), (20, 1))  # for one frame, it would be a glitch
    counts = np.concatenate([still, held]).round()
    recording = assemble("unit.npz", "NPZ", electrodes=counts, stamps=np.arange(len(counts)) / 100)
    signals = prepare(recording, PrepareOptions(film=film, tare=slice(0, 60), polarity=FALLS)).at(slice(-1, None))
    digit = solve("digit", BALL, MIDDLE, force=contact.axial_force, friction=0.0)
    return over_bound(signals, {"biotac": contact.corrected.displacement, "digit": digit.displacement})
