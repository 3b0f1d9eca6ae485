"""Mechanical models fitted to recordings: masses, dampers, springs and modes.

Order of the data: `mechanical_lines` (spectra by segment) -> `mechanical_misfit` (weighted residuals) ->
`mechanical_start` (rigid body) -> `mechanical_order` (modes are added while the error on held-out lines falls; each
structure is fitted by `mechanical_refinement`) -> `physical_model` (coordinates of a model file). `modal_*`: the
same for sensors that are not collocated with the commands. Begin at `mechanical_fit.py`.
"""
