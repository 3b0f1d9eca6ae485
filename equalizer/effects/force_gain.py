"""Force gain: an actuator whose force is a constant multiple of its command, as with a wrong force constant.

    F = gain u        command u and force F in N (a rotation: N m)

An entry of `equalizer.effects.catalogue`.
"""

import numpy as np

from equalizer.effects.effect import ALL_SITES, Effect, OnCommand, Parameter, Values
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray

_MIN_DEVIATION = 1e-4
"""Deviation of the gain from 1 at or below which it is no starting value. Chosen."""


def _scale_force(commands: FloatArray, step_s: float, values: Values) -> FloatArray:
    """Multiply the commands (n,), N, by the gain."""
    return np.asarray(values["gain"] * commands)


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Estimate gain = 1 + sum(u f) / sum(u²) by least squares of the missing force f over the command u, and over u one
    sample earlier; the one farther from 1. Empty where it is not positive or within `_MIN_DEVIATION` of 1."""
    columns, is_used = slice(None) if axis == ALL_SITES else slice(axis, axis + 1), evidence.used > 0
    commanded, missing_force = evidence.command[is_used, columns], evidence.axis_force[is_used, columns]
    # The estimated force may lag by a sample.
    gain_deviations = [
        float(
            np.sum(np.roll(commanded, delay_samples, axis=0) * missing_force)
            / max(np.sum(commanded**2), np.finfo(float).tiny)
        )
        for delay_samples in (0, 1)
    ]
    gain = 1 + max(gain_deviations, key=abs)
    return ({"gain": gain},) if gain > 0 and abs(gain - 1) > _MIN_DEVIATION else ()


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
