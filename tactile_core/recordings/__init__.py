"""Recordings of a BioTac: read any known file layout, find what is wrong with it, and convert its signals to one form.

``read(path)`` gives a :class:`Recording`, the file as it is; ``prepare(recording, options)`` gives :class:`Signals`,
the changes against rest that the networks take. A new file layout is one new file in ``formats/``."""

from .preparer import prepare
from .readers import layouts, read
from .recording import Recording, Truth
from .signals import PrepareOptions, Signals
from .simulated import write_simulated

__all__ = ["PrepareOptions", "Recording", "Signals", "Truth", "layouts", "prepare", "read", "write_simulated"]
