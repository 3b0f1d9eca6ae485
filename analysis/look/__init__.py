"""Checks and summaries of a recording before any model is fitted.

`channels` (flat list of the channels), `cross_spectra` -> `gain_and_lag` -> the checks of quality (result type:
`check`): `completeness`, `clock`, `clipping`, `plausibility`, `levels`, `repeats`, `driven_band`, `kinematics` ->
`overview`. `imposed_motion` tells which of motion and force was imposed. Used by `study.workflows.recording`
(`hapteq look`) and `study.importing`. Begin at `overview.py`.
"""
