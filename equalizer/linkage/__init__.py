"""The linkage of a haptic device as its software library reports it: Jacobian, inertia and gravity over a grid of
positions.

Order of the data: `grid` (positions that are read, and the Jacobian by finite differences) -> `calibration` (the
readings, conditions under which they are refused, inertia between positions) -> `mirror_lines` (deviation from the
symmetry of a delta linkage, and readings completed by it). Begin at `calibration.py`.
"""
