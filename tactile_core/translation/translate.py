"""Translate in one pure function: signals to BioTac deformation to DIGIT deformation, force and confidence."""

from __future__ import annotations

import dataclasses
import os
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from .. import accuracy, sensors
from ..errors import TactileError
from ..files.short_text import Summary
from ..recordings import Signals
from ..recordings.flags import Flag
from ..sensors import SOURCE, TARGET
from ..sensors import unrolling as surface
from . import error_bounds, gel_place, networks, plausible, reference_signals
from .answer import MEAN, Answer
from .card_errors import doubt
from .card_sensors import NODES, REST, pair_of
from .contact_frame import STILL, ContactFrame
from .contact_track import Evidence, track
from .error_bounds import KINDS
from .lost_signs import recovered
from .network_sizes import PLACE, SURFACES
from .networks import Networks
from .posterior import Posterior, touches
from .simulated_likeness import Patterns, patterns_of, residual_shares, shipped_patterns, two_contacts, unlike
from .weights import ADVICE

# Frames that differ from training in kind, not in degree, are worth little.
UNTRAINED_CONFIDENCE = 0.2  # assumed
# Share of validation's frames that a distance leaves in range. On networks that a part of the pad was kept from
# (scripts/evaluate_translation.py --held-out) it flags half of that part's frames, and most of those it should.
# The largest change is another matter: signals of deep contacts at the tip are three times those that 99 % of the
# contacts stay below, and training knows them. What exceeds all but one in a thousand is out of its range.
IN_RANGE = {"mahalanobis": 0.99, "residual": 0.99, "largest": 0.999}
# A place is undecided where more than this share of the posterior lies as far away, m, as two contacts must lie apart.
UNDECIDED, APART = 0.3, 3e-3  # assumed


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Translation(Summary):
    """Result of a translation; T frames first, float32, SI units.

    latent_signal (T, K), latent_biotac, latent_digit : means of the networks' latents, before a mount's shift
    displacement_biotac : (T, N, 3) m, outer skin; displacement_digit : (T, M, 3) m, gel surface
    force : (T, 3) N, exerted by the object on the BioTac, sensor frame; zero without contact, as displacements are
    pressure : (T,) Pa, rise of the fluid's pressure, estimated from the electrodes alone; zero where the force is
    contact_center : (T, 2) m, (x, z) on the DIGIT after unrolling, NaN without contact
    confidence : (T,), 1 as in training, 0 far from it
    expected_error_biotac, expected_error_digit : (T,) m, half of all frames like this one have a largest node error
        below it; error_bound_biotac, error_bound_digit : (T,) m, 95 of 100 have (as the validation presses had)
    flags : (T,) uint16, bits of ``flags.Flag``: those of the signals, OUT_OF_RANGE,
        BEYOND_DIGIT, TWO_CONTACTS, UNDECIDED_PLACE and UNEXPLAINED
    """

    latent_signal: np.ndarray
    latent_biotac: np.ndarray
    latent_digit: np.ndarray
    displacement_biotac: np.ndarray
    displacement_digit: np.ndarray
    force: np.ndarray
    pressure: np.ndarray
    contact_center: np.ndarray
    confidence: np.ndarray
    expected_error_biotac: np.ndarray
    expected_error_digit: np.ndarray
    error_bound_biotac: np.ndarray
    error_bound_digit: np.ndarray
    flags: np.ndarray

    @classmethod
    def joined(cls, parts: Sequence[Translation]) -> Translation:
        """Join translations of frames that follow each other."""
        names = [field.name for field in dataclasses.fields(cls)]
        return cls(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})


def _rectified(signals: Signals) -> np.ndarray:
    return (signals.flags & np.uint16(Flag.RECTIFIED)) > 0


def silent_level(silence: dict[str, list[float]], quantity: str) -> float:
    """Return the 99 % quantile of a quantity in a card's ``silence``, frames of noise without contact."""
    return float(np.interp(0.99, silence["levels"], silence[quantity]))


def contact_center(displacement: np.ndarray, rest: np.ndarray, silent: float) -> np.ndarray:
    """Return the centre (T, 2) = (x, z) float32 m of a gel's dent; NaN where no node moves by ``silent`` m."""
    center = accuracy.dent_center(displacement, rest).astype(np.float32)
    center[accuracy.lengths(displacement).max(axis=1) < silent] = np.nan
    return center


