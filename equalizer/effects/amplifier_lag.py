"""A current loop that follows its command with one pole."""

import numpy as np

from equalizer.effects.effect import Effect, OnCommand, Parameter, Values
from equalizer.effects.simulation.command_path import lagged, lagged_at_end
from equalizer.effects.starts.command_starts import likeliest_value
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.response_starts import starts_for_lateness
from equalizer.signals.signal import FloatArray

SHORTEST_S, LONGEST_S = 2e-5, 0.05


def _late(commands: FloatArray, step_s: float, of: Values) -> FloatArray:
    return lagged(commands, step_s, of["time_constant"])


def _late_at_end(commands: FloatArray, step_s: float, of: Values) -> FloatArray:
    return lagged_at_end(commands, step_s, of["time_constant"])


def _starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    fitting = likeliest_value(evidence, axis, lagged, list(np.geomspace(SHORTEST_S, LONGEST_S, 16)), False)
    return tuple({"time_constant": late} for late in starts_for_lateness(evidence, axis, fitting, LONGEST_S))


EFFECT = Effect(
    name="amplifier_lag",
    equation="time_constant dF/dt + F = u",
    source="Leonhard, Control of Electrical Drives, Springer 2001: the closed current loop as one pole",
    signature="the missing force follows the command's rate of change at every level alike, and position and response "
    "are late by the same",
    parameters=(Parameter("time_constant", 1e-6, 1.0, none=0.0),),
    acts=OnCommand(_late, fine=True, at_end=_late_at_end),
    starts=_starts,
    sites=("all", "one"),
)
