"""Candidate laws of a force balance: terms that are linear in their weights, on grids of their nonlinear parameters.

`law` defines a term and states the balance. `motion_laws` makes the candidates along a measured motion, with those of
`friction_laws` and `condition_laws` among them; `command_laws` makes those of the actuator, between command and force;
`free_laws` those outside the catalogue of effects. Begin at `law.py`, then `motion_laws.py`.
"""
