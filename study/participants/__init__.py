"""Simulated participants. They are stateless: an answer depends on the trial and the seed, not on earlier answers.

`observer` (interface) -> `random_draws` (random numbers by trial) and `psychometric_curve` -> `direction_feeler`
(signal detection; `detection_thresholds` has its thresholds for intervals) -> `delivered_feeler` and `unsure_repeater`,
which build on it; `intensity_cue` and `control_observers` (answers without a sense of direction) -> `population`
(individual thresholds) -> `observer_catalogue` (by the names of `--observer`). Used by `study.workflows.session`. Begin
at `observer.py`, then `direction_feeler.py`.
"""
