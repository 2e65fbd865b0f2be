"""Translate touch between robot fingertips: BioTac electrode signals to DIGIT pictures, through deformation.

Importing this package costs the standard library alone; numpy comes with the rooms that compute.
"""

__version__ = "0.1.0"
