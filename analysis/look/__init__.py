"""Recordings looked at before any model.

`channels` (one by one, by stretches) and `cross_spectra` -> `completeness`, `clock`, `clipping`, `plausibility`,
`levels`, `repeats`, `driven_band`, `kinematics` (each a `check`) -> `overview`. Begin at `overview.py`.
"""
