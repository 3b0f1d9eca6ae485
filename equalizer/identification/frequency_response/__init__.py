"""Nonparametric frequency responses: their estimate from recordings, and their resonances and coupling.

`experiments` (periods and windows of a recording) -> `noise_floor` -> `shared_lines` -> `transfer_estimate`
(`reliable_lines` strikes out) -> `frequency_response`, the value that all others take. Smoothed by `local_polynomial`
and `octave_bins`; read by `resonances`, `coupling_onset`, `frequency_bands`. Begin at `transfer_estimate.py`.
"""
