"""Force gain: an actuator whose force is a constant multiple of its command, as with a wrong force constant."""

import numpy as np

from equalizer.effects.effect import ALL_SITES, Effect, OnCommand, Parameter, Values
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray

_LEAST_DEVIATION = 1e-4
"""Least deviation of a gain from 1 that is a starting value. Heuristic."""


def _scale_force(commands: FloatArray, step_s: float, values: Values) -> FloatArray:
    """Commands (N) times the gain."""
    return np.asarray(values["gain"] * commands)


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """gain = 1 + sum(u f) / sum(u²): least squares of the missing force f over the command u. Empty where the gain is
    not positive or as good as 1."""
    columns, used = slice(None) if axis == ALL_SITES else slice(axis, axis + 1), evidence.used > 0
    commanded, missing_force = evidence.command[used, columns], evidence.axis_force[used, columns]
    # Also over the command of the sample before, because the estimated force may lag by a sample.
    gain_deviations = [
        float(
            np.sum(np.roll(commanded, shift, axis=0) * missing_force) / max(np.sum(commanded**2), np.finfo(float).tiny)
        )
        for shift in (0, 1)
    ]
    gain = 1 + max(gain_deviations, key=abs)
    return ({"gain": gain},) if gain > 0 and abs(gain - 1) > _LEAST_DEVIATION else ()


EFFECT = Effect(
    name="force_gain",
    equation="F = gain u",
    source="Hayward and Astley 1996, Robotics Research: calibrated output of haptic interfaces",
    signature="the missing force is proportional to the command at every frequency and level, in position and response "
    "alike",
    parameters=(Parameter("gain", 0.05, 20.0, none=1.0),),
    action=OnCommand(_scale_force),
    starts=_find_starting_values,
    sites=("one", "all"),
)
