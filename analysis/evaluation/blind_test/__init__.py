"""Scores a diagnosis on blind cases: simulated or real devices whose missing effects are concealed from it.

`outcome` (a case after its label is revealed), `confidence_intervals` (shares, medians and means) -> `calibration`
(stated probabilities), `follow_up` (a further recording) -> `score` (a whole bank) -> `wording` (sentences).
`detection` estimates the strength from which an effect is named; `control_claims` and `injected_faults` judge control
cases and injected faults, `lab_kit` a laboratory's own test. Used by `study.evaluation`. Begin at `score.py`.
"""
