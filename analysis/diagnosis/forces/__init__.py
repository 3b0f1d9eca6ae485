"""Errors as forces: the force that a model needs for the measured motion (inverse dynamics), and the missing force.

`force_measure` converts recordings to forces and chooses the band in which their noise allows a comparison;
`inverse_response` gives the frequency response from motion to force, `inverse_dynamics` the required force over time;
`predicted_force` compares it with the applied force (an error measure). `rigid_model` fits one body per command to such
forces; `missing_force` converts an error of the motion to a force. Used by `first_model`, `errors` and later steps.
Begin at `force_measure.py`.
"""
