"""Starting values of an effect's parameters, estimated from a model's residuals without a simulation of the effect.

`evidence` (motion, commands, missing force) -> `starting_values` (regression on laws of motion), `command_starts`
(actuators), `response_starts` (sensors). `attached_oscillator` serves resonances, `lattice` quantization. Used by the
module of each effect in `equalizer.effects`, and by `analysis.diagnosis`. Begin at `evidence.py`.
"""
