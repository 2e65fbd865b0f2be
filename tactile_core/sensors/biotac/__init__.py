"""The BioTac's skin and core as structured surfaces, from the profile table of the public mesh."""

from __future__ import annotations

from ..skin_shape import skin_of

SHAPE = skin_of("biotac")
DESCRIPTOR = SHAPE.descriptor
AXIS_Y, PAD_ANGLE, SKIN_THICKNESS = SHAPE.axis_y, SHAPE.pad_angle, SHAPE.thickness

angles, skin_grid, skin_points, skin_surface = SHAPE.angles, SHAPE.skin_grid, SHAPE.skin_points, SHAPE.skin_surface
core_radius, check_inside = SHAPE.core_radius, SHAPE.check_inside
