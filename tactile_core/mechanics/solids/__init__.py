"""Elastic bodies: meshes, materials, stress, the fluid, factorisations."""
