"""Mechanical models of recordings: masses, dampers, springs, modes, and how well each is known.

`mechanical_lines` (spectra by segment) -> `mechanical_start` -> `mechanical_order` with `mechanical_refinement` (one
more unknown while held-out lines gain) -> `mechanical_model_of` (the model file's terms). `modal_*` is the same for
sensors that are not collocated with the commands. Begin at `mechanical_fit.py`.
"""
