"""Localisation of a mismatch: in which cells and states it is significant, and through which component it enters.

`residual_lines`, `residual_spectra` and `segment_spectra` estimate the residual's power -> `mismatch_cells` tests it
per cell (channel, input, octave, level) against noise and the error on clean recordings (`model_error_floor`),
`mismatch_maps` for the given, re-tuned and completed model; `state_dependence` and `state_regions` test its dependence
on the state of motion (`block_permutation`), `entry_point` finds the component, `distortion` and `level_trends` the
kind of nonlinearity -> `localisation` combines them -> `mismatch_rows`, `localisation_words` (rows of the document,
sentences). Used by `result`. Begin at `mismatch_maps.py`.
"""
