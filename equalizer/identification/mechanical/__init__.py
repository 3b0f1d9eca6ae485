"""Mechanical models fitted to recordings in the frequency domain: masses, dampers, springs and modes.

`mechanical_fit` runs: `mechanical_lines` (spectra by segment) -> `mechanical_misfit` (weighted residuals) ->
`mechanical_start` (rigid body) -> `mechanical_order` (modes are added while the error on held-out lines falls; each
structure is fitted by `mechanical_refinement`) -> `physical_model` (coordinates of a model file). `modal_*`: the same
for sensors that are not collocated with the commands; other `mechanical_*`: structure, response, checks, result.
`rigid_body` corrects damping for friction, `widened_tolerance` widens tolerances for a diagnosis. Used by
`analysis.diagnosis.first_model` and `study.workflows.diagnosis` (`hapteq twin`). Begin at `mechanical_fit.py`.
"""
