"""Samples that know their rate, quantity, unit and channels, and recordings made of them.

`signal` -> `recording` (what entered the device, what came out; `recording_checks`, `joining`). Units: `units` (with
`unit_spellings`), `unit_system`, `quantity_words`. Excitations: `excitation`, `multisine`, `masking_noise`. Tools:
`resampling`, `band_limited`, `clock_offset`, `lockin`, `spectral_density`. `summary` prints results, `listed_problems`
is the base of errors that list all that is wrong. Begin at `signal.py`, then `recording.py`.
"""
