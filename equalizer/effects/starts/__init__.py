"""Starting values of an effect's numbers, drawn from what a model fails to explain.

`evidence` (motion, commands, missing force) -> `starting_values` (laws of motion), `command_starts` (actuators),
`response_starts` (sensors); `attached_oscillator` and `lattice` serve single families. Begin at `evidence.py`.
"""
