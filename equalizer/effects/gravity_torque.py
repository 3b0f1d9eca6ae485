"""The weight of a body off the axis that it turns about: a pendulum's torque."""

import numpy as np

from equalizer.effects.effect import AxisForce, Effect, Parameter, Values
from equalizer.effects.simulation.instant import F_END, X_FREE, X_PER_N, X
from equalizer.effects.simulation.mechanism_kernel import compiled_law
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import beside_linear, moving
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray

LEAST_TRAVEL_RAD = 0.5
"""Over less, it is a spring."""


@compiled_law
def _law(of: FloatArray, memory: FloatArray, at: FloatArray) -> float:
    """The mean of the torque at the step's start and end, where the angle at its end depends on it."""
    start, torque = np.sin(at[X] + of[1]), 0.0
    for _ in range(4):
        torque = -0.5 * of[0] * (start + np.sin(at[X_FREE] + at[X_PER_N] * torque + of[1]))
    at[F_END] = -of[0] * np.sin(at[X_FREE] + at[X_PER_N] * torque + of[1])
    return float(torque)


def _pack(model: MechanicalModel, axis: int, values: Values) -> FloatArray:
    return np.array([values["torque"], values["angle"]])


def _starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    of = moving(evidence, axis)
    if not evidence.model.rotational or not np.ptp(of.position) > LEAST_TRAVEL_RAD:
        return ()
    sine, cosine = beside_linear(of).fit(-np.sin(of.position), -np.cos(of.position)).strengths.tolist()
    torque = float(np.hypot(sine, cosine))
    return ({"torque": torque, "angle": float(np.arctan2(cosine, sine))},) if torque > 0 else ()


EFFECT = Effect(
    name="gravity_torque",
    equation="F = -torque sin(x + angle)",
    source="a pendulum; Spong, Hutchinson and Vidyasagar, Robot Modeling and Control, chapter 6",
    signature="the missing torque goes with the sine of the angle and repeats with each turn, at every level",
    parameters=(
        Parameter("torque", 1e-9, 1e6, none=0.0),
        Parameter("angle", -1e3, 1e3, none=None, scale="linear", step=0.02),
    ),
    acts=AxisForce(_law, _pack),
    starts=_starts,
)
