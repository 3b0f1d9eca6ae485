"""Confirms laws of the force balance by simulation and held-out gain.

Without a given model: `fitting_measures` and `force_balance_measures` select the error measures, `laws_for_simulation`
converts the laws of the balance to hypotheses of a simulation, and `confirm_laws` fits them by output error and
withdraws names that this does not confirm. With a model from a file: `balance_with_model` makes the force balance with
that model as its base, and `decide_with_model` judges the laws. Both use the gain on held-out samples
(`held_out_gain`); `require_gain` applies it to effects that a search named. Begin at `confirm_laws.py`.
"""
