"""Equalization: from the acceleration wanted at the handle to the forces to be commanded.

`lqr` (the finite-horizon tracker, and its check by one large least-squares problem) -> `feedforward` (one model, one
table of accelerations) -> `bands` (three bands, two models), `learning` (iterative learning control), `compensation`
(known nonlinear physics) -> `workspace` (models of several places). Begin at `feedforward/feedforward.py`.
"""
