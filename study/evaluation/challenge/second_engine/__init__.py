"""Concealed cases from a second physics engine, MuJoCo, with another integrator, other friction and other contacts, so
that the blind test does not depend on hapteq's own simulation alone.

`mujoco_access` (the only entry; tests whether MuJoCo is installed) -> `mujoco_case` (draws a case with the same
parameters as for the other bench) -> `mujoco_bench` (the model in MuJoCo). Used by `draw_bank` and
`study.evaluation.bank.seal_cases`. Begin at `mujoco_case.py`.
"""
