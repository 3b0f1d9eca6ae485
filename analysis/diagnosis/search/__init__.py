"""Which effects are missing.

In this order: `seen_directly` names what a recording shows without a model; `explain` re-tunes the model and adds one
effect after another (`candidates` suggests, `screening` ranks, `rivalry` fits, `parsimony` chooses); where the drive
repeats, ranks and first fits are those of one period of each segment (`brief`, `by_brief`). `prune` and `determined`
take out what is not needed or not fixed by the data; `verdict` says what may be claimed. `guard` keeps the crash of one
effect from ending it all. `search` runs this,
`search_beside_sound` with clean recordings of the same device (`learn_clean_floor`), `impacts` for rattling play.
"""
