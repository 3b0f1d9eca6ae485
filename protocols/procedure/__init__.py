"""What follows from a protocol, trial by trial.

`schedule` (order of runs, draws; `make_williams_rows` balances) -> `run_rules` (rule of a run) -> `staircase` (next
level) -> `practice` (passed or not). `study_plan`: which orders a sample still needs. Begin at `staircase.py`, function
`step`.
"""
