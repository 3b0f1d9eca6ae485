"""Fits a first linear model of a device to its recordings alone.

`one_motion_per_force` reads a recording of any origin as commands and the motions that they drive (`restore_sign` and
`infer_quantity` are two of its cases); `choose_structure` compares the structures of `model_structures`, `joint_fit`
fits several axes at once; `model_from_balance` makes a model of what a force balance found, `reduced_recordings` the
recordings that it is fitted to. Begin at `choose_structure.py`.
"""
