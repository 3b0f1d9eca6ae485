"""Diagnosis: which physics a model lacks, by how much, and how certain that is.

`diagnose` is the entry: it takes `diagnosis_settings`, and tries effects by `search_by_simulation`. Data pass through
`noise`, `data` (what was measured) -> `balance` (laws weighed without a model) or `contrast` (against clean
recordings), `first_model` -> `forces`, `errors` (how far a model is off) -> `localisation` (where) -> `search` (what is
missing), `confirm`, `reference` -> `discovery` (laws that have no name) -> `next_experiment`, `result` (what is handed
on), `real_answer`; each uses only those before it. `document` is the format of the answer, `settings` holds all limits,
`effect_words` and `unit_wording` are the wording. Begin at `diagnose.py`.
"""
