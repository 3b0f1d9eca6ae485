"""Confirms laws of the force balance by simulation and held-out gain.

`fitting_measures` and `force_balance_measures` select the error measures, `confirm_laws` fits the named laws by output
error and withdraws names that this does not confirm; for a model from a file `balance_with_model` makes the balance,
and `decide_with_model` judges its laws. All are judged by `held_out_gain`, effects of a search by `require_gain`. Begin
at `confirm_laws.py`.
"""
