"""Simulated participants. Stateless: an answer depends on the trial and the seed only, not on earlier answers.

`observer` (the interface) -> `direction_feeler` (signal detection over a `psychometric_curve`; `detection` for
intervals), `delivered_feeler`, `intensity_cue`, `unsure` and `strategies` (answers without feeling) -> `population`
(many, drawn) -> `observers` (by the names of `--observer`). `chance` draws by trial. Begin at `observer.py`, then
`direction_feeler.py`.
"""
