"""Diagnosis: which physics a model lacks, by how much, and how certain that is.

Entry: `diagnose`, or `diagnose_values` for recordings in memory (`prepare_recordings`); options: `diagnosis_settings`.
Data pass through `noise`, `data` (measured signals) -> `balance` (regression of the force on laws, without a model) or
`contrast` (comparison with clean recordings) -> `forces`, `first_model` (where none is given), `errors` (error of a
model) -> `localisation` (where the error is) -> `search` (missing effects, run by `search_by_simulation`), `confirm`,
`reference` -> `discovery` (symbolic regression of laws outside the catalogue) -> `next_experiment`, `result`
(findings), `real_answer`; each folder uses only those before it. `document` is the format of the answer, `limits`
holds all limits, `types` the shared type aliases, `effect_words` and `unit_wording` the wording. Used by
`study.workflows.diagnosis` and `study.evaluation`. Begin at `diagnose.py`.
"""
