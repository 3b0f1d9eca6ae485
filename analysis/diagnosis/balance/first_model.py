"""The linear model that a force balance gives: one body per command."""

from collections.abc import Sequence

import numpy as np

from analysis.diagnosis.balance.weigh import Balance
from analysis.diagnosis.settings import MASSLESS_SHARE
from equalizer.plant.mechanical_model import MechanicalModel, Tolerance
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

OPEN = 0.1
"""Of the numbers found, one standard deviation at least."""


def first_model(balances: Sequence[Balance], recording: Recording, name: str) -> MechanicalModel | None:
    """None where not each command drives one measured motion. Raises MechanicalModelError."""
    regressions = [balance.searched.regression for balance in balances]
    motion = regressions[0].motions[0]
    count = len(motion.channels)
    if count != len(balances) or count != len(recording.response.channels):
        return None
    plain, full = (
        [_numbers(balance, laws) for balance, laws in zip(balances, kinds, strict=True)]
        for kinds in ([()] * count, [tuple(one.place for one in balance.named) for balance in balances])
    )
    matrices = [np.array([row[part] for row in plain]) for part in range(3)]
    beside = [np.array([row[part] for row in full]) for part in range(3)]
    mass, damping, stiffness = ((one + one.T) / 2 for one in matrices)
    floor = MASSLESS_SHARE * _rms(np.vstack([one.force for one in regressions[0].motions]))
    moved = [np.gradient(one.velocity, 1 / one.rate_hz, axis=0) for one in regressions[0].motions]
    floor = floor / np.maximum(_rms(np.vstack(moved)), 1e-300)
    mass = mass + np.diag(np.maximum(floor - np.diagonal(mass), 0.0))
    spread = [
        float(np.max(np.abs(given - full)) / 2 + OPEN * np.abs(given).max())
        for given, full in zip((mass, damping, stiffness), beside, strict=True)
    ]
    turning = any(unit.startswith(("rad", "N m")) for unit in (*recording.response.units, *recording.command.units))
    return MechanicalModel(
        name,
        recording.response.quantities[0],
        mass,
        damping,
        stiffness,
        np.eye(count),
        np.eye(count),
        tolerance=Tolerance(max(spread[0], 1e-12), max(spread[1], 1e-12), max(spread[2], 1e-12), None),
        rotational=turning,
    )


def _numbers(balance: Balance, laws: Sequence[int]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rows of mass, damping and stiffness."""
    regression = balance.searched.regression
    weights = regression.weights(regression.chosen(laws))[: regression.base]
    count = len(regression.motions[0].channels)
    stiffness = weights[2 * count : 3 * count] if regression.base > 3 * count else np.zeros(count)
    return weights[:count], weights[count : 2 * count], stiffness


def _rms(samples: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(np.mean((samples - samples.mean(axis=0)) ** 2, axis=0)))
