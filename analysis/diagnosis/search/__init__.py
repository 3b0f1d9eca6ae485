"""Search for missing effects: forward selection by output-error fits, backward elimination, and the verdict.

`search` runs all steps on a `search_context` (state that all fits share): `explain` re-tunes the model and adds effect
after effect by `next_effect` (`starting_hypotheses` -> `screening` -> first fits, on `short_recordings` where the
excitation repeats -> `compare_candidates` -> `no_prediction`, `parsimony`) -> `revise_selection` and `identifiability`
exchange or remove effects -> `verdict`. `impacts` and `second_effect_with_play` compare play with impacts by
`band_power_comparison`; `reference_recordings` gives gains on clean recordings, `guard` isolates crashes, `time_budget`
limits the duration. Used by `search_by_simulation`, `confirm`, `reference` and `discovery`. Begin at `search.py`.
"""
