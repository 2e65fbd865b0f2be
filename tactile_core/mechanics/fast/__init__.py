"""The fast tier: compliance of the resting body, contact of its surface nodes, a learned correction."""
