"""Starting values of an effect's parameters, estimated from a model's residuals.

`evidence` (motion, commands, missing force) -> `starting_values` (laws of motion), `command_starts` (actuators),
`response_starts` (sensors); `attached_oscillator` and `lattice` serve single families. Begin at `evidence.py`.
"""
