"""Material of the paint on the gel: share of light that it scatters back, and roughness."""

from __future__ import annotations

import dataclasses

from ..errors import TactileError

DIFFUSE, ROUGH_PLASTIC, PRINCIPLED = MATERIALS = ("diffuse", "roughplastic", "principled")
MOST_SPREAD = 2e-3  # m; the gel is 4 mm thick, its coating far thinner


@dataclasses.dataclass(frozen=True)
class Coating:
    """Material of the coating, one of three of Mitsuba's. Raises TactileError for a number out of its range.

    bsdf : "diffuse" (Lambert), "roughplastic" (Lambert under a rough clear coat) or "principled" (Burley 2012)
    albedo : 0..1 share of each LED's light that it scatters back
    roughness : 0.02..1, width of highlights: GGX's alpha of roughplastic, Burley's roughness; not of diffuse
    gloss : 0..1, size of highlights; not of diffuse
    metallic : 0..1, of principled alone; 1 reflects like metal of that albedo
    spread : m, standard deviation of how far light goes sideways in it, at most 2 mm; over the picture, in every preset
    """

    bsdf: str = DIFFUSE
    albedo: tuple[float, float, float] = (0.5, 0.5, 0.5)
    roughness: float = 0.3
    gloss: float = 0.5
    metallic: float = 0.0
    spread: float = 0.0

    def __post_init__(self) -> None:
        if self.bsdf not in MATERIALS:
            raise TactileError("coating, bsdf", repr(self.bsdf), f"one of {', '.join(MATERIALS)}")
        if len(self.albedo) != 3:
            raise TactileError("coating, albedo", f"{len(self.albedo)} numbers", "three, one a LED")
        ranges = [("albedo", value, 0.0) for value in self.albedo]
        ranges += [("roughness", self.roughness, 0.02), ("gloss", self.gloss, 0.0), ("metallic", self.metallic, 0.0)]
        for name, value, least in ranges:
            if not least <= value <= 1:  # false for NaN
                raise TactileError(f"coating, {name}", f"{value:g}", f"{least:g} to 1")
        if not 0 <= self.spread <= MOST_SPREAD:
            raise TactileError("coating, spread_mm", f"{1e3 * self.spread:g}", f"0 to {1e3 * MOST_SPREAD:g}")
