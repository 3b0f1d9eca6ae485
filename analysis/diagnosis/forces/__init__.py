"""Errors as forces: what force a model needs for the measured motion, and what is missing of it.

`needed_force` inverts a model by spectra, `inverse_lines` line by line, `predicted_force` compares with a measured
force, `force_views` says which of these a recording allows; `rigid_model` is the case of a single body; `transfer`
and `missing_force` trace a motion error back to a force.
"""
