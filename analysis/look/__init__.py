"""Checks and summaries of a recording before any model.

`channels` (one by one, by stretches), `cross_spectra` and from these `gain_and_lag` -> `completeness`, `clock`,
`check_clipping`, `plausibility`, `levels`, `find_repeats`, `driven_band`, `kinematics` (each a `check`) -> `overview`.
Begin at `overview.py`.
"""
