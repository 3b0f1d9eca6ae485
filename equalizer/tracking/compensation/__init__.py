"""Compensation of known nonlinear effects, such as friction or a dead band: their forces are added to the feedforward.

`effect_roles` (which effects can be compensated) -> `known_forces` and `law_compensation` (forces along a motion) ->
`effect_compensation` (added to the feedforward) and `subtract_effects` (subtracted from a recording before a model is
identified). Used by `study.workflows.equalizer`. Begin at `effect_compensation.py`.
"""
