"""Feedforward forces for a wanted acceleration, by the inverse of a single identified model.

`trajectory` (CSV table) -> `band_split` -> `feedforward` (a finite record, by the tracker) or `periodic_inverse` (a
periodic signal) -> `quality` (of the delivered acceleration). `model_equalizer` implements the interface of
`equalizer` for the stimuli of a study. Tools: `band_pass`, `planned_motion`, `virtual_spring`. `baselines` has simpler
methods for comparison. Begin at `feedforward.py`.
"""
