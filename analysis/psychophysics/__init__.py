"""Analysis of a study's trials: thresholds, their statistics, and the quality of delivery.

`runs` (staircases recomputed from the answers, never trusted) -> `thresholds` -> `threshold_table` -> `anova` and
`comparisons` (as published), `repeated_measures` with Friedman's test (as the design asks for), beside them the primary
analysis (`hierarchy`, compared in `two_analyses`) with `ellipsoid`, `detection`, `catch_trials` and `study_warnings` ->
`study_analysis`. Begin at `study_analysis.py`.
"""
