"""Iterative learning control: forces are corrected from repeated measurements.

`model_inverse` (the learning operator) -> `convergence` (tested before anything is played) -> `iteration` (play,
compare, correct). Used by `study.workflows.equalizer` (`hapteq equalize --repeat`), `workspace` and `compensation`.
Begin at `iteration.py`.
"""
