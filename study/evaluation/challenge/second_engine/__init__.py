"""Concealed cases from a second physics engine, MuJoCo: other integrator, other friction, other contacts.

`second_engine` is the only door, and says whether MuJoCo is installed; behind it `mujoco_case` (a case, its parameters
drawn as for the other bench) on `mujoco_bench` (the bench). Begin at `mujoco_case.py`.
"""
