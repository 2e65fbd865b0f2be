"""Deformed meshes that others simulated: read frame by frame, to train and to measure on.

``read(path)`` yields :class:`Deformation`; a new layout is one new file in ``formats/``, with ``NAME``, ``PATTERN`` and
``read``; see there. Files are HDF5; one frame is in memory at a time.
"""

from .deformation import Deformation
from .readers import layouts, read

__all__ = ["Deformation", "layouts", "read"]
