"""Errors of a free simulation, relative to what the channels show."""

import numpy as np
import pytest

from equalizer.identification.mechanical.mechanical_free_simulation import compute_simulation_errors
from equalizer.identification.mechanical.mechanical_lines import compute_segment_lines
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Segment
from tests.equalizer.identification.mechanical.test_mechanical_fit import recording, stepped


@pytest.mark.parametrize("reading", [0.0, 0.37])
def test_a_channel_that_a_converter_shows_at_rest_does_not_outweigh_the_others(reading):
    """The other axis is driven; a coupling of the model moves this one by 2 % of that."""
    mass, damping, stiffness, identity = np.diag([0.3, 0.25]), np.diag([2.0, 3.0]), np.diag([90.0, 60.0]), np.eye(2)
    command = np.random.default_rng(1).standard_normal((2000, 2)) * (1.0, 0.0)
    response = stepped(mass, damping, stiffness, identity, identity, "acceleration", command)
    response[:, 1] = reading
    segment = Segment(0, 2000, "noise", 1.0)
    lines = compute_segment_lines(recording(command, response, segments=(segment,)), segment)
    coupled = MechanicalModel(
        "two", "acceleration", mass, damping, stiffness, identity, np.array([[1.0, 0.0], [0.02, 1.0]])
    )
    errors, _ = compute_simulation_errors(coupled, [lines], (1.0, 200.0))
    assert errors[0] < 0.01
    # Relative to the mean power of the two channels, half of the driven one's.
    assert errors[1] == pytest.approx(0.02 * np.sqrt(2), rel=0.1)
    assert errors[2] == pytest.approx(np.sqrt(np.mean(errors[:2] ** 2)))
