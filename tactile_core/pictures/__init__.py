"""DIGIT pictures of a gel: fast, or through Mitsuba 3, with presets that trade error for time.

Mitsuba answers two questions about the gel's mesh: where each pixel's ray meets it, and which points of the lights are
visible from there. Light is summed in numpy, so that pictures do not depend on Mitsuba's variant. Nothing here imports
mitsuba before a picture needs it; ``fast`` never does."""
