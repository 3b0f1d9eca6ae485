"""Nonlinear actuator characteristic: the gain changes with the magnitude of the command, as of propellers or coils.

    F = u (1 - square + square |u| / reference)        u, F, reference in N; square without unit

square = 1 is the pure square law of a propeller or of a coil without bias current; square < 0 is a gain that falls as
the command grows. An entry of `equalizer.effects.catalogue`.
"""

import numpy as np

from equalizer.effects.effect import Effect, OnCommand, Parameter, Values
from equalizer.effects.starts.command_starts import fit_square_law
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray


def apply_square_law(commands: FloatArray, square: float, reference: float) -> FloatArray:
    """Compute the force (n,) in N of commands (n,) in N. square: quadratic share; reference: magnitude at which force
    and command are equal."""
    return np.asarray(commands * (1 - square + square * np.abs(commands) / reference))


def _compute_force(commands: FloatArray, step_s: float, values: Values) -> FloatArray:
    """Compute the force (n,): `OnCommand.change` of this effect."""
    return apply_square_law(commands, values["square"], values["reference"])


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Find the square law by regression of the missing force; empty where `fit_square_law` finds none."""
    square_law = fit_square_law(evidence, axis)
    return () if square_law is None else ({"square": square_law[0], "reference": square_law[1]},)


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
    action=OnCommand(_compute_force),
    starts=_find_starting_values,
    sites=("one", "all"),
)
