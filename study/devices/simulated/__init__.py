"""A simulated omega.3 in its own equations. It shares no code with the models that are fitted to it, or diagnosis
would only recognise its own work. No replication: see docs/simulated_omega3.md.

`parameters` -> `packing` into the flat arrays of `layout` -> each millisecond `dynamics`: `drives` (amplifier, motor,
cable), `linkage` (kinematics), `inertia`, `handle` (hand, bending) -> `sensors`. `compiled` holds the entry points,
`inlined` their compiler settings; `own_linkage` is what the device tells of itself. Begin at `omega3.py`, then
`dynamics.py`.
"""
