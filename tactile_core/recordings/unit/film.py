"""Find a unit's fluid film from its recording: its thickness, and the drift of the fluid's conductivity.

The film over an electrode has an impedance of 1 / (thickness * conductivity). The same movement of the skin raises
impedances more where the film is thinner: the networks would read contacts of a unit with films half as thick as a
typical one's about twice as firm. The counts at rest give the product of thickness and conductivity. A prior splits
the product, until there are contacts: they resemble simulated ones only at the right thickness.

The conductivity changes all electrodes alike, as no contact does: it moves by a quarter in minutes, probably with
temperature. It is tracked as the course with which each moment is most like a simulated contact, or like none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...sensors import SOURCE, divider, places_of
from ..polarity import DRIFT_LEFT, SCALE, TOUCHING, contact_signals, spread_out
from ..rest_level import Baseline, Changes, Framewise
from .contact_law import FEWEST, FEWEST_PRESSED, pressure_ratio

FRAMES = 600  # looked at, evenly spread
WINDOW, MOST_WINDOWS = 5.0, 300  # s, frames within it count as one contact; longer windows keep their number below this
LEAST, MOST = 0.2, 3.0  # thickness that a unit may have over a typical one's (assumed)
THICKNESSES = 1.15 ** np.arange(-8.0, 4.0)  # candidates, over a typical unit's: .33 to 1.52
# TYPICAL : index of thickness 1. CLEARLY : nats by which another must be likelier; at 0 simulated typical units get
# another. Forces of simulated films of .5 are 87 % off at 1 nat, 33 % at .25; so are then those of typical films over a
# fluid of .5, which rest at the same counts. DRIFTS : nats by which a drift must be likelier than none (assumed).
TYPICAL, CLEARLY, DRIFTS = 8, 0.25, 3.0
CONDUCTIVITIES = np.arange(-40, 41) * 0.008  # candidates, logarithms over that at rest: 4 counts apart at rest
# Prior standard deviations over units of log thickness and log conductivity: assumed, in sight of five units of films
# .4 (two) and 1 (three), and conductivities .5 to 1.1, over a typical one's.
THICKNESS_SPREAD, CONDUCTIVITY_SPREAD = 0.5, 0.4
# Prior standard deviations of log conductivity over that at rest: at the start, if rest is from this recording or from
# another, and its change in a second (assumed: an idle finger drifted by .25 in 225 s, steadily).
AT_REST, SINCE_REST, A_SECOND = 0.003, 0.1, 0.003
# A change below `DRIFT_LEFT` of the recording's largest drift is no contact, unless its cosine to a simulated one is
# above ALIKE: 99 % of an idle finger's are below .69, 95 % of simulated contacts of .2 N above .83 (chosen by these).
# If log conductivity moves by WARMED and 99 of 100 changes are below IDLE times that bound, the finger is idle: they
# were .6 and 1.2 on an idle finger that moved by .16 and .23; 33 on a pressed one that moved by .06.
ALIKE, IDLE, WARMED = 0.75, 1.5, 0.12
# Error of a rest from another recording: rms over electrodes of log impedance, less the mean (conductivity), times
# thickness; 99 % of an idle finger's frames are below (its skin lay a little aside, for 222 s). PRESSED : Pa, rise of
# pressure that is a contact all the same (assumed, some 12 counts of PDC and its drift).
REST_OFF, PRESSED = 0.0131, 450.0
# MISFIT : distance to the nearest simulated contact that tells conductivities apart, over the change's length.
# INDEPENDENT : share of the contacts that count as independent (assumed). NOISE : counts, of a frame's change.
MISFIT, INDEPENDENT, NOISE = 0.15, 0.25, 2.0
TOO_SMALL = "no change is larger than what the fluid's drift leaves: taken for no contact, light touches with it"
UNSURE = (
    "film taken as {:g} of a typical unit's by the counts at rest: another fluid over a typical film rests alike, and "
    "force would be some {:.1f} times as large. `tactile adapt` tells them apart by PDC, and finds the scale of a force"
)
SKIN = 0.75, 0.35  # measured over simulated pressure of real skins (descriptor of the BioTac), and its spread (assumed)
NO_SKIN = 8.0  # nats, four spreads: if no film brings the pressure's doubt below, it is of another unit or sensor


@dataclass(frozen=True)
class Film:
    """Fluid film of the unit that made a recording.
    thickness : divided by a typical unit's; evidence : what shows it, in words
    frames, conductivity : (P,) rising frames, and the log of the fluid's conductivity over that at rest there, linear
        between them; sensor : name of the one whose simulated contacts separate drift from contact
    idle : true if no change is larger than drift may leave, so that all are taken for drift
    unsure : true if it may be a typical film over another fluid: neither the user nor the fluid's pressure decides"""

    thickness: float
    evidence: str
    frames: np.ndarray
    conductivity: np.ndarray
    sensor: str = SOURCE
    idle: bool = False
    unsure: bool = False

    @classmethod
    def given(cls, thickness: float) -> Film:
        """Return a film of known thickness over a fluid that does not drift."""
        return cls(thickness, "given", np.zeros(1), np.zeros(1))

    def changes(self, change: Changes, rest: Baseline, perhaps_idle: np.ndarray | None = None) -> Changes:
        """Convert change (T, e) counts to what a unit with a typical film would show from the same rest, without drift.

        Changes become zero if they are no larger than the largest drift may leave, and like no simulated contact.
        perhaps_idle : (T,) bool, frames in which PDC shows no contact: there changes that the error `REST_OFF` of a
            rest from another recording may explain become zero, too; None if rest was found in this recording"""
        if self.thickness == 1 and not self.conductivity.any() and perhaps_idle is None:
            return change

        known = contact_signals(self.sensor)
        known = known / np.linalg.norm(known, axis=1, keepdims=True)

        def of_typical_film(frames: np.ndarray) -> np.ndarray:
            """Return the changes (n, 19) counts that a typical film would show in frames (n,), without drift."""
            since_rest = np.exp(np.interp(frames, self.frames, self.conductivity))[:, None]
            seen, still = change[frames], rest.at(frames)
            found = divider.of_typical_film(seen, still, self.thickness, since_rest)
            size, left = np.linalg.norm(found, axis=1), _drift_left(self.conductivity, still, self.thickness)
            contact = size > (IDLE if self.idle else 1.0) * left
            if self.conductivity.any() and not self.idle:
                contact |= (found @ known.T).max(axis=1) > ALIKE * size
            if perhaps_idle is not None:
                grown = np.log(divider.film_impedance(still + seen) / divider.film_impedance(still))
                grown -= grown.mean(axis=1, keepdims=True)  # the conductivity's part
                as_rest = np.square(grown).mean(axis=1) < (REST_OFF / self.thickness) ** 2
                contact &= ~(as_rest & perhaps_idle[frames])
            return found * contact[:, None]

        return Changes(len(change), of_typical_film)

    @property
    def warnings(self) -> list[str]:
        """Return warnings for the user: that all changes were taken for drift; that the film may be misjudged."""
        found = [TOO_SMALL] if self.idle else []
        return [*found, UNSURE.format(self.thickness, 1 / self.thickness)] if self.unsure else found

    def report(self) -> dict[str, object]:
        """Return thickness, evidence, and conductivity_since_rest, its least and largest over that at rest."""
        least, most = np.exp([self.conductivity.min(), self.conductivity.max()])
        return {
            "thickness": round(self.thickness, 4), "evidence": self.evidence,
            "conductivity_since_rest": [round(float(least), 4), round(float(most), 4)],
        }  # fmt: skip


