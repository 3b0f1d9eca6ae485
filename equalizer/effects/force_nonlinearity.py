"""An actuator whose gain changes with the size of its command: propellers, coils without bias, drives in pulses."""

import numpy as np

from equalizer.effects.effect import Effect, OnCommand, Parameter, Values
from equalizer.effects.starts.command_starts import of_square
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray


def bent(commands: FloatArray, square: float, reference: float) -> FloatArray:
    """(n,), as commanded where |commands| is the reference."""
    return np.asarray(commands * (1 - square + square * np.abs(commands) / reference))


def _bent(commands: FloatArray, step_s: float, of: Values) -> FloatArray:
    return bent(commands, of["square"], of["reference"])


def _starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    found = of_square(evidence, axis)
    return () if found is None else ({"square": found[0], "reference": found[1]},)


EFFECT = Effect(
    name="force_nonlinearity",
    equation="F = u (1 - square + square |u| / reference)",
    source="Isermann, Mechatronic Systems, Springer 2005, ch. 10: static characteristics of actuators; square = 1, "
    "propellers (momentum theory) and coils without bias; below zero, a gain that falls towards a limit",
    signature="the missing force is an odd, smooth curve over the command, not over the motion, and its odd harmonics "
    "rise with the level",
    parameters=(
        Parameter("square", -1.0, 1.0, none=0.0, scale="signed"),
        Parameter("reference", 1e-6, 1e6, none=None),
    ),
    acts=OnCommand(_bent),
    starts=_starts,
    sites=("one", "all"),
)
