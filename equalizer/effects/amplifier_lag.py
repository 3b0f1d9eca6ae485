"""Amplifier lag: a closed current loop that follows its command as a first-order low pass.

    T dF/dt + F = u        T in s, command u and actuator force F in N (a rotation: N m)

The solution for a command that is held over a step is exact (`simulation.command_path`). The limits of T, 1e-6 and 1 s,
only keep a fit positive and finite.
"""

import numpy as np

from equalizer.effects.effect import Effect, OnCommand, Parameter, Values
from equalizer.effects.simulation.command_path import compute_lagged_end, compute_lagged_mean
from equalizer.effects.starts.command_starts import find_command_parameter
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.response_starts import list_lag_starts
from equalizer.signals.signal import FloatArray

SHORTEST_TIME_CONSTANT_S, LONGEST_TIME_CONSTANT_S = 2e-5, 0.05
"""Range of time constants (s) that are searched for a starting value. Chosen around those of current loops."""


def _compute_mean_force(commands: FloatArray, step_s: float, values: Values) -> FloatArray:
    """Compute the mean force (n,) over each step, in the unit of the commands (n,): `OnCommand.change` of this
    effect."""
    return compute_lagged_mean(commands, step_s, values["time_constant"])


def _compute_end_force(commands: FloatArray, step_s: float, values: Values) -> FloatArray:
    """Compute the force (n,) at the end of each step, in the unit of the commands (n,): `OnCommand.at_end`."""
    return compute_lagged_end(commands, step_s, values["time_constant"])


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Find time constants to start a fit from, the largest first: the time shift of the response, and the value that
    fits the missing force best (grid search of 16 values, refined), at least a fifth of a sample each. Empty where the
    response is early by more than that (`list_lag_starts`)."""
    best_fitting_s = find_command_parameter(
        evidence,
        axis,
        compute_lagged_mean,
        list(np.geomspace(SHORTEST_TIME_CONSTANT_S, LONGEST_TIME_CONSTANT_S, 16)),
        False,
    )
    return tuple(
        {"time_constant": time_constant_s}
        for time_constant_s in list_lag_starts(evidence, axis, best_fitting_s, LONGEST_TIME_CONSTANT_S)
    )


EFFECT = Effect(
    name="amplifier_lag",
    equation="time_constant dF/dt + F = u",
    source="Leonhard, Control of Electrical Drives, Springer 2001: the closed current loop as one pole",
    signature="the missing force follows the command's rate of change at every level alike, and position and response "
    "are late by the same",
    parameters=(Parameter("time_constant", 1e-6, 1.0, none=0.0),),
    action=OnCommand(_compute_mean_force, fine=True, at_end=_compute_end_force),
    starts=_find_starting_values,
    sites=("all", "one"),
)
