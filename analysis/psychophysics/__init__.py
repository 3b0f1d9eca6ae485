"""Analysis of a study's trials: thresholds, their statistics, and the quality of delivery.

`study_analysis` runs: `population` (who answered) -> `runs` (staircases recomputed from the answers) -> `thresholds` ->
`threshold_table` -> `anova` and `comparisons` (as published), `repeated_measures` and `group_contrasts` (within
participants), `tobit` (censored thresholds), and the primary analysis `hierarchy`, compared with the published one in
`two_analyses` (intervals near the cap: `coverage`) -> `declared_result`, `study_warnings`. Quality and controls:
`detection`, `catch_trials`, `bias`, `criterion_drift`, `repeated_trials`, `cues`, `equalized_delivery`. Called
separately: `ellipsoid` (acceleration ellipsoids of the figures), `power` (simulation of whole studies). Used by
`study.workflows.results`, `analysis.figures` and `analysis.reports`. Begin at `study_analysis.py`.
"""
