"""Fits a first linear model of a device to its recordings alone.

In this order: `one_motion_per_force` converts recordings to commands and the motions that they drive (its steps include
`infer_quantity`, `free_motion`, `restore_sign` and `reversed_commands`); `fit_without_model` makes the `first_model` of
a diagnosis, from force balances (`model_from_balance`; `reduced_recordings`) or by a fit. Where a user asks for a model
only, `choose_structure` compares the structures of `model_structures`, and `joint_fit` fits several axes at once.
Begin at `fit_without_model.py`.
"""
