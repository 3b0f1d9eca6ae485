"""Signals (samples with their rate, quantity, unit and channels), and recordings made of them.

Order: `signal` -> `recording` (commands and responses of a device; `recording_checks`, `joining`). Units: `units` (with
`unit_spellings`), `unit_system`, `quantity_words`. Excitations: `excitation`, `multisine`, `masking_noise`. Signal
processing: `resampling`, `band_limited`, `clock_offset`, `lockin`, `spectral_density`. `summary`: results as text;
`listed_problems`: base class of errors that list several problems. Used by all packages except `protocols`. Begin at
`signal.py`, then `recording.py`.
"""
