"""Whether direction was the cue: other differences between the two directions as delivered, and their use in answers.

`delivered_cues` (intensity, spectrum and coupling of each trial) -> `cue_sensitivity` (d' that a cue alone would give)
and `answers_on_delivery` (logistic regression of the answers on a cue) -> `cue_findings` (both together, tests
corrected by Holm, warnings as sentences). Used by `study_analysis` and `analysis.reports.cue_section`. Begin at
`cue_findings.py`.
"""
