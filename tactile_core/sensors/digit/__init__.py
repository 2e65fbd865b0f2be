"""The DIGIT's gel, by its descriptor: its shape and the lattice of its surface."""

from __future__ import annotations

from ..gel_shape import shape_of

SHAPE = shape_of("digit")
DESCRIPTOR = SHAPE.descriptor
HALF_WIDTH, X_TIP, X_BASE = SHAPE.half_width, SHAPE.tip_x, SHAPE.base_x
ARC_X = SHAPE.arc_x  # centre of the semicircular end
BACK_Y, THICKNESS, SPACING = SHAPE.back_y, SHAPE.thickness, SHAPE.spacing

outline_distance, dome_height, dome_point = SHAPE.outline_distance, SHAPE.dome_height, SHAPE.dome_point
plan_grid, gel_surface = SHAPE.plan_grid, SHAPE.surface
