"""Fits a first linear model of a device to its recordings alone.

`one_motion_per_force` converts recordings to commands and the motions that they drive (steps: `infer_quantity`,
`free_motion`, `restore_sign`, `reversed_commands`) -> `fit_without_model` fits the `first_model` of a diagnosis, from
force balances (`model_from_balance`; `reduced_recordings`) or otherwise. Where a user asks for a model only,
`choose_structure` compares the structures of `model_structures`; `joint_fit` fits several axes at once. Used by
`diagnose_values` and `study.workflows.diagnosis`. Begin at `fit_without_model.py`.
"""
