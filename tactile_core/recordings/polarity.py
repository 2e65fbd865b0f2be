"""Detect whether a recording's counts fall, as raw ones do, or rise where the fluid film over an electrode thins.

Raw BioTac counts fall (``sensors.COUNT_SIGN``). Some files hold rest minus reading without saying so. Two changes show
the polarity: the change that correlates with the fluid's pressure, and the change against rest. With the right sign
each resembles that of simulated contacts; a `sensor` is the one whose contacts these are."""

from __future__ import annotations

import enum
import functools
from dataclasses import dataclass

import numpy as np

from ..errors import TactileError
from ..sensors import SOURCE, contacts_of, divider, title
from ..sensors.descriptor import of_kind
from ..sensors.fluid_sensor import FALLS, POLARITIES, RISES, Fluid
from .doubt import Doubt, Reason
from .flags import Flag
from .recording import BLOCK
from .rest_level import Framewise

AUTO = "auto"
TOUCHING = 15.0  # counts, root of the sum of squares: ten times the noise; below, a change says nothing
# Counts of PDC, 0.55 kPa: least swing of pressure that is used, since drift outweighs smaller ones in a steady grip. Of
# 36 real fingers (PHAC-2, trials 01 to 03) 4 of 19 with less swing are judged wrong, none of 17 with more.
SWING = 15.0
FEWEST = 20  # frames; of fewer no slope is taken (assumed)
MOST = 500  # frames looked at, evenly spread
# A sign is right if its likeness is larger by MARGIN, or its unexplained part is below LEFT of the other sign's. In
# simulated contacts (noise 1.5 counts, gains 10 % apart) that ratio is .41 in the median, above .7 in 1 of 100. A light
# touch that makes the skin bulge resembles an inverted firm one by .9; its right sign has .98, which LEFT tells apart.
MARGIN, LEFT = 0.15, 0.7
# Largest share of a drift that a change of conductivity leaves unexplained: .28, .17 and .11 on an idle finger after
# 100, 150 and 220 s; of twelve real grips (PHAC, trial 04), soft ones too, .36 and more.
DRIFT_LEFT = 0.3
LIKE = 0.6  # least likeness that decides: changes under real pressure reach .66 to .87 (95 of 100 random ones .62)
SCALE = 15.0  # counts; networks see arcsinh(change / SCALE)


class Basis(enum.Enum):
    """Basis of a polarity: SURE (shown by the recording, or known), ASSUMED, or CONTRADICTED by the recording."""

    SURE = enum.auto()
    ASSUMED = enum.auto()
    CONTRADICTED = enum.auto()


@dataclass(frozen=True)
class Polarity:
    """Whether counts fall or rise where the film thins. name : "falls" or "rises"; found : what shows it, in words"""

    name: str
    found: str
    basis: Basis = Basis.SURE

    @property
    def sure(self) -> bool:
        """Return true if the recording shows the polarity, or it is known; false if it is assumed or contradicted."""
        return self.basis is Basis.SURE

    @property
    def evidence(self) -> str:
        """Return in words, for reports, what shows the polarity, and whether it is assumed."""
        return f"assumed: {self.found}" if self.basis is Basis.ASSUMED else self.found

    @property
    def sign(self) -> float:
        """Return the factor, 1 or -1, that turns the recording's changes into those of raw readings."""
        return 1.0 if self.name == FALLS else -1.0

    @property
    def doubt(self) -> Flag | int:
        """Return the flag that all frames get if the polarity is in doubt, else 0."""
        flags = {Basis.ASSUMED: Flag.POLARITY_ASSUMED, Basis.CONTRADICTED: Flag.POLARITY_DOUBTED}
        return flags.get(self.basis, 0)

    @property
    def warnings(self) -> list[Doubt]:
        """Return a list of the warning that the polarity is in doubt; an empty one if it is not."""
        if self.basis is Basis.CONTRADICTED:
            return [Doubt(Reason.POLARITY_CONTRADICTED, name=self.name, found=self.found)]
        return [] if self.sure else [Doubt(Reason.POLARITY_ASSUMED, found=self.found)]


def choose(shown: Polarity, given: str, of_file: str) -> Polarity:
    """Return the polarity that the user gave, else the file's, else the one that the recording shows. One that the
    recording contradicts is not sure. given, of_file : "falls" or "rises"; any other text counts as none"""
    for stated, who in ((given, "as given"), (of_file, "as the file says")):
        if stated in POLARITIES:
            against = shown.sure and shown.name != stated
            basis = Basis.CONTRADICTED if against else Basis.SURE
            return Polarity(stated, f"{who}; {shown.found}" if shown.sure else who, basis)
    return shown


def polarity_of_sensor(sensor: str, kind: str) -> Polarity:
    """Return the polarity of a sensor's raw readings, by its descriptor; assumed for another kind than "raw"."""
    reading = of_kind(sensor, Fluid).readout.polarity
    raw = f"raw counts of a {title(sensor)}"
    return Polarity(reading, raw) if kind == "raw" else Polarity(reading, f"as {raw}", Basis.ASSUMED)


