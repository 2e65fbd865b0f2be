"""The gap law of ``gap_law`` held against the thin-sheet solve of ``biotac_sheet``, on contacts of the fast tier."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import numpy as np

from tactile_core import sensors
from tactile_core.accuracy import Row, row
from tactile_core.geometry.indenters import Cylinder, Indenter, Sphere
from tactile_core.mechanics.electrodes.biotac_sheet import (
    BiotacSheet,
    biotac_sheet,
    sensing_films,
)
from tactile_core.mechanics.electrodes.gap_law import FILM_CONSTANT, signal_of_gaps
from tactile_core.mechanics.electrodes.reduced_sheet import reduced_sheet
from tactile_core.mechanics.electrodes.thin_sheet import ThinSheet, resistances
from tactile_core.mechanics.fast.compliance import biotac_compliance
from tactile_core.mechanics.fast.contact import Contact, ContactProblem
from tactile_core.mechanics.placement import Placement, biotac_pose, on_gel
from tactile_core.mechanics.solids.elasticity import assemble
from tactile_core.mechanics.solids.fluid_cavity import FluidCavity
from tactile_core.mechanics.solids.hex_mesh import inner_faces, skin_mesh
from tactile_core.mechanics.solids.sparse_cholesky import factor
from tactile_core.mechanics.thickness import DEPTH_LIMIT, thickness_under
from tactile_core.sensors import digit, divider

DEPTHS = (0.15e-3, 0.4e-3, 0.7e-3, 1.0e-3, 1.2e-3)  # m, of every press
INDENTERS = (Sphere(2e-3), Sphere(3.5e-3), Sphere(6e-3), Cylinder(3e-3, 0.5e-3))
OVER_E18 = Placement(-4.17e-3, 0.0)
E18_DEPTHS = (0.3e-3, 0.8e-3, 1.2e-3)  # m; a prototype found +11, +50, +137 % (docs/sources.md, BioTac electrodes)
_RIM_MARGIN, _TILT = 1.0e-3, np.radians(20)  # m and rad: places and angles as ``tactile pairs`` draws them


def electrode_rows(contacts: int = 240, *, each: bool = True) -> Iterator[Row]:
    """Rows {name, value, unit, target, ok, baseline, set}; each : whether those of the single electrodes come too.

    The baseline is the rms of the sheet's own change: the error of a law that answers no change at all. The scale of
    the sheet in counts is the one that makes the best single constant of the law ``FILM_CONSTANT``. No row has a
    target: the law is assumed, and so is its scale in counts.
    """
    inner_skin = _inner_skin()
    touches = _contacts(contacts)
    skin = np.stack([inner_skin(contact) for contact in touches])
    gaps = np.stack([contact.electrode_gaps for contact in touches])
    over_e18 = [inner_skin(contact) for contact in _press(INDENTERS[1], OVER_E18, E18_DEPTHS)]
    yield from _grid_rows(biotac_sheet(), [*skin[:: max(len(skin) // 3, 1)], over_e18[-1]])
    yield from _reduced_rows(biotac_sheet(), touches, skin)
    for of, sheet in (
        ("core at the electrodes", biotac_sheet()),
        ("core of the mesh", biotac_sheet(core_of_mesh=True)),
    ):
        rest = sheet.resistances(sheet.film)
        for depth, moved in zip(E18_DEPTHS, over_e18, strict=True):
            change = 100 * (sheet.resistances(sheet.films(moved)) / rest - 1)
            name = f"sheet_over_E18_{depth * 1e3:.1f}mm"
            yield row(f"{name}_E18", change[17], "percent", baseline=0.0, of=f"7 mm ball, {of}")
            yield row(f"{name}_largest_fall", change.min(), "percent", baseline=0.0, of=f"7 mm ball, {of}")
        found = np.stack([sheet.resistances(sheet.films(moved)) for moved in skin])
        yield from _law_rows(found - rest, gaps, of, each=each)
        divided = divider.reading(sheet.growth(found, rest), sensors.REST_COUNTS) - sensors.REST_COUNTS
        yield from _law_rows(divided, gaps, f"{of}, through a divider", each=False)


def _law_rows(change: np.ndarray, gaps: np.ndarray, of: str, *, each: bool) -> Iterator[Row]:
    """Compare change : (n, 19) of the sheet's resistance or reading; gaps : (n, 19) m, of the law."""
    law = signal_of_gaps(gaps)
    counts = change * (law**2).sum() / (law * change).sum()  # the single constant that fits best becomes the law's own
    own = (law * counts).sum(0) / (law**2).sum(0)  # of each electrode, as a share of the law's
    of = f"{len(change)} contacts, {of}"
    yield row("gap_law_difference", _rms(counts - law), "counts rms", baseline=_rms(counts), of=of)
    yield row("gap_law_difference_own_constants", _rms(counts - own * law), "counts rms", baseline=_rms(counts), of=of)
    yield row("gap_law_correlation", np.corrcoef(counts.ravel(), law.ravel())[0, 1], "1", baseline=0.0, of=of)
    for e in range(19) if each else ():
        name = f"gap_law_E{e + 1:02d}"
        yield row(
            f"{name}_difference", _rms(counts[:, e] - law[:, e]), "counts rms", baseline=_rms(counts[:, e]), of=of
        )
        yield row(f"{name}_correlation", np.corrcoef(counts[:, e], law[:, e])[0, 1], "1", baseline=0.0, of=of)
        yield row(f"{name}_own_constant", FILM_CONSTANT * own[e], "counts m", of=of)


