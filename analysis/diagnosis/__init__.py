"""Diagnosis: which physics a model lacks, by how much, and how certain that is.

`diagnose` is the entry: it takes `diagnosis_settings`, and tries effects by `search_by_simulation`. Below it, each
folder may use only those after it: `result` (what is handed on), `discovery` (laws that have no name), `search` (what
is missing), `localisation` (where), `errors` (how far a model is from what was measured), `data` (what was measured).
`document` is the format of the answer; `effect_words` and `unit_wording` are its wording.
"""