def polarity_of(
    change: Framewise, quiet: np.ndarray, electrodes: np.ndarray, pdc: np.ndarray | None, *,
    rest_known: bool = False, sensor: str = SOURCE,
) -> Polarity:  # fmt: skip
    """Return the polarity that a recording of signed changes shows; "falls", assumed, if it shows none.

    change : (T, 19) counts against rest; quiet : (T,) bool, frames that rest was taken from, none if it is a guess
    electrodes : (T, 19) counts, repaired; pdc : (T,) counts, or None; rest_known : true if rest is the unit's own
    sensor : name of the recorded sensor, whose descriptor must have simulated contacts"""
    frames = np.flatnonzero(touching(change) & ~quiet)
    frames = frames[spread_out(len(frames), MOST)]
    contacts = by_contacts(change[frames], sensor)
    if contacts is not None and contacts.name == RISES and _as_drift(change[frames], electrodes[frames]):
        contacts = Polarity(FALLS, f"{contacts.found}, but is as a fluid's that cools", Basis.ASSUMED)
    if pdc is not None and not (len(pdc) >= FEWEST and bool(np.isfinite(pdc).all()) and np.ptp(pdc) > 0):
        pdc = None
    swing = 0.0 if pdc is None else float(np.subtract(*np.percentile(pdc, [95, 5])))
    if pdc is not None and swing < SWING and not rest_known:
        # Nothing was pressed, or the grip was steady: then what looks like rest may be a contact.
        found = f"the fluid's pressure changes by {swing:.0f} counts, less than {SWING:.0f}"
        return Polarity(FALLS, found, Basis.ASSUMED)
    shown = [_by_pressure(electrodes, pdc, swing, sensor)] if pdc is not None and swing >= SWING else []
    shown += [contacts] if contacts is not None and (rest_known or quiet.any()) else []
    sure = [found for found in shown if found.sure]
    if sure and len({found.name for found in sure}) == 1:
        return sure[0]
    evidence = "; but ".join(found.found for found in shown) or "nothing in the recording shows it"
    return Polarity(FALLS, evidence, Basis.ASSUMED)


def _by_pressure(electrodes: np.ndarray, pdc: np.ndarray, swing: float, sensor: str) -> Polarity:
    """Return the polarity by which the electrodes' change with the fluid's pressure is more like simulated contacts.
    electrodes : (T, 19) counts; pdc : (T,) counts; swing : counts of PDC over which the change is taken"""
    centred = pdc - pdc.mean()
    slope = np.array([(column - column.mean(dtype=float)) @ centred for column in electrodes.T]) / (centred @ centred)
    return _decided(slope[None] * swing, "the change that goes with the fluid's pressure", sensor)


def by_contacts(touches: np.ndarray, sensor: str = SOURCE) -> Polarity | None:
    """Return the polarity by which touches (n, 19) counts from rest are like simulated ones; None for too few."""
    if len(touches) < FEWEST:
        return None
    return _decided(touches[spread_out(len(touches), MOST)], "the change in contact", sensor)


def _as_drift(change: np.ndarray, electrodes: np.ndarray) -> bool:
    """Return true if a change of the fluid's conductivity explains all but `DRIFT_LEFT` of change (n, 19) counts, the
    difference of electrodes (n, 19) counts to rest."""
    rest = np.median(electrodes - change, axis=0)
    drift = divider.of_films(1.1, rest) - rest
    drift /= np.linalg.norm(drift)
    left = np.linalg.norm(change - np.outer(change @ drift, drift), axis=1) / np.linalg.norm(change, axis=1)
    return bool(np.median(left) < DRIFT_LEFT)


def touching(change: Framewise) -> np.ndarray:
    """Return (T,) bool, true for frames in contact: the norm of their change (T, 19) counts is `TOUCHING` or more."""
    found = np.empty(len(change), bool)
    for start in range(0, len(change), BLOCK):  # their squares would take as much memory as a long recording
        rows = slice(start, start + BLOCK)
        found[rows] = np.sqrt(np.square(change[rows]).sum(axis=1)) >= TOUCHING
    return found


def spread_out(count: int, most: int) -> np.ndarray:
    """Return the indices (n,) of at most ``most`` out of ``count`` elements, evenly spread."""
    return np.linspace(0, count - 1, min(count, most)).astype(int)


def _decided(changes: np.ndarray, what: str, sensor: str) -> Polarity:
    """Return the polarity by which changes (n, 19) counts, called `what`, are more like simulated contacts; assumed
    unless its likeness, a cosine, is clearly larger than that of the other."""
    falls, rises = likeness(changes, sensor), likeness(-changes, sensor)
    name = FALLS if falls >= rises else RISES
    evidence = f"{what} is like simulated contacts by {falls:.2f} if counts fall, by {rises:.2f} if they rise"
    less, more = sorted((falls, rises))
    apart = more - less >= MARGIN or np.sqrt((1 - more**2) / max(1 - less**2, 1e-12)) <= LEFT
    sure = more >= LIKE and apart
    return Polarity(name, evidence, Basis.SURE if sure else Basis.ASSUMED)


def likeness(changes: np.ndarray, sensor: str = SOURCE) -> float:
    """Return the mean cosine of changes (n, 19) counts and the nearest simulated contacts, in arcsinh(counts / 15)."""
    return float((unit(changes) @ patterns(sensor).T).max(axis=1).mean())


def contact_signals(sensor: str = SOURCE) -> np.ndarray:
    """Return changes (P, e) float64 counts of simulated contacts, signed as raw. Raises TactileError for none."""
    found = contacts_of(sensor)
    if found is None:
        raise TactileError(f"sensor {sensor!r}", "no simulated contacts", "a table that [electrodes] contacts names")
    return found


@functools.cache
def patterns(sensor: str = SOURCE) -> np.ndarray:
    """Return unit vectors (P, 19) of simulated contacts, in the networks' scale, arcsinh(counts / 15)."""
    return unit(contact_signals(sensor))


def unit(changes: np.ndarray) -> np.ndarray:
    """Return the unit vectors (n, 19) of changes (n, 19) counts, in the networks' scale, arcsinh(counts / 15)."""
    compressed = np.arcsinh(changes / SCALE)
    return compressed / np.maximum(np.linalg.norm(compressed, axis=1, keepdims=True), 1e-9)
