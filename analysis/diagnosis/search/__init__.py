"""The search for missing effects: forward selection by output-error fits, and the verdict.

`search` runs it. `explain` re-tunes the model and adds one effect after another: `starting_hypotheses` suggests,
`screening` ranks, `search_context` holds what all fits share and makes the first fits, `compare_candidates` fits the
best to the end, `parsimony` chooses. Where the drive repeats, ranks and first fits are those of one period of each
segment (`short_recordings`). `identifiability` and `revise_selection` take out or exchange what the data do not fix or
need; `verdict` says what may be claimed. `guard` keeps the crash of an effect from ending it all, `time_budget` ends it
early; `impacts` is for rattling play, compared by `band_power_comparison`. Begin at `search.py`.
"""
