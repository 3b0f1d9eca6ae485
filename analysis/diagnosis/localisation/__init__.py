"""Where a mismatch sits.

In this order: `residual_lines` and `residual_spectra` take a residual's power, `mismatch_cells` tests it cell by cell
(channel, input, octave, level; `clean_floor`), `mismatch_maps` does so for each stage of the model,
`tied_states` and `state_regions` ask in which state of motion it sits, `entry_point` through which component it enters,
and `distortion` of what kind it is. `result.looks` calls them, by `localisation`, which `localisation_words` says.
"""
