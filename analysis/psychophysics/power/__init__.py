"""Power analysis: studies simulated without device, session or file, and the result of each analysis.

`staircase_kernel` and `psi_kernel` (a run) -> `simulated_study` (many people; `felt_delivery`: as a device delivers) ->
`power_curve` (power, type-1 error, coverage by sample size), `compare_rules` (rules of levels). Begin at
`simulated_study.py`.
"""
