"""Procedure of a study, computed from its protocol: order of runs, random draws, levels, and end of a run.

`schedule` (order of runs, balanced by `make_williams_rows`; random draws of the trials) -> `run_rules` (staircase rule
of a run) -> `staircase` (next level; by the Psi method: `psi`) -> `practice` (criterion of a practice run).
`study_plan`: which orders a balanced sample still needs. Used by `study.session.state` and `analysis.psychophysics`.
Begin at `staircase.py`, function `step`.
"""
