"""What the trials of a study say: thresholds, their statistics, and how well directions were delivered.

`runs` (staircases recomputed from the answers, never trusted) -> `thresholds` -> `threshold_table` -> `anova` and
`comparisons` (as published), `repeated_measures` and `friedman` (as the design asks for), beside them the primary
analysis (`hierarchy`, compared in `two_analyses`) with `ellipsoid`,
`detection`, `catch_trials`, `practice` and `study_warnings` beside them -> `study_analysis`. Begin at
`study_analysis.py`.
"""