def elsewhere(posterior: Posterior, state: np.ndarray, frame: ContactFrame) -> np.ndarray:
    """Return the posterior's share (T,) in contacts ``APART`` m and more on the gel from states (T, STATE)."""
    place, others = state[:, :PLACE], posterior.mean[..., :PLACE]
    points = gel_place.on_gel(frame, others.reshape(-1, PLACE)).reshape(*others.shape[:2], 2)
    far = accuracy.lengths(points - gel_place.on_gel(frame, place)[:, None]) > APART
    return (posterior.weight * (far & touches(posterior.mean))).sum(-1)


class Translator:
    """Verified networks, ready to translate. card : their model card; sha256 : of the card, which names all weights."""

    def __init__(self, nets: Networks, answer: Answer | None = None, patterns: Patterns | None = None) -> None:
        """Take patterns : simulated contacts of the source; None for a BioTac's, which ship."""
        self.nets, self.card, self.sha256 = nets, nets.card, nets.sha256
        self.source, self.target, self._patterns = nets.source, nets.target, patterns
        self.answer = answer or Answer()
        moved = self.answer.mount_shift
        self._shift = gel_place.Shift(nets.frames["MVD"], moved) if moved.any() else None
        self._unrolled = surface.unrolled_nodes(self.source)

    def posterior(self, signals: Signals) -> Evidence:
        """Return each frame's own posterior of its contact, and what ``contact_track`` needs beside it."""
        latent, unsigned = self._latent_signal(signals)
        size = np.sqrt(np.square(self._typical(signals)).mean(axis=1))
        return Evidence(**vars(self.nets.posterior(latent, unsigned)), size=size, rectified=_rectified(signals))

    def followed(self, signals: Signals, time: np.ndarray) -> Translation:
        """Translate a recording at once: frames at times (T,) s, each estimated with its neighbours."""
        return self(signals, track(self.posterior(signals), time) if self.answer.follows else None)

    def plausible(self, signals: Signals, frames: np.ndarray) -> dict[str, np.ndarray]:
        """Draw contacts for each frame, the number given by the options, by ``plausible.NAMES``; frames : (T,)."""
        states = plausible.draw(self.nets.posterior(*self._latent_signal(signals)), frames, self.answer.samples)
        return plausible.contacts(self.nets, states, self.answer.mount_shift)

    def _latent_signal(self, signals: Signals) -> tuple[np.ndarray, np.ndarray]:
        """Latents (T, K) of the signals, and which (T,) of them have no sign, lost and not recovered."""
        change, unsigned = self.changes(signals)
        return self.nets.encode_signal(change, unsigned), unsigned

    def changes(self, signals: Signals) -> tuple[np.ndarray, np.ndarray]:
        """Return what the networks see: changes (T, e) counts, with signs where they are known, and the frames (T,)
        that are left rectified.

        Raises TactileError for another sensor's signals.
        """
        return recovered(self._typical(signals), _rectified(signals), self._patterns)

    def _typical(self, signals: Signals) -> np.ndarray:
        """Changes (T, e) counts of the unit that the networks know. Raises TactileError for another sensor's."""
        if signals.sensor != self.source:
            found = f"signals of a {sensors.title(signals.sensor)}"
            raise TactileError("translation", found, f"those of a {sensors.title(self.source)}, as the weights")
        rest = self.card.get(REST)
        return signals.typical if rest is None else signals.relative_to(np.array(rest))

    def __call__(self, signals: Signals, state: np.ndarray | None = None) -> Translation:
        """Translate all frames of ``signals``; a frame's numbers do not depend on its neighbours.

        state : (T, STATE) of the contacts, estimated from several frames; None: from each frame alone, as ``answer``
            says
        """
        nets = self.nets
        rectified = _rectified(signals)
        change = np.asarray(self._typical(signals), np.float32)
        latent_signal, unsigned = self._latent_signal(signals)
        alone = state is None
        posterior = nets.posterior(latent_signal, unsigned)
        if state is None:
            state = posterior.average if self.answer.kind == MEAN else posterior.likely
        latent_biotac, latent_digit = nets.latents(latent_signal, state, unsigned)
        touched = touches(state)
        biotac, digit = (
            decode(latent) * touched[:, None, None]
            for decode, latent in ((nets.decode_biotac, latent_biotac), (nets.decode_digit, latent_digit))
        )
        if self._shift is not None:
            digit = self._shift(digit)
        # Noise makes a contact of one frame now and then, but none that its neighbours bear out.
        center = contact_center(
            digit, sensors.sensor_surface(self.target).rest, self.silent("digit_m") if alone else STILL
        )
        silent = np.isnan(center[:, 0])
        flags = signals.flags.copy()
        flags[self.out_of_range(change, rectified)] |= np.uint16(Flag.OUT_OF_RANGE)
        shares = residual_shares(change, rectified, self._patterns)
        flags[unlike(shares)] |= np.uint16(Flag.UNEXPLAINED)
        confidence = self._confidence(change, flags, rectified)
        flags[self._beyond_digit(biotac)] |= np.uint16(Flag.BEYOND_DIGIT)
        flags[two_contacts(shares)] |= np.uint16(Flag.TWO_CONTACTS)
        undecided = touched & (elsewhere(posterior, state, nets.frames["MVD"]) > UNDECIDED)
        flags[undecided] |= np.uint16(Flag.UNDECIDED_PLACE)
        return Translation(
            latent_signal, latent_biotac, latent_digit, biotac, digit,
            force=np.where(silent[:, None], np.float32(0), nets.force_in(state, latent_biotac)),
            pressure=np.where(silent, np.float32(0), nets.pressure(change, rectified)),
            contact_center=center,
            confidence=confidence, **self._errors(change, rectified, center[:, 0]), flags=flags,
        )  # fmt: skip

    def silent(self, quantity: str) -> float:
        """Return the `silent_level` of a quantity in this card."""
        return silent_level(self.card["silence"], quantity)

    def _errors(self, change: np.ndarray, rectified: np.ndarray, x: np.ndarray) -> dict[str, np.ndarray]:
        """Compute expected largest errors and their bounds, by `Translation`'s names; x : (T,) m, of the contact."""
        expected, found = self.nets.expected_error(change, rectified), {}
        for index, name in enumerate(SURFACES):
            kinds = {kind: self.bound(expected[:, index], x, name, kind) for kind in KINDS}
            found[f"expected_error_{name}"] = expected[:, index]
            found[f"error_bound_{name}"] = np.where(rectified, kinds["rectified"], kinds["signed"])
        return found

    def bound(self, expected: np.ndarray, x: np.ndarray, surface: str, kind: str = "signed") -> np.ndarray:
        """Bound (T,) m on 95 of 100 largest errors, by `error_bounds.bound`."""
        return error_bounds.bound(expected, x, self.card["error_bounds"][kind][surface])

    def out_of_range(self, change: np.ndarray, rectified: np.ndarray | bool = False) -> np.ndarray:
        """Mark (T,) bool the changes (T, 19) counts outside those of the training, by any distance's quantile."""
        return np.any(self._distances(change, rectified) > self._quantile(rectified, **IN_RANGE), axis=0)

    def _confidence(self, change: np.ndarray, flags: np.ndarray, rectified: np.ndarray) -> np.ndarray:
        """Confidence (T,): 1 for signals like those of the training, 0 far from them.

        Each distance to the training signals counts against its quantiles in validation: it is 1 up to the 95 %
        quantile, 0 at the outermost, and at most UNTRAINED_CONFIDENCE where a flag says that training did not know it,
        or the card that the networks hardly translate.
        Not a calibrated probability: that is what bounds are for.
        """
        usual, far = (self._quantile(rectified, **dict.fromkeys(networks.DISTANCES, level)) for level in (0.95, 1.0))
        confidence = np.clip((far - self._distances(change, rectified)) / (far - usual), 0, 1).min(axis=0)
        untrained = flags & np.uint16(
            Flag.NO_QUIET_PART
            | Flag.SATURATED
            | Flag.DEAD_CHANNEL
            | Flag.LAW_DOUBTED
            | Flag.OUT_OF_RANGE
            | Flag.UNEXPLAINED
        )
        doubted = (untrained > 0) | bool(doubt(self.card))
        confidence = np.where(doubted, np.minimum(confidence, UNTRAINED_CONFIDENCE), confidence)
        return confidence.astype(np.float32)

    def _distances(self, change: np.ndarray, rectified: np.ndarray | bool) -> np.ndarray:
        """Stack the distances (distances, T) of `networks.SignalDistance`."""
        distance = self.nets.signal_distance(np.asarray(change, np.float32), rectified)
        return np.stack([getattr(distance, name) for name in networks.DISTANCES])

    def _quantile(self, rectified: np.ndarray | bool, **level: float) -> np.ndarray:
        """Quantiles (distances, T) or (distances, 1) at each distance's level over like validation frames."""
        table = self.card["distance"]
        limits = {
            kind: np.array(
                [[np.interp(level[name], table["levels"], table[kind][name])] for name in networks.DISTANCES]
            )
            for kind in KINDS
        }
        return np.where(rectified, limits["rectified"], limits["signed"])

    def _beyond_digit(self, displacement: np.ndarray) -> np.ndarray:
        """Mark (T,) contacts of the BioTac without counterpart on the gel: the dent's centre unrolls beyond it."""
        moved = accuracy.lengths(displacement)
        peak = moved.max(axis=1, keepdims=True)
        core = (moved > accuracy.CORE * peak) & (peak > self.silent("biotac_m"))
        weight = np.where(core & np.isfinite(self._unrolled[:, 0]), moved, 0)
        total = weight.sum(axis=1)
        center = weight @ np.nan_to_num(self._unrolled) / np.where(total > 0, total, 1)[:, None]
        center += self.answer.mount_shift
        outside = sensors.shape_of(self.target).outline_distance(center[:, 0], center[:, 1]) <= 0
        return core.any(axis=1) & (outside | (total == 0))


