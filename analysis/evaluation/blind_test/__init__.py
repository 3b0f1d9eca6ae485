"""Scores a diagnosis on blind cases: simulated or real devices whose missing effects are concealed from it.

Order of the data: `outcome` (a case after its label is revealed), `confidence_intervals` (shares, medians and means),
then `calibration` (stated probabilities), `detection` (thresholds) and `follow_up` (a further recording), collected by
`score` for a whole bank. `control_claims` and `injected_faults` judge control cases and injected faults, `lab_kit` a
laboratory's own test, and `wording` puts results in sentences. Begin at `score.py`.
"""
