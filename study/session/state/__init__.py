"""A session as the fold of its facts, and what follows from it.

`rules` (by version) -> `state`, `sitting_state`, `daily_dose` (what holds) -> `fold`, `fold_trial` (facts to state;
`draw_check` trusts none) -> `machine` (what to do next) -> `due_trial` (the presentation that is due). Begin at
`fold.py`.
"""
