"""Diagnosis: which physics a model lacks, by how much, and how certain that is.

`diagnose` is the entry; `diagnosis_settings` are its options, and `search_by_simulation` is its search for effects.
Data pass through `noise`, `data` (measured signals) -> `balance` (regression of the force on laws, without a model) or
`contrast` (comparison with clean recordings), `first_model` -> `forces`, `errors` (error of a model) -> `localisation`
(where the error is) -> `search` (effects that are missing), `confirm`, `reference` -> `discovery` (symbolic regression
of laws outside the catalogue) -> `next_experiment`, `result` (findings), `real_answer`; each uses only those before it.
`document` is the format of the answer, `settings` holds all limits, `effect_words` and `unit_wording` the wording.
Begin at `diagnose.py`.
"""
