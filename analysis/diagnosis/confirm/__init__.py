"""Confirms laws of the force balance by simulation and held-out gain.

`fitting_measures` says in which error measures they are fitted, `confirm_laws` fits what a balance named by output
error and takes back what that does not bear out; beside a model from a file `balance_beside_model` makes the balance,
and `laws_beside_model` weighs its laws. `held_out_gain` is what all of them are judged by. Begin at
`confirm_laws.py`.
"""
