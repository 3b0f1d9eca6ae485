"""Equalization: computes the forces to command from the acceleration that is wanted at the handle.

`lqr` (finite-horizon linear-quadratic tracker) -> `feedforward` (forces of a single model for a table of accelerations)
-> `bands` (three frequency bands), `learning` (iterative learning control), `compensation` (known nonlinear physics) ->
`workspace` (models identified at several places). `realtime` exports the tracker to loops in other languages. Begin at
`feedforward/feedforward.py`.
"""
