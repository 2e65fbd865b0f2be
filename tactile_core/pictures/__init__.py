"""The DIGIT's eye: gel to camera picture, fast or through Mitsuba 3, and the presets that trade error for time.

Mitsuba answers two questions about the gel's mesh: where each pixel's ray meets it, and which points of the lights are
seen from there. Light is added up in numpy, the same for every variant of Mitsuba, so pictures do not depend on it.
Nothing here imports mitsuba before a picture needs it; ``fast`` never does.
"""
