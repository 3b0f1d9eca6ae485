"""Physical effects that a model may leave out: one file each, all alike, collected in `catalogue`.

`effect` says the data type: equation, parameters, place; `starts` estimate starting values of its parameters from a
model's residuals; `simulation` computes the response of a model with its effects to commands; `placing` translates
effects of a model file. `discovered_law` and `law_entry` are effects that have no name. Begin at `effect.py` and
`coulomb_friction.py`.
"""
