"""Decode frames: signals to BioTac deformation to DIGIT deformation, force and confidence."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from .. import accuracy, sensors
from ..errors import TactileError
from ..files.short_text import Summary
from ..recordings import Signals
from ..recordings.flags import Flag
from ..recordings.polarity import TOUCHING
from ..sensors import unrolling as surface
from . import gel_place
from .answer import MEAN, Answer
from .card import DOUBT, KINDS, PARTS, PLACE, REST, STATE, SURFACES, doubt, error_bound, silent_level
from .contact_frame import STILL
from .contact_track import Evidence
from .gel_place import contact_center, contact_normal, elsewhere
from .layers import COMPRESSED_LIMIT, DISTANCES
from .networks import Networks
from .posterior import FORCE_SCALE, touches
from .second_contact import second_contact, told_apart
from .simulated_likeness import Patterns, contradicted, recovered, residual_shares, two_contacts, unlike

# Flags of frames that differ from the training in kind, whose confidence is at most UNTRAINED_CONFIDENCE.
UNTRAINED = Flag.NO_QUIET_PART | Flag.SATURATED | Flag.DEAD_CHANNEL | Flag.LAW_DOUBTED | Flag.OUT_OF_RANGE
UNTRAINED |= Flag.UNEXPLAINED
UNTRAINED_CONFIDENCE = 0.2  # assumed
# Share of frames that are explained so far whose largest error is below its bound: chosen on half of 64 made-up units,
# with and without wrong gains, columns and drift (scripts/benchmarks/translation/made_up_units.py judges it on others).
EXPLAINED, WITHIN = (-0.6, 0.2, 1.0), (0.78, 0.96, 1.0)
# Share of validation's frames that a distance leaves in range. On networks that a part of the pad was kept from
# (scripts/evaluate_translation.py --held-out) it flags half of that part's frames, and most of those it should. The
# largest change of deep contacts at the tip is three times what 99 % of the contacts stay below, and is trained.
IN_RANGE = {"mahalanobis": 0.99, "residual": 0.99, "largest": 0.999}
UNDECIDED = 0.3  # share of the posterior elsewhere from which a place counts as undecided (assumed)
LEAST_SQUARE = 1.0  # counts^2, sum over electrodes, least one to divide by: below any reading's noise
SAMPLES = "sample_center", "sample_force"  # of contacts drawn from the posterior


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Translation(Summary):
    """Result of a translation; T frames first, float32, SI units.

    latent_signal, latent_biotac, latent_digit : (T, K) each, means of the networks' latents, before a mount's shift
    displacement_biotac : (T, N, 3) m, outer skin; displacement_digit : (T, M, 3) m, gel surface; zero without contact
    force : (T, 3) N, exerted by the object on the BioTac, sensor frame; zero without contact
    pressure : (T,) Pa, rise of the fluid's pressure, estimated from the electrodes alone; zero without contact
    contact_center : (T, 2) m, (x, z) on the DIGIT after unrolling, NaN without contact
    contact_normal : (T, 3), unit normal of the BioTac's resting skin at the dent, inward, sensor frame; NaN likewise
    confidence : (T,), share of simulated frames like this one whose largest node error is below ``error_bound_digit``;
        lower far from the training, and at most `UNTRAINED_CONFIDENCE` if a flag doubts the frame
    expected_error_biotac, expected_error_digit : (T,) m, median of the largest node error in frames like this one;
        at least the dent where a contact is held through time that the frame's own signals do not show
    error_bound_biotac, error_bound_digit : (T,) m, 95 % quantile of that error (measured on the validation presses)
    flags : (T,) uint16, bits of ``flags.Flag``: those of the signals, and those that translation finds
    second_center : (T, 2) m, second_force : (T, 3) N, of the weaker of two contacts, with `Answer.contacts` = 2; NaN
        and 0 elsewhere. Displacements are then those of both; ``force`` and ``contact_center`` of the stronger
    explained : (T,), 1 - sum((change - predicted)^2) / sum(change^2), predicted being the electrodes' change that such
        a unit shows under the translated contact; at most 1, below 0 if zero is nearer, NaN without contact"""

    latent_signal: np.ndarray
    latent_biotac: np.ndarray
    latent_digit: np.ndarray
    displacement_biotac: np.ndarray
    displacement_digit: np.ndarray
    force: np.ndarray
    pressure: np.ndarray
    contact_center: np.ndarray
    contact_normal: np.ndarray
    confidence: np.ndarray
    expected_error_biotac: np.ndarray
    expected_error_digit: np.ndarray
    error_bound_biotac: np.ndarray
    error_bound_digit: np.ndarray
    flags: np.ndarray
    explained: np.ndarray
    second_center: np.ndarray
    second_force: np.ndarray

    @classmethod
    def joined(cls, parts: Sequence[Translation]) -> Translation:
        """Join the parts, translations of successive frames, to one."""
        return cls(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in vars(parts[0])})


def _rectified(signals: Signals) -> np.ndarray:
    return (signals.flags & np.uint16(Flag.RECTIFIED)) > 0


class Translator:
    """Networks, verified, that encode signals and decode contacts; card, sha256 : model card, its hash; answer :
    options"""

    def __init__(self, nets: Networks, answer: Answer | None = None, patterns: Patterns | None = None) -> None:
        """Store the networks and the options of the estimate (``answer``; None for the defaults).
        patterns : simulated contacts of the source sensor; None for those of a BioTac in the package"""
        self.nets, self.card, self.sha256 = nets, nets.card, nets.sha256
        self.source, self.target, self._patterns = nets.source, nets.target, patterns
        self.answer = answer or Answer()
        if self.answer.contacts > 1 and PARTS not in nets.tensors:
            advice = "Look for one, or train weights with this version"
            raise TactileError("two contacts", "weights that know single contacts alone", "a network `parts`", advice)
        moved = self.answer.mount_shift
        self._shift = gel_place.Shift(nets.frames["MVD"], moved) if moved.any() else None
        self._unrolled = surface.unrolled_nodes(self.source)

    def encode(self, signals: Signals) -> Evidence:
        """Return each frame's own posterior and what else decoding needs. Raises TactileError for another sensor."""
        change, unsigned = self.changes(signals)
        whole, second = self._typical(signals), np.zeros((len(change), 0), np.float32)
        if self.answer.contacts > 1:
            change, second = told_apart(self.nets, change, unsigned)
            whole = change
        latent = self.nets.encode_signal(change, unsigned)
        size = np.sqrt(np.square(whole).mean(axis=1))
        beside = {"rectified": _rectified(signals), "latent": latent, "unsigned": unsigned, "second": second}
        return Evidence(**vars(self.nets.posterior(latent, unsigned)), size=size, **beside)

    def plausible(self, evidence: Evidence, frames: np.ndarray, stiffness: float = 1.0) -> dict[str, np.ndarray]:
        """Draw S = ``answer.samples`` contacts on the gel for each frame from its posterior. Return "sample_center" (T,
        S, 2) = (x, z) m, NaN without contact, and "sample_force" (T, S) N.
        frames : (T,) int, indices into the recording, which are the seeds; stiffness : of the skin, 1 typical"""
        states = evidence.drawn(frames, self.answer.samples)
        shape, flat = states.shape[:2], states.reshape(-1, STATE)
        center = gel_place.on_gel(self.nets.frames["MVD"], flat[:, :PLACE]) + self.answer.mount_shift
        touched = touches(flat)
        force = stiffness * FORCE_SCALE * np.sinh(np.clip(flat[:, PLACE], 0, COMPRESSED_LIMIT))
        center = np.where(touched[:, None], center, np.nan).reshape(*shape, 2)
        return dict(zip(SAMPLES, (center, np.where(touched, force, 0).reshape(shape)), strict=True))

    def changes(self, signals: Signals) -> tuple[np.ndarray, np.ndarray]:
        """Return the networks' input: changes (T, e) counts, signed if signs are known, and a mask (T,) of frames that
        stay rectified. Raises TactileError for another sensor's signals."""
        return recovered(self._typical(signals), _rectified(signals), self._patterns)

    def _typical(self, signals: Signals) -> np.ndarray:
        """Return changes (T, e) counts of the unit that the networks know. Raises TactileError for another sensor."""
        if signals.sensor != self.source:
            found = f"signals of a {sensors.title(signals.sensor)}"
            raise TactileError("translation", found, f"those of a {sensors.title(self.source)}, as the weights")
        rest = self.card.get(REST)
        return signals.typical if rest is None else signals.relative_to(np.array(rest))

    def __call__(self, signals: Signals) -> Translation:
        """Translate all frames of ``signals``, each alone."""
        return self.decode(signals, self.encode(signals))

    def decode(self, signals: Signals, evidence: Evidence, state: np.ndarray | None = None) -> Translation:
        """Translate frames, given their evidence (of `encode`); a frame's numbers do not depend on its neighbours.
        state : (T, STATE) of contacts tracked through several frames; None estimates each frame alone, by ``answer``"""
        nets, rectified, alone = self.nets, evidence.rectified, state is None
        change = np.asarray(self._typical(signals), np.float32)
        latent_signal, unsigned = evidence.latent, evidence.unsigned
        if state is None:
            state = evidence.average if self.answer.kind == MEAN else evidence.likely
        latent_source, latent_target = nets.latents(latent_signal, state, unsigned)
        touched = touches(state)
        skin = nets.decode_source(latent_source) * touched[:, None, None]
        gel = nets.decode_target(latent_target) * touched[:, None, None]
        gel = self._mounted(gel)
        # Noise now and then makes a contact in one frame, but not in its neighbours too.
        least = self.silent("digit_m") if alone else STILL
        center = contact_center(gel, sensors.sensor_surface(self.target).rest, least)
        silent = np.isnan(center[:, 0])
        normal = contact_normal(skin, self.source)
        normal[silent] = np.nan
        way = self._mounted, self.silent("digit_m"), signals.stiffness
        beside = second_contact(nets, evidence.second, silent, *way)
        both = beside.rows
        skin[both], gel[both] = skin[both] + beside.skin, gel[both] + beside.gel
        flags = signals.flags.copy()
        flags[self.out_of_range(change, rectified)] |= np.uint16(Flag.OUT_OF_RANGE)
        shares = residual_shares(change, rectified, self._patterns)
        pressure = np.where(silent, np.float32(0), signals.stiffness * nets.pressure(change, rectified))
        strange = unlike(shares, change) & (~silent | (accuracy.lengths(change) >= TOUCHING))
        denied = contradicted(pressure, signals.pressure_measured) & (signals.kind != "scaled")
        flags[strange | (denied & ~(silent & signals.quiet))] |= np.uint16(Flag.UNEXPLAINED)
        flags[~silent & (DOUBT in self.card)] |= np.uint16(Flag.LAW_DOUBTED)
        predicted = nets.decode_signal(nets.m2s(latent_source))
        predicted[both] += beside.predicted
        explained = np.where(silent, np.float32(np.nan), self._explained(signals, change, predicted, rectified))
        confidence = self._confidence(change, flags, rectified, explained)
        flags[self._beyond_digit(skin)] |= np.uint16(Flag.BEYOND_DIGIT)
        flags[two_contacts(shares) | np.isfinite(beside.center[:, 0])] |= np.uint16(Flag.TWO_CONTACTS)
        undecided = touched & (elsewhere(evidence, state, nets.frames["MVD"]) > UNDECIDED)
        flags[undecided] |= np.uint16(Flag.UNDECIDED_PLACE)
        # The error foretold is that of the frame alone: where that answers no contact, a tracked one may be all wrong.
        held = touched & ~touches(evidence.likely)
        expected = nets.expected_error(change, rectified)
        for error, moved in zip(expected.T, (skin, gel), strict=True):
            error[held] = np.maximum(error[held], accuracy.lengths(moved[held]).max(axis=1))
        return Translation(
            latent_signal, latent_source, latent_target, skin, gel, pressure=pressure, contact_center=center,
            contact_normal=normal,
            force=np.where(silent[:, None], np.float32(0), signals.stiffness * nets.force_in(state, latent_source)),
            confidence=confidence, flags=flags, explained=explained, second_center=beside.center,
            second_force=beside.force, **self._errors(expected, rectified, center[:, 0]),
        )  # fmt: skip

    def _mounted(self, gel: np.ndarray) -> np.ndarray:
        """Return `gel` (T, M, 3) m, displacements of the gel's nodes, moved by the mount's shift."""
        return gel if self._shift is None else self._shift(gel)

    def reverse(self, displacement: np.ndarray) -> dict[str, np.ndarray]:
        """Translate displacement (T, M, 3) m of the target's gel back to the source, each frame alone (D2BPN, B2SPN).

        Returns by name: displacement (T, N, 3) m of the source's skin; force (T, 3) N; electrodes (T, e) counts,
        changes against rest. All are zero if the gel moves less than noise alone makes the networks move it."""
        nets = self.nets
        skin = nets.m2m_back(nets.encode_target(displacement))
        found = {
            "displacement": nets.decode_source(skin), "force": nets.force(skin),
            "electrodes": nets.decode_signal(nets.m2s(skin)),
        }  # fmt: skip
        still = accuracy.lengths(displacement).max(axis=1) < self.silent("digit_m")
        for values in found.values():
            values[still] = 0
        return found

    def _explained(
        self, signals: Signals, change: np.ndarray, predicted: np.ndarray, rectified: np.ndarray
    ) -> np.ndarray:
        """Return `Translation.explained` (T,): change and predicted (T, e) counts of a typical unit are converted to
        this unit's and compared, for rectified (T,) bool frames without signs."""
        at = self.card.get(REST, sensors.typical_rest(self.source))
        own, told = (signals.of_typical(each, at) for each in (change, predicted))
        own, told = (np.where(rectified[:, None], np.abs(each), each) for each in (own, told))
        left, whole = (np.square(each).sum(axis=1) for each in (own - told, own))
        return (1 - left / np.maximum(whole, LEAST_SQUARE)).astype(np.float32)

    def silent(self, quantity: str) -> float:
        """Return what 99 % of frames of noise stay below, by the card; quantity : biotac_m, digit_m or force_N of it"""
        return silent_level(self.card["silence"], quantity)

    def _errors(self, expected: np.ndarray, rectified: np.ndarray, x: np.ndarray) -> dict[str, np.ndarray]:
        """Return the largest errors expected (T, 2) m and their bounds, by `Translation`'s names, for rectified (T,)
        bool. x : (T,) m, of the contact along the finger, NaN without contact"""
        found = {}
        for index, name in enumerate(SURFACES):
            kinds = {kind: self.bound(expected[:, index], x, name, kind) for kind in KINDS}
            found[f"expected_error_{name}"] = expected[:, index]
            found[f"error_bound_{name}"] = np.where(rectified, kinds["rectified"], kinds["signed"])
        return found

    def bound(self, expected: np.ndarray, x: np.ndarray, surface: str, kind: str = "signed") -> np.ndarray:
        """Return the bound (T,) m that 95 of 100 largest node errors stay below, by `card.error_bound`.
        expected : (T,) m, expected errors; x : (T,) m, of the contact along the finger, NaN without contact
        surface : "biotac", the source's, or "digit", the target's; kind : "signed" or "rectified" signals"""
        return error_bound(expected, x, self.card["error_bounds"][kind][surface])

    def out_of_range(self, change: np.ndarray, rectified: np.ndarray | bool = False) -> np.ndarray:
        """Mark (T,) bool frames in which some `SignalDistance` exceeds that of the share `IN_RANGE` of validation
        contacts. change : (T, 19) counts; rectified : (T,) bool or one for all, true if signs are lost"""
        return np.any(self.nets.signal_distance(change, rectified) > self._quantile(rectified, **IN_RANGE), axis=0)

    def _confidence(
        self, change: np.ndarray, flags: np.ndarray, rectified: np.ndarray, explained: np.ndarray
    ) -> np.ndarray:
        """Return `Translation.confidence` (T,). change : (T, e) counts; rectified : (T,) bool; explained : (T,), NaN
        without contact; flags : (T,). Each distance from the training's signals lowers it: by nothing up to the
        distance's 95 % quantile, to zero at the outermost."""
        usual, far = (self._quantile(rectified, **dict.fromkeys(DISTANCES, level)) for level in (0.95, 1.0))
        near = np.clip((far - self.nets.signal_distance(change, rectified)) / (far - usual), 0, 1).min(axis=0)
        doubted = ((flags & np.uint16(UNTRAINED)) > 0) | bool(doubt(self.card))
        near[doubted] = np.minimum(near[doubted], UNTRAINED_CONFIDENCE)
        return (near * np.interp(np.nan_to_num(explained, nan=1.0), EXPLAINED, WITHIN)).astype(np.float32)

    def _quantile(self, rectified: np.ndarray | bool, **level: float) -> np.ndarray:
        """Return the distances' quantiles over validation frames, (distances, T), or (distances, 1) if `rectified` is
        one bool. rectified : (T,) bool or one, the frames' kind; level : of each distance by its name, 0 to 1"""
        table = self.card["distance"]
        limits = {
            kind: np.array([[np.interp(level[name], table["levels"], table[kind][name])] for name in DISTANCES])
            for kind in KINDS
        }
        return np.where(rectified, limits["rectified"], limits["signed"])

    def _beyond_digit(self, displacement: np.ndarray) -> np.ndarray:
        """Mark (T,) bool the contacts on the BioTac that unroll to places beyond the gel, by the dent's centre.
        displacement : (T, N, 3) m of the skin's nodes"""
        moved = accuracy.lengths(displacement)
        peak = moved.max(axis=1, keepdims=True)
        core = (moved > accuracy.CORE * peak) & (peak > self.silent("biotac_m"))
        weight = np.where(core & np.isfinite(self._unrolled[:, 0]), moved, 0)
        total = weight.sum(axis=1)
        center = weight @ np.nan_to_num(self._unrolled) / np.where(total > 0, total, 1)[:, None]
        center += self.answer.mount_shift
        outside = sensors.shape_of(self.target).outline_distance(center[:, 0], center[:, 1]) <= 0
        return core.any(axis=1) & (outside | (total == 0))
