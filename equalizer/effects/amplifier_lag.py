"""Amplifier lag: a closed current loop that follows its command as a first-order low pass.

    T dF/dt + F = u        T in s, command u and actuator force F in N

The solution for a command that is held over a step is exact: `simulation.command_path.lag_mean` and `lag_at_end`.
"""

import numpy as np

from equalizer.effects.effect import Effect, OnCommand, Parameter, Values
from equalizer.effects.simulation.command_path import lag_at_end, lag_mean
from equalizer.effects.starts.command_starts import likeliest_value
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.response_starts import starts_for_lateness
from equalizer.signals.signal import FloatArray

SHORTEST_S, LONGEST_S = 2e-5, 0.05
"""Range of time constants (s) that are searched for a starting value."""


def _lag_force(commands: FloatArray, step_s: float, values: Values) -> FloatArray:
    return lag_mean(commands, step_s, values["time_constant"])


def _lag_force_at_end(commands: FloatArray, step_s: float, values: Values) -> FloatArray:
    return lag_at_end(commands, step_s, values["time_constant"])


def _starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Time constants from the delay of the response and from a grid search on the missing force."""
    fitting = likeliest_value(evidence, axis, lag_mean, list(np.geomspace(SHORTEST_S, LONGEST_S, 16)), False)
    return tuple({"time_constant": late} for late in starts_for_lateness(evidence, axis, fitting, LONGEST_S))


EFFECT = Effect(
    name="amplifier_lag",
    equation="time_constant dF/dt + F = u",
    source="Leonhard, Control of Electrical Drives, Springer 2001: the closed current loop as one pole",
    signature="the missing force follows the command's rate of change at every level alike, and position and response "
    "are late by the same",
    parameters=(Parameter("time_constant", 1e-6, 1.0, none=0.0),),
    action=OnCommand(_lag_force, fine=True, at_end=_lag_force_at_end),
    starts=_starts,
    sites=("all", "one"),
)
