"""The search for missing effects: forward selection by output-error fits, backward elimination, and the verdict.

Order of the data: `search_context` (what all fits share), `explain` (re-tuning, then effect after effect by
`next_effect`): `starting_hypotheses`, `screening`, first fits on `short_recordings` where the drive repeats,
`compare_candidates`, `no_prediction`, `parsimony`; then `identifiability` and `revise_selection` remove or exchange
effects, and `verdict` judges. `guard` isolates crashes, `time_budget` limits the duration, `reference_recordings`
gives gains on clean recordings, and `impacts` compares rattling play by `band_power_comparison`. Begin at `search.py`.
"""
