"""Export a finished job to third-party layouts.

A new layout is one new file in ``formats/``, with ``BRIEF`` and ``write``; see there.
"""

from .finished_job import Finished, Recorded
from .writers import export, layouts

__all__ = ["Finished", "Recorded", "export", "layouts"]
