"""Translate touch between robot fingertips: BioTac electrode signals to DIGIT pictures, through deformation.

Importing this package loads the standard library alone; the subpackages that compute load numpy.
"""

__version__ = "0.1.0"
