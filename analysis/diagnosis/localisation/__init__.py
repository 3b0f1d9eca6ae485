"""Localisation of a mismatch: in which cells and states it is significant, and through which component it enters.

In this order: `residual_lines` and `residual_spectra` estimate the residual's power, `mismatch_cells` tests it cell by
cell (channel, input, octave, level; `clean_floor`), `mismatch_maps` for each stage of the model; `state_dependence` and
`state_regions` test its dependence on the state of motion, `entry_point` finds the component, and `distortion` the kind
of nonlinearity. `result.post_search` calls them through `localisation`; `localisation_words` puts the results into
sentences.
"""
