"""Fits a first linear model of a device to its recordings alone.

`plain_form` reads a recording of any origin as commands and the motions that they drive (`restore_sign` and
`unnamed_motion` are two of its cases); `choose_structure` compares the structures of `model_structures`, `joint_fit`
fits several axes at once; `model_of_balance` makes a model of what a force balance found, `reduced_recordings` the
recordings that it is fitted to. Begin at `choose_structure.py`.
"""
