"""The linkage of a haptic device as its software library reports it: Jacobian, inertia and gravity by position.

Order of the data: `grid` (positions to read; test of the Jacobian by finite differences) -> `mirror_lines` (deviation
from the symmetry of a delta linkage, and readings completed by it) -> `calibration` (all readings, conditions under
which they are refused, inertia between positions). Used by `study.workflows.recording.calibrate_linkage`, and by the
drivers of `study.devices`. Begin at `calibration.py`.
"""
