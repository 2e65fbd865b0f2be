"""Translate recordings to deformation: networks, their weights, error bounds, and calibration of units."""
