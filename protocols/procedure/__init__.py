"""What follows from a protocol, trial by trial.

`schedule` (who gets what, when; `williams` orders) -> `run_rules` (which rule a run follows) -> `staircase` (the next
level) -> `practice` (passed or not). `study_plan`: which orders a sample still needs. Begin at `staircase.py`,
function `step`.
"""