class _Seen:
    """Sampled frames of a recording, in windows: change (n, e) counts from rest (n, e) counts at time (n,) s."""

    def __init__(self, change: np.ndarray, rest: np.ndarray, time: np.ndarray, sensor: str) -> None:
        self.change, self.rest, self.sensor = change, rest, sensor
        self.typical_rest = places_of(sensor).rest_counts
        window = max(WINDOW, (time[-1] - time[0]) / MOST_WINDOWS)
        self.windows, self.window_of = np.unique(((time - time[0]) / window).astype(int), return_inverse=True)
        self.seconds = window * np.maximum(np.diff(self.windows), 1)
        self._known = np.arcsinh(contact_signals(sensor) / SCALE)
        self._squares = np.square(self._known).sum(axis=1)

    def typical(self, thickness: float, conductivity: float | np.ndarray) -> np.ndarray:
        """Return changes (n, e) counts of a typical unit, for a film's thickness and conductivity (n, 1) over rest."""
        change = divider.of_typical_film(self.change, self.rest, thickness, conductivity)
        return divider.typical(change, self.rest, self.typical_rest)

    def apart(self, typical: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return, for changes typical (n, e) counts of a typical unit, the squared distance (n,) to the nearest
        simulated contact, that contact's index (n,), and their squared length (n,); on an asinh scale."""
        seen = np.arcsinh(typical / SCALE)
        length = np.square(seen).sum(axis=1)
        beyond = -2 * seen @ self._known.T  # (n, contacts), millions: worked on in place
        beyond += self._squares
        nearest = beyond.argmin(axis=1)
        apart = length + beyond[np.arange(len(seen)), nearest]
        return np.maximum(apart, 0), nearest, np.maximum(length, 1e-9)

    def unexplained(self, typical: np.ndarray) -> np.ndarray:
        """Return the share (n,) of the squared length of changes typical (n, e) counts, on an asinh scale, that no
        simulated contact explains, as firm as simulated or lighter."""
        seen = np.arcsinh(typical / SCALE)
        along = seen @ self._known.T
        firmness = np.clip(along / self._squares, 0, 1)
        explained = (2 * along - firmness * self._squares) * firmness
        return np.maximum(1 - explained.max(axis=1) / np.maximum(np.square(seen).sum(axis=1), 1e-9), 1e-9)


def find(
    change: Framewise, rest: Framewise, time: np.ndarray, pressure: np.ndarray | None, sensor: str, *,
    thickness: float | None = None, own_rest: bool, drifts: bool = True,
) -> Film:  # fmt: skip
    """Return the fluid film of the unit that made a raw recording.

    change : (T, e) counts from rest (T, e) counts; time : (T,) s; pressure : (T,) Pa, NaN if not measured; or None
    thickness : the film's over a typical one's, if known; own_rest : true if rest was found in this recording
    drifts : true if conductivity may drift; sensor : name of the one with the simulated contacts"""
    frames = spread_out(len(change), FRAMES)
    seen = _Seen(change[frames], rest[frames], time[frames], sensor)
    believed = _believed(_doubt_at_rest(_impedance_at_rest(seen))) if thickness is None else thickness
    log = _tracked(seen, believed, AT_REST if own_rest else SINCE_REST) if drifts else np.zeros(len(seen.windows))
    unsure = False
    if thickness is None:
        measured = None if pressure is None else pressure[frames]
        thickness, evidence, pressure_decides = _thickness(seen, np.exp(log)[seen.window_of, None], measured)
        unsure = thickness != 1 and not pressure_decides
    else:
        evidence = "given"
    middle = np.bincount(seen.window_of, frames) / np.bincount(seen.window_of)
    found = divider.of_typical_film(seen.change, seen.rest, thickness, np.exp(log)[seen.window_of, None])
    beyond = np.linalg.norm(found, axis=1) / np.maximum(_drift_left(log, seen.rest, thickness), 1e-9)
    idle = bool(np.abs(log).max() > WARMED and np.percentile(beyond, 99) < IDLE)
    return Film(thickness, evidence, middle, log, sensor, idle, unsure)


def _drift_left(conductivity: np.ndarray, rest: np.ndarray, thickness: float) -> np.ndarray:
    """Return the norm (T,) counts, over electrodes, of changes that the largest drift may leave unexplained; 0 without
    drift. conductivity : (P,) log of the fluid's conductivity over that at rest
    rest : (T, e) counts; thickness : the film's over a typical unit's"""
    most = float(np.exp(conductivity[np.abs(conductivity).argmax()]))
    drift = divider.of_typical_film(np.zeros_like(rest), rest, thickness, most)
    return DRIFT_LEFT * np.linalg.norm(drift, axis=1)


def _impedance_at_rest(seen: _Seen) -> float:
    """Return the impedance at rest divided by a typical unit's, the median over electrodes."""
    unit, typical = divider.film_impedance(seen.rest[0]), divider.film_impedance(seen.typical_rest)
    return float(np.median(unit / typical))


def _doubt_at_rest(impedance: float) -> np.ndarray:
    """Return minus the log probability (k,) nats of `THICKNESSES`, by impedance at rest over a typical unit's."""
    of_fluid = np.log(impedance * THICKNESSES) / CONDUCTIVITY_SPREAD
    return (np.square(np.log(THICKNESSES) / THICKNESS_SPREAD) + np.square(of_fluid)) / 2


def _believed(doubt: np.ndarray) -> float:
    """Return 1 unless another thickness is clearly likelier, then their mean; doubt : (k,) minus log probabilities"""
    if doubt[TYPICAL] < doubt.min() + CLEARLY:
        return 1.0
    likely = np.exp(doubt.min() - doubt)
    return round(float(np.exp(np.log(THICKNESSES) @ likely / likely.sum())), 2)


def _tracked(seen: _Seen, thickness: float, at_start: float) -> np.ndarray:
    """Return the most plausible course c (windows,) of the log of conductivity over that at rest, by Viterbi's
    algorithm.

    It minimises the sum over windows of the frames' mean min(distance to a simulated contact, to none)^2 / scale, plus
    c_0^2 / (2 at_start^2) and, for each step, (c_1 - c_0)^2 / (2 A_SECOND^2 seconds). It is 0 throughout if drift
    explains too little. thickness : the film's over a typical one's; at_start : prior standard deviation of c_0"""
    still = seen.apart(seen.typical(thickness, 1.0))[2]
    scale = 2 * (len(seen.rest[0]) * (NOISE / SCALE) ** 2 + MISFIT**2 * still)
    cost = np.empty((len(seen.windows), len(CONDUCTIVITIES)))
    for column, log in enumerate(CONDUCTIVITIES):
        apart, _, length = seen.apart(seen.typical(thickness, np.exp(log)))
        cost[:, column] = np.bincount(seen.window_of, np.minimum(apart, length) / scale)
    cost /= np.bincount(seen.window_of)[:, None]
    steps = np.square(CONDUCTIVITIES[:, None] - CONDUCTIVITIES)
    total, back = cost[0] + np.square(CONDUCTIVITIES / at_start) / 2, []
    for window, seconds in zip(cost[1:], seen.seconds, strict=True):
        through = total[:, None] + steps / (2 * A_SECOND**2 * seconds)
        back.append(through.argmin(axis=0))
        total = through.min(axis=0) + window
    if total.min() > cost[:, len(CONDUCTIVITIES) // 2].sum() - DRIFTS:
        return np.zeros(len(cost))
    course = [int(total.argmin())]
    for before in back[::-1]:
        course.append(int(before[course[-1]]))
    return CONDUCTIVITIES[course[::-1]]


def _thickness(seen: _Seen, conductivity: np.ndarray, pressure: np.ndarray | None) -> tuple[float, str, bool]:
    """Return the most plausible thickness over a typical unit's, its evidence in words, and true if the fluid's
    pressure helped to decide, beside the counts at rest and the contacts, if these are enough.
    conductivity : (n, 1) over that at rest; pressure : (n,) Pa, NaN if not measured; or None"""
    impedance = _impedance_at_rest(seen)
    doubt, evidence = _doubt_at_rest(impedance), f"impedance at rest {impedance:.2f} of a typical unit's"
    at_first = seen.typical(_believed(doubt), conductivity)
    touching = np.linalg.norm(at_first, axis=1) >= TOUCHING
    _, which = np.unique(seen.apart(at_first[touching])[1], return_inverse=True)
    contacts = int(which.max(initial=-1)) + 1
    if contacts < FEWEST:
        return _believed(doubt), evidence, False
    pressure = None if pressure is None else pressure[touching]
    by_pressure = np.full(len(THICKNESSES), np.inf)  # nats, where enough is pressed hard enough to judge
    for row, thickness in enumerate(THICKNESSES):
        typical = seen.typical(thickness, conductivity)[touching]
        left = (np.bincount(which, seen.unexplained(typical)) / np.bincount(which)).mean()
        doubt[row] += contacts * INDEPENDENT / 2 * np.log(left)
        if pressure is not None:
            ratio, pressed = pressure_ratio(typical, pressure, seen.sensor)
            if pressed >= FEWEST_PRESSED:
                by_pressure[row] = (np.log(ratio / SKIN[0]) / SKIN[1]) ** 2 / 2
    found = _believed(doubt)
    pressure_decides = bool(by_pressure.min() < NO_SKIN)
    if pressure_decides:
        # It shows no thick film: bodies softer than the simulated ones raise it as well, a sponge to 2.5 times of what
        # a flat acrylic does, each over the simulated one (PHAC, trials 01 to 03).
        doubt += np.where(np.isfinite(by_pressure), by_pressure, by_pressure.min())
        found = min(_believed(doubt), max(found, 1.0))
    return found, f"{evidence}, {contacts} different contacts", pressure_decides
