"""A force that is always there: weight, a pulling cable."""

import numpy as np

from equalizer.effects.effect import AxisForce, Effect, Parameter, Values
from equalizer.effects.simulation.mechanism_kernel import compiled_law
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import Beside, linear_part, moving
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray


@compiled_law
def _law(of: FloatArray, memory: FloatArray, at: FloatArray) -> float:
    return float(of[0])


def _pack(model: MechanicalModel, axis: int, values: Values) -> FloatArray:
    return np.array([values["force"]])


def _starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    of = moving(evidence, axis)
    # The spring may have been re-tuned, but not so as to pull at the place of rest.
    force = float(Beside(of.force, linear_part(of, constant=False)).fit(np.ones_like(of.force)).strengths[0])
    mean = float(np.mean(of.force))
    return tuple({"force": guess} for guess in (mean, force) if guess != 0)


EFFECT = Effect(
    name="constant_force",
    equation="F = force",
    source="weight, or the pull of a cable",
    signature="the missing force is the same everywhere and at every level; the place of rest is another",
    parameters=(Parameter("force", -1e6, 1e6, none=0.0, scale="signed"),),
    acts=AxisForce(_law, _pack),
    starts=_starts,
)
