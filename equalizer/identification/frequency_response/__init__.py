"""Nonparametric frequency responses: their estimate from recordings, and their resonances and coupling.

Order of the data: `experiments` (spectra of periods or windows) -> `shared_lines` (instrumental-variable estimate, with
variances from `noise_floor`) -> `transfer_estimate` (all lines; `reliable_lines` marks those not to be used) ->
`frequency_response`, the result. `local_polynomial` and `octave_bins` smooth it; `resonances` (with `single_mode`),
`coupling`, `coupling_onset` and `frequency_bands` evaluate it. Used by `state_space`, `mechanical` and
`study.workflows.equalizer`. Begin at `transfer_estimate.py`.
"""