def _check_quantiles(card: dict, where: str) -> None:
    """Check the quantiles behind confidence and silence: growing finite numbers, one a level."""
    _check_table(card.get("silence"), ("biotac_m", "digit_m", "force_N"), f"{where}, silence")
    distance: Any = card.get("distance") if isinstance(card.get("distance"), dict) else {}
    for kind in KINDS:
        table: Any = distance.get(kind) if isinstance(distance.get(kind), dict) else {}
        _check_table({"levels": distance.get("levels"), **table}, networks.DISTANCES, f"{where}, distance.{kind}")


def _check_table(table: Any, names: tuple[str, ...], where: str) -> None:
    levels: Any = table.get("levels") if isinstance(table, dict) else None
    for name in ("levels", *names):
        values: Any = table.get(name) if isinstance(table, dict) else None
        if not (_grows(values) and len(values) == len(levels)):
            expected = "as many growing, finite numbers as levels"
            raise TactileError(f"{where}.{name}", f"{values!r:.80}", expected, ADVICE)


def _grows(values: Any) -> bool:
    numbers = isinstance(values, list) and len(values) > 0 and all(type(v) in (int, float) for v in values)
    return numbers and all(0 <= v <= sys.float_info.max for v in values) and values == sorted(values)


def _check_pair(card: dict[str, Any], source: str | None, target: str | None, where: str) -> None:
    """Check that a card's networks, which its hashes of surfaces name, lead from a sensor to the gel of another."""
    if target is not None:
        sensors.shape_of(target)  # raises for a name that is none, and for a sensor without a gel
    known = pair_of(card, where)
    if source not in (None, known[0]):
        advice = "`tactile convert` takes them, with recordings of that sensor"
        expected = f"networks that translate recordings of {source}"
        raise TactileError(where, f"networks of {' and '.join(known)}", expected, advice)
    if target not in (None, known[1]):
        advice = "Train some (docs/extend.md), or solve the gel under the contact that these find: --gel solved"
        raise TactileError(where, f"networks of {' and '.join(known)}", f"networks that translate to {target}", advice)


