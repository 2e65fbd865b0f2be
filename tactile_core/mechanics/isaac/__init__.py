"""Contacts as Isaac Gym simulates them: corotated linear tetrahedra."""
