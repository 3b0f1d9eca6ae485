"""Iterative learning control: forces are corrected from repeated measurements.

`model_inverse` (the learning operator) -> `convergence` (tested before anything is played) -> `iteration` (play,
compare, correct). Begin at `iteration.py`.
"""
