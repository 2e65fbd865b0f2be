"""Contacts as Isaac Gym computes them, with corotated linear tetrahedra, for comparison with our own mechanics."""
