"""Growth rate of a model's free motion: whether it is unstable."""

import numpy as np

from analysis.diagnosis.settings import MOST_GROWTH
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.lockin import ComplexArray


def growth_rate(model: MechanicalModel) -> float:
    """Of its fastest growing or slowest dying motion, 1/s; negative where all motion dies out."""
    return float(motions(model).real.max())


def motions(model: MechanicalModel) -> ComplexArray:
    """(2 coordinates,): rates of its free motions, 1/s; those of swings come in pairs."""
    n = model.coordinates
    motion = np.block(
        [
            [np.zeros((n, n)), np.eye(n)],
            [-np.linalg.solve(model.mass, model.stiffness), -np.linalg.solve(model.mass, model.damping)],
        ]
    )
    return np.asarray(np.linalg.eigvals(motion), dtype=np.complex128)


def runs_away(model: MechanicalModel, longest_s: float) -> bool:
    """Whether undisturbed motion grows noticeably within the longest recording."""
    return growth_rate(model) * longest_s > MOST_GROWTH
