"""The linkage of a device as its library reports it: Jacobian, inertia and gravity over a grid of positions.

In order: `grid` (where), `calibration` (what was read, what is refused, inertia between the positions), `mirror_lines`
(how far the readings are from the linkage's symmetry, and what that fills in).
"""
