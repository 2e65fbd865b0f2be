"""Make the BioTac's contact_patterns.npy and contact_pressures.npy: the response to simulated contacts.

    python scripts/benchmarks/make/make_contact_patterns.py [WEIGHTS]     of the weights that ship, or of others

The tables hold the reference signals of the weights, counts against rest with the sign of a raw reading
(``sensors.COUNT_SIGN``), and the fluid's pressure that the weights give for them. By them a reader tells a recording's
polarity, and whether its sensor is like the simulated one. Run it again when the weights were trained again.
"""

from __future__ import annotations

import io
import sys

import numpy as np

from tactile_core.files import atomic
from tactile_core.sensors import SOURCE, describe
from tactile_core.translation import networks, reference_signals
from tactile_core.translation.translate import load_translator


def main(arguments: list[str]) -> int:
    """Write the tables beside the sensor's descriptor, by the networks in the folder arguments[0] or those that ship;
    return the exit status."""
    folder = arguments[0] if arguments else networks.WEIGHTS_FOLDER
    signals = reference_signals.read(folder).typical.astype(np.float16)
    pressures = load_translator(folder).nets.pressure(signals.astype(np.float64)).astype(np.float32)
    found = describe(SOURCE)
    for file, values in (
        (found.electrodes.contacts, signals), (found.electrodes.contact_pressures, pressures),
    ):  # fmt: skip
        content = io.BytesIO()
        np.save(content, values)
        atomic.write_bytes(found.folder / file, content.getvalue())
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
