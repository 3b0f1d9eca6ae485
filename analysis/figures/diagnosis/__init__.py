"""Figures of one diagnosis: functions from `Findings` to pictures.

`diagnosis_pictures` draws all in the order of the report: `mismatch_map` (where the model differs from the device),
`state_maps` (missing force over the states of motion), `signature` (each named effect), `rivals` (other explanations
that were tried), `held_out` (errors on held-out data), `residual_spectra`. `stage_style` defines colour, dash and name
of the three predictions in all figures. `real_held_out` draws the figure of a recording in the report on real
recordings. Used by `study.workflows.diagnosis` and `study.evaluation.real`. Begin at `diagnosis_pictures.py`.
"""
