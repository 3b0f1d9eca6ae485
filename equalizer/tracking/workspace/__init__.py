"""Workspace interpolation: models identified at several places give forces at a place between them.

`workspace_models` (models of one device, checked) -> `interpolation_choice` (cross-validation of two methods):
`blended_inverse` (weighted sum of forces; `place_weights`) or `modal_interpolation` (one model with interpolated
resonances; `band_modes`, `mode_matching`) -> `models_at_place` -> `feedforward_at_place`, `convergence_at_place`. Used
by `study.workflows.equalizer`. Begin at `workspace_models.py`, then `feedforward_at_place.py`.
"""
