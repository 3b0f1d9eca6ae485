"""Statistical power by simulation: whole studies in memory, without device, session or file, and their analyses.

`staircase_kernel` or `psi_kernel` (a run of a simulated participant, compiled) -> `simulated_study` (many people;
`felt_delivery`: the stimuli as a device delivers them) -> `power_curve` (power, type-1 error and coverage by sample
size). `compare_rules` compares rules of levels by the error of their thresholds. Used by `study.workflows.planning`
(`hapteq power`). Begin at `simulated_study.py`.
"""
