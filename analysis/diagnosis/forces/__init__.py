"""Errors as forces: the force that a model needs for the measured motion (inverse dynamics), and the missing force.

`inverse_dynamics` inverts a model by spectra, `inverse_response` line by line, `predicted_force` compares with a
measured force, `force_views` chooses the band in which the recordings allow it; `rigid_model` is the case of a single
body; `missing_force` traces a motion error back to a force.
"""
