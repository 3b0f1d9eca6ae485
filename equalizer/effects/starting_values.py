"""What several effects' starting values have in common."""

from collections.abc import Callable

import numpy as np

from equalizer.effects.evidence import Evidence
from equalizer.signals.signal import FloatArray


def moving_force(evidence: Evidence, axis: int, shape: Callable[[FloatArray], FloatArray]) -> float:
    """How much of -shape(v) the missing force at an axis holds, N."""
    used = evidence.used > 0
    basis = shape(evidence.axis_velocity[used, axis])
    return -float(basis @ evidence.axis_force[used, axis] / max(float(basis @ basis), np.finfo(float).tiny))
