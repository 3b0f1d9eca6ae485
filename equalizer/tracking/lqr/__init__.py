"""Finite-horizon linear-quadratic tracking (Anderson and Moore 1990): gains once, then two passes per trajectory.

`tracking_problem` (the cost) -> `riccati` (the recursion; `riccati_kernel` compiled) -> `lqr` (forces). `constrained`
and `limits` keep forces below a cap, `padding` makes room before and after. `rotation`, `changing_direction`, `preview`
and `contact` reuse the stored gains. Begin at `lqr.py`.
"""
