"""Analysis of a study's trials: thresholds, their statistics, and the quality of delivery.

`runs` (staircases recomputed from the answers) -> `thresholds` -> `threshold_table` -> `anova` and `comparisons` (as
published), `repeated_measures` with Friedman's test (which fit the design), and the primary analysis `hierarchy`,
compared with the published one in `two_analyses`. Further results: `ellipsoid`, `detection`, `catch_trials`, `cues` and
`study_warnings`. `study_analysis` calls all of them: begin at `study_analysis.py`. `power` simulates whole studies.
"""
