"""Localisation of a mismatch: in which cells and states it is significant, and through which component it enters.

In this order: `residual_lines` and `residual_spectra` estimate the residual's power, `mismatch_cells` tests it per cell
(channel, input, octave, level) against noise and the error on clean recordings (`model_error_floor`), `mismatch_maps`
does so for the given, re-tuned and completed model; `state_dependence` and `state_regions` test its dependence on the
state of motion, `entry_point` finds the component, `distortion` and `level_trends` the kind of nonlinearity.
`localisation` combines them, `localisation_words` makes sentences of the results. Begin at `mismatch_maps.py`.
"""
