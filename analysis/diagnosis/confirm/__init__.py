"""Confirmation of laws and effects by output-error fits (simulation) and by the gain on held-out samples.

Without a given model: `fitting_measures` and `force_balance_measures` select the error measure, `laws_for_simulation`
converts the laws of a force balance to hypotheses of a simulation, and `confirm_laws` fits them and withdraws names
that this does not confirm. With a given model: `balance_with_model` makes a force balance with that model as its base,
and `decide_with_model` decides which effects of the search are named. Both use the gain of `held_out_gain`;
`require_gain` applies it to effects that a search named. Used by `diagnose`, `search_by_simulation`, `discovery` and
`result`. Begin at `confirm_laws.py` or `decide_with_model.py`.
"""
