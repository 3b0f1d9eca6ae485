"""What blind answers of a diagnosis are worth.

`outcome` (one case, revealed) -> `share` (numbers with their uncertainty) -> `calibration`, `detection`, `follow_up`
-> `score` (a bank); `controlled`, `injected` and `lab_kit` judge controls, injected faults and a lab's own test.
Begin at `score.py`.
"""
