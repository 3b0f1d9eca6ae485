"""Simulated delta device of the size of an omega.3. It shares no code with the models that are fitted to its
recordings, so that a diagnosis of it is an independent test. Not a replica: see docs/simulated_omega3.md.

`parameters` -> `packing` into the flat arrays of `layout` -> each millisecond `dynamics`: `drives` (amplifier, motor,
cable), `linkage` (kinematics), `inertia`, `handle` (hand, bending) -> `sensors`. `compiled` holds the entry points,
`inlined` their compiler settings; `simulated_linkage` reports the linkage to a calibration and fits parameters to one.
Used by `rigs_by_name` and `opening`. Begin at `omega3.py`, then `dynamics.py`.
"""
