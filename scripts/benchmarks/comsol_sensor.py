"""The skin of the COMSOL presses as a sensor of the fast tier: that of the BioTac SP, but thinner and stiffer."""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from benchmarks.make import make_biotac_sp_profile
from tactile_core import sensors
from tactile_core.sensors import biotac_sp
from tactile_core.sensors.descriptor import FILE, OWN
from tactile_core.sensors.electrodes import table_of

LIKE, NAME = "biotac_sp", "biotac_comsol"
YOUNGS = 6.67  # MPa, fitted to the force of the press 001; finite strain has 5.97 times 6 (C10 + C01), 5.4 MPa
_HELD = 0.01  # mm, inside the inner skin's poles, from where on it is held


@contextmanager
def known(lattice: Mapping[str, int] | None = None) -> Iterator[str]:
    """Put the sensor into a folder of its own, and yield its name, by which it is known inside the context.

    lattice : fields of its [lattice] that differ, for a coarser one
    Raises TactileError where the BioTac SP's table of electrodes is not there.
    """
    sensors.places_of(LIKE)
    skin, places, before = sensors.skin_of(LIKE).descriptor, table_of(LIKE), os.environ.get(OWN)
    thick = 1e3 * biotac_sp.THICKNESS
    tip, base = (1e3 * each for each in skin.skin.outer_poles)
    inner = tip + thick, base - thick
    numbers = {
        "thickness_mm": thick, "inner_poles_mm": f"[{inner[0]:.2f}, {inner[1]:.2f}]", "youngs_mpa": YOUNGS,
        "tip_cap_x_mm": f"{inner[0] + _HELD:.2f}", "base_cap_x_mm": f"{inner[1] - _HELD:.2f}", **(lattice or {}),
    }  # fmt: skip
    text = (skin.folder / FILE).read_text(encoding="utf-8")
    for name, number in numbers.items():
        text, count = re.subn(rf"^{name} = [^#\n]*", f"{name} = {number} ", text, flags=re.MULTILINE)
        assert count == 1, name
    with tempfile.TemporaryDirectory() as folder:
        own = Path(folder) / NAME
        own.mkdir()
        (own / FILE).write_text(text, encoding="utf-8")
        (own / places.name).write_bytes(places.read_bytes())
        os.environ[OWN] = folder
        try:
            (own / skin.skin.profile).write_text(make_biotac_sp_profile.table(NAME), encoding="utf-8")
            yield NAME
        finally:
            os.environ.pop(OWN)
            if before is not None:
                os.environ[OWN] = before
