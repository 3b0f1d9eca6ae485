"""From what is wanted at the handle to what is commanded.

`lqr` (the finite-horizon tracker and its oracle) -> `feedforward` (one model, one table of accelerations) -> `bands`
(three bands, two models), `learning` (corrected from what was measured), `compensation` (known nonlinear physics) ->
`workspace` (models of several places). Begin at `feedforward/feedforward.py`.
"""
