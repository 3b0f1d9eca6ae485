"""Growth rate of a model's free motion: whether it is unstable."""

import numpy as np

from analysis.diagnosis.settings import MOST_GROWTH
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import ComplexArray


def growth_rate(model: MechanicalModel) -> float:
    """Largest real part of the model's eigenvalues, 1/s; negative where all free motion decays."""
    return float(free_motion_rates(model).real.max())


def free_motion_rates(model: MechanicalModel) -> ComplexArray:
    """(2 coordinates,): eigenvalues of the model, 1/s; complex ones come in conjugate pairs."""
    n = model.coordinates
    motion = np.block(
        [
            [np.zeros((n, n)), np.eye(n)],
            [-np.linalg.solve(model.mass, model.stiffness), -np.linalg.solve(model.mass, model.damping)],
        ]
    )
    return np.asarray(np.linalg.eigvals(motion), dtype=np.complex128)


def is_unstable_within(model: MechanicalModel, longest_s: float) -> bool:
    """Whether undisturbed motion grows noticeably within the longest recording."""
    return growth_rate(model) * longest_s > MOST_GROWTH
