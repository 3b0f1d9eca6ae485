"""Force saturation: the force of an actuator is limited symmetrically.

    F = max(-limit, min(u, limit))        command u, force F and limit in N

An entry of `equalizer.effects.catalogue`.
"""

import math

import numpy as np

from equalizer.effects.effect import Effect, OnCommand, Parameter, Values
from equalizer.effects.starts.command_starts import find_command_parameter, make_force_level_grid
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray


def _clip_force(commands: FloatArray, step_s: float, values: Values) -> FloatArray:
    """Limit the commands (n,): `OnCommand.change` of this effect."""
    return np.clip(commands, -values["limit"], values["limit"])


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Find the likeliest limit by grid search and golden section, from 3 % to just below the strongest command; empty
    where no limit explains enough of the missing force."""
    limit = find_command_parameter(
        evidence, axis, lambda u, step_s, value: np.clip(u, -value, value), make_force_level_grid(evidence, axis), True
    )
    return () if limit is None else ({"limit": limit},)


EFFECT = Effect(
    name="force_saturation",
    equation="F = max(-limit, min(u, limit))",
    source="Isermann, Mechatronic Systems, Springer 2005, ch. 10: limits of actuators",
    signature="force is missing only where more than the limit is commanded, and all that is above it; odd harmonics "
    "at the top level alone",
    parameters=(Parameter("limit", 1e-4, 1e4, none=math.inf),),
    action=OnCommand(_clip_force),
    starts=_find_starting_values,
    sites=("one", "all"),
)
