"""Workspace interpolation: models identified at several places, and forces for a place between them.

`workspace_models` (checked to belong together) -> `interpolation_choice` (by places that are left out) of
`blended_inverse` (forces are mixed, weights of `place_weights`) and `modal_interpolation` (resonances move:
`band_modes`, `mode_matching`) -> `models_at_place` -> `feedforward_at_place`, `convergence_at_place`. Begin at
`workspace_models.py`, then `feedforward_at_place.py`.
"""
