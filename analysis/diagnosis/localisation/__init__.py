"""Localisation of a mismatch: in which cells and states it is significant, and through what it enters.

In this order: `residual_lines` and `residual_spectra` take a residual's power, `mismatch_cells` tests it cell by cell
(channel, input, octave, level; `clean_floor`), `mismatch_maps` does so for each stage of the model, `state_dependence`
and `state_regions` ask in which state of motion it sits, `entry_point` through which component it enters, and
`distortion` of what kind it is. `result.looks` calls them, by `localisation`, which `localisation_words` says.
"""