def load_translator(
    folder: str | os.PathLike | None = None, answer: Answer | None = None, target: str | None = TARGET,
    source: str | None = SOURCE,
) -> Translator:  # fmt: skip
    """Load the networks of a weights folder, the shipped ones by default, with options of the estimate.

    target : the gel that they must translate to; None for whichever they do
    source : the sensor whose recordings they must translate, by which those that ship are chosen; None for whichever
        they do
    Raises TactileError for weights that are missing, changed, of another shape, or trained for other surfaces, and for
    a target that is no sensor or not theirs.
    """
    nets, place = networks.load(folder, source), folder or networks.shipped_folder(source)
    card_file = f"{place}, card.json"
    _check_quantiles(nets.card, card_file)
    error_bounds.check(nets.card, card_file)
    _check_pair(nets.card, source, target, card_file)
    pair = nets.source, nets.target
    for key, here in ((f"{sensor}{NODES}", sensors.sensor_surface(sensor).sha256) for sensor in pair):
        if nets.card.get(key) != here:
            raise TactileError(
                f"{card_file}, {key}", f"{str(nets.card.get(key))[:12]}...",
                f"{here[:12]}..., the surface of this version", "Use weights trained with this version of the sensors",
            )  # fmt: skip
    if sensors.contacts_of(nets.source) is None:
        known = patterns_of(reference_signals.read(place).typical)
    else:
        known = shipped_patterns(nets.source)
    return Translator(nets, answer, known)
