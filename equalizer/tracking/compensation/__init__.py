"""Known nonlinear physics in the feedforward: the forces of effects that a diagnosis has named.

`effect_roles` (what can be compensated) -> `known_forces`, `law_compensation` (along a motion) -> `effect_compensation`
(added to the feedforward) and `subtract_effects` (subtracted from a recording). Begin at `effect_compensation.py`.
"""
