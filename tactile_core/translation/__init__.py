"""Recordings to deformation: the networks, their weights, bounds of their error, and units of their own."""
