"""Training of the five networks from paired contacts: the only room that knows torch."""
