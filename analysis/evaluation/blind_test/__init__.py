"""Scoring of a diagnosis' answers to blind cases.

`outcome` (one case, revealed) -> `confidence_intervals` (shares, medians and means) -> `calibration`, `detection`,
`follow_up` -> `score` (a bank); `judge_control`, `injected` and `lab_kit` judge controls, injected faults and a lab's
own test. Begin at `score.py`.
"""
