"""Shapes without a sensor: lattices, splines and indenters."""
