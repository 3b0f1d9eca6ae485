"""Known nonlinear physics in the feedforward: the forces of effects that a diagnosis has named.

`effect_roles` (what can be compensated) -> `known_forces`, `law_forces` (along a motion) -> `known_physics` (added to
the feedforward) and `without_effects` (taken off a recording). Begin at `known_physics.py`.
"""
