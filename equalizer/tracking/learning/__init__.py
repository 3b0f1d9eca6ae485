"""Forces corrected from what was measured (iterative learning control).

`model_inverse` (the learning operator) -> `convergence` (tested before anything is played) -> `iteration` (play,
compare, correct). Begin at `iteration.py`.
"""
