"""Choose the tier of contact that is exact enough for a scene, by the measured errors and the scene's depth."""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping
from typing import NamedTuple, cast

import numpy as np

from ..accuracy import Candidate, cheapest
from ..errors import TactileError
from ..mechanics.error_estimate import expected_error, measured
from ..mechanics.fast.compliance import stored
from ..mechanics.force_search import UnreachableError
from ..mechanics.placement import DEPTH_LIMIT, Placement
from ..mechanics.solution import TIERS, Tier
from ..mechanics.solve import solve
from ..sensors import title
from .scene import RecordingSpec, load_scene


class TierChoice(NamedTuple):
    """Tier chosen for a sensor. error : um rms of shape, which 95 of 100 contacts stay below
    ms : CPU time of a contact; share : greatest depth of the scene's presses, divided by the sensor's thickness"""

    tier: Tier
    error: float
    ms: float
    share: float

    def describe(self, sensor: str) -> str:
        """Return the choice for a sensor as a sentence: tier, depth, and the error there."""
        return (
            f"{title(sensor)}: {self.tier} tier, to {self.share:.0%} of the thickness within {self.error:.3g} um of "
            "the exact solution in 95 of 100 contacts"
        )


def tier_errors(sensor: str, share: float) -> list[Candidate]:
    """Return the tiers, "the fast tier" first, each with its largest error of shape, um, up to a depth of ``share`` of
    the thickness, and ms per contact. To the fast tier's, measured against the full tier, the full tier's is added.
    Raises TactileError for a sensor without measured errors."""
    if sensor not in measured()["tiers"]["fast"]:
        advice, expected = "Leave --error out: the fast tier is taken", "a sensor whose tiers were measured"
        raise TactileError("--error", f"no errors are measured on the {title(sensor)}", expected, advice)
    own = {tier: _up_to(tier, sensor, share) for tier in TIERS}
    own["fast"] += own["full"]
    return [Candidate(f"the {tier} tier", own[tier], measured()["tiers"][tier][sensor]["ms"]) for tier in TIERS]


def _up_to(tier: str, sensor: str, share: float) -> float:
    """Return a tier's largest error, um, at any depth up to share (of the thickness): a press passes through all."""
    below = [each["depth_share_to"] for each in measured()["tiers"][tier][sensor]["bins"]]
    depths = [each for each in below if each < share] + [share]
    return 1e6 * max(expected_error(tier, sensor, depth)[0] for depth in depths)


def choose(sensor: str, share: float, bound: float | None) -> TierChoice:
    """Choose the cheapest tier whose error of shape is within ``bound``, um, for presses up to a depth that is
    ``share`` of the thickness; without a bound, None, the fast tier.
    Raises TactileError if none is within it."""
    rows = tier_errors(sensor, share)
    what = f"shape, {title(sensor)} to {share:.0%} of its thickness"
    found = rows[0] if bound is None else cheapest(rows, bound, "um", what)
    return TierChoice(cast(Tier, found.name.split()[1]), found.error, found.ms, share)


def choose_for_scene(path: str | os.PathLike, used: Collection[str], bound: float | None) -> Mapping[str, TierChoice]:
    """Choose by ``choose``, for each of the sensors ``used`` in a scene's [recording], a tier within ``bound``, um."""
    from .scene_recording import check_places, recording_of

    scene, _ = load_scene(path)
    spec = recording_of(scene, path)
    check_places(path, spec)
    indenter = next(i for i in scene.indenters if i.name == spec.indenter).build()
    return {sensor: choose(sensor, depth_share(sensor, indenter, spec), bound) for sensor in used}


def depth_share(sensor: str, indenter, spec: RecordingSpec) -> float:  # noqa: ANN001
    """Return the greatest depth of a recording over the thickness, found by the fast tier; if a force is beyond it or
    its matrices are not built yet, 0.6, the most that contacts reach."""
    if not stored(sensor).bytes:
        return DEPTH_LIMIT
    share = 0.0
    for point in spec.points:
        if point.force_n > 0:
            place = Placement(point.x_mm * 1e-3, point.z_mm * 1e-3, np.radians(spec.tilt_deg))
            try:
                found = solve(sensor, indenter, place, force=point.force_n, friction=spec.friction)
            except UnreachableError:
                return DEPTH_LIMIT
            share = max(share, found.depth / found.thickness)
    return min(share, DEPTH_LIMIT)
