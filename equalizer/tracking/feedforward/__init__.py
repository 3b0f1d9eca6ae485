"""Feedforward forces of a single model for a wanted acceleration.

`trajectory` (a table) -> `band_split` -> `feedforward` (finite, by the tracker) or `periodic_inverse` (repeated in a
loop) -> `quality`. `model_equalizer` implements the port `equalizer` for stimuli of a session; `baselines` are other
ways to compute forces. Begin at `feedforward.py`.
"""
