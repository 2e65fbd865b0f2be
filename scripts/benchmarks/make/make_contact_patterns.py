"""Make the BioTac's contact_patterns.npy: the electrodes' response to simulated contacts, which shows polarities.

    python scripts/benchmarks/make/make_contact_patterns.py [WEIGHTS]     of the weights that ship, or of others

The reference signals of the weights, in counts against rest, with the sign of a raw reading (``sensors.COUNT_SIGN``).
Run it again when the weights were trained again.
"""

from __future__ import annotations

import io
import sys

import numpy as np

from tactile_core.files import atomic
from tactile_core.sensors import SOURCE, describe
from tactile_core.translation import networks, reference_signals


def main(arguments: list[str]) -> int:
    """Write the table; returns the exit status."""
    folder = arguments[0] if arguments else networks.WEIGHTS_FOLDER
    content = io.BytesIO()
    np.save(content, reference_signals.read(folder).typical.astype(np.float16))
    found = describe(SOURCE)
    atomic.write_bytes(found.folder / found.electrodes.contacts, content.getvalue())
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
