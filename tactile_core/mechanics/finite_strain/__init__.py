"""The full and the reference tier: contact of a body at finite strain, by Newton's method."""
