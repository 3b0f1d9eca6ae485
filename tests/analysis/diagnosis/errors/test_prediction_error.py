"""Errors by channel of a model that is not fitted."""

import numpy as np
import pytest

from analysis.diagnosis.errors.prediction_error import compute_prediction_error
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal

RATE_HZ = 200.0


@pytest.mark.parametrize(
    ("imposed", "measure", "channels"), [(True, "predicted force", 0), (False, "free simulation", 1)]
)
def test_errors_of_forces_do_not_pass_for_errors_of_responses(imposed, measure, channels):
    slide = MechanicalModel(
        "slide", "position", np.eye(1) * 2.0, np.eye(1) * 5.0, np.eye(1) * 300.0, np.eye(1), np.eye(1)
    )
    seconds, omega = np.arange(4000) / RATE_HZ, 2 * np.pi * 0.7
    x = 0.05 * np.sin(omega * seconds) + np.random.default_rng(3).normal(0, 1e-6, 4000)
    force = (300.0 - 2.0 * omega**2) * x + 5.0 * 0.05 * omega * np.cos(omega * seconds)
    found = compute_prediction_error(
        Recording(
            "slide", Signal(force[:, None], RATE_HZ, "force", "N", ("force",)),
            Signal(x[:, None], RATE_HZ, "position", "m", ("x",)), meta={"imposed": imposed},
        ),
        slide, "all",
    )  # fmt: skip
    assert (found.measure_name, len(found.channels)) == (measure, channels)
