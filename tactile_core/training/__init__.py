"""Training of the five networks from paired contacts: the only package that imports torch."""
