"""Feedforward forces for a reference acceleration, by the inverse of a single identified model.

`trajectory` (CSV table) -> `band_split` -> `feedforward` (a finite record, by the tracker) or `periodic_inverse` (a
periodic signal) -> `quality` (of the delivered acceleration). `model_equalizer` implements the interface of `equalizer`
for the stimuli of a study. `band_pass`, `planned_motion` and `virtual_spring` are shared by several; `baselines` has
simpler methods for comparison. Used by the other folders of `tracking`, `study.workflows.equalizer` and
`study.workflows.session`. Begin at `feedforward.py`.
"""
