"""Equalization: computes the forces to command for a reference acceleration of the handle.

`lqr` (finite-horizon linear-quadratic tracker) -> `feedforward` (forces of a single model for a table of accelerations)
-> `bands` (three frequency bands), `learning` (iterative learning control), `compensation` (known nonlinear physics) ->
`workspace` (models identified at several places). `realtime` exports the tracker to loops in other languages. Used by
`study.workflows.equalizer`. Begin at `feedforward/feedforward.py`.
"""
