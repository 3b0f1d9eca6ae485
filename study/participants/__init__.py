"""Simulated participants. They are stateless: an answer depends on the trial and the seed, not on earlier answers.

`observer` (interface) -> `chance` (random draws by trial) and `psychometric_curve` -> `direction_feeler` (signal
detection; `detection` has its thresholds for intervals) -> `delivered_feeler` and `unsure_repeater`, which build on it;
`intensity_cue` and `strategies` (answers without a sense of direction) -> `population` (individual thresholds) ->
`observers` (by the names of `--observer`). Begin at `observer.py`, then `direction_feeler.py`.
"""
