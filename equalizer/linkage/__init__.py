"""The linkage of a device as it tells it itself: Jacobian, inertia and gravity over a grid of positions.

In order: `grid` (where), `calibration` (what was read, and what is refused), `mirror_lines` (how far the readings are
from the linkage's symmetry, and what that fills in), `inertia_field` (inertia between the positions).
"""