def _grid_rows(sheet: BiotacSheet, skin: list[np.ndarray]) -> Iterator[Row]:
    """Time of a solve, and its error against a grid refined three times (triangles of 0.06 mm)."""
    fine = ThinSheet(*sheet.sheet.given, refine=3)

    def changes(solve: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        rest = solve(sheet.film)
        return 100 * np.stack([solve(sheet.films(moved)) / rest - 1 for moved in skin])

    exact = changes(lambda films: resistances(fine.potentials(films, sheet.fluid.conductivity), 19))
    started = time.perf_counter()
    coarse = changes(sheet.resistances)
    yield row("sheet_solve_time", 1e3 * (time.perf_counter() - started) / (len(skin) + 1), "ms", of="19 electrodes")
    of = f"{len(skin)} contacts, against a grid 8 times as fine"
    yield row("sheet_grid_error", _rms(coarse - exact), "percent of rest", baseline=_rms(exact), of=of)


def _reduced_rows(sheet: BiotacSheet, touches: list[Contact], skin: np.ndarray) -> Iterator[Row]:
    """The sheet on few fields: its time and error a contact, and with films that a contact of the fast tier watches."""
    reduced, sensed = reduced_sheet(), [sensing_films(contact) for contact in touches]
    films = [sheet.films(moved) for moved in skin]
    started = time.perf_counter()
    exact = np.stack([sheet.resistances(each) for each in films])
    between = time.perf_counter()
    found = np.stack([reduced.resistances(each) for each in films])
    ended = time.perf_counter()
    rest, of = sheet.resistances(sheet.film), f"{len(films)} contacts, against the whole sheet"
    yield row("reduced_sheet_time", 1e3 * (ended - between) / len(films), "ms", 3.0, of=of)
    yield row("reduced_sheet_time_ratio", (ended - between) / (between - started), "1", baseline=1.0, of=of)
    change = 100 * (exact / rest - 1)
    for name, answer in (
        ("reduced_sheet_error", found),
        ("reduced_sheet_error_of_sensing_films", np.stack([reduced.resistances(each) for each in sensed])),
    ):
        yield row(name, _rms(100 * (answer / rest - 1) - change), "percent of rest", baseline=_rms(change), of=of)


def _inner_skin() -> Callable[[Contact], np.ndarray]:
    """A function that gives the displacement (n_inner, 3) m of the inner skin in a contact of the fast tier.

    The compliance watches its nodes along one direction each; here the solid is solved under the contact's forces.
    """
    mesh, compliance = skin_mesh(), biotac_compliance()
    free = np.repeat(~mesh.clamped, 3)
    solve = factor(assemble(mesh, sensors.BIOTAC_SKIN)[free][:, free].tocsc())
    swell = FluidCavity(inner_faces(mesh), len(mesh.nodes)).gradient(mesh.nodes)[free]
    under_pressure = solve(swell[:, None])[:, 0]

    def moved(contact: Contact) -> np.ndarray:
        load = np.zeros((len(mesh.nodes), 3))
        load[mesh.surface[compliance.touchable[contact.nodes]]] = contact.nodal_force
        answer = solve(load.ravel()[free][:, None])[:, 0]
        answer -= under_pressure * (swell @ answer) / (swell @ under_pressure)  # the fluid keeps its volume
        full = np.zeros(len(free))
        full[free] = answer
        return full.reshape(-1, 3)[mesh.inner]

    return moved


def _contacts(count: int) -> list[Contact]:
    """The first ``count`` contacts of presses at random places and angles, always the same, the skin off its core."""
    random = np.random.default_rng(0)
    found: list[Contact] = []
    while len(found) < count:
        x = random.uniform(digit.X_TIP, digit.X_BASE)
        z = random.uniform(-digit.HALF_WIDTH, digit.HALF_WIDTH)
        tilt, heading, which = random.uniform(0, _TILT), random.uniform(0, 2 * np.pi), random.integers(len(INDENTERS))
        if on_gel(x, z, _RIM_MARGIN):
            found += _press(INDENTERS[which], Placement(x, z, tilt, heading), DEPTHS)
    return found[:count]


def _press(indenter: Indenter, place: Placement, depths: tuple[float, ...]) -> list[Contact]:
    pose = biotac_pose(indenter, place)
    limit = DEPTH_LIMIT * thickness_under("biotac", indenter, pose)
    problem = ContactProblem(biotac_compliance(), indenter, pose, limit)
    followed = (problem.at_depth(depth) for depth in depths if depth <= limit)
    return [contact for contact in followed if contact.converged and not len(contact.core_nodes)]


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
