"""Compute the electrodes' counts from the fluid film."""
