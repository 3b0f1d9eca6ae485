"""Finite-horizon linear-quadratic tracking (Anderson and Moore 1990): gains once, then two passes per trajectory.

`tracking_problem` (model and cost) -> `riccati` (gains; `riccati_kernel` is compiled) -> `lqr` (forces of a trajectory;
`lqr_kernel` is compiled). `limits` and `constrained` keep forces below a cap, `padding` adds zeros before and after.
Built on the stored gains: `rotation`, `changing_direction`, `contact`; on stationary gains: `preview`. Used by
`feedforward`, `bands` and `realtime`. Begin at `lqr.py`.
"""
