"""The search for modes: it finds those of a plant whose actuator has a known low pass, and ends with its time."""

import numpy as np
import pytest

from equalizer.identification.mechanical.mechanical_fit import fit_mechanical_model
from equalizer.identification.mechanical.mechanical_fit_result import MechanicalFitSettings
from equalizer.identification.mechanical.mechanical_misfit import LineGroup
from equalizer.identification.mechanical.mechanical_order import OUT_OF_TIME
from equalizer.identification.mechanical.mechanical_response import compute_sampled_response
from equalizer.identification.mechanical.mechanical_structure import Structure
from equalizer.identification.mechanical.modal_search import ModalSearch
from equalizer.plant.mechanical_model import ActuatorLimits, MechanicalModel
from equalizer.signals.recording import Hold
from tests.equalizer.identification.mechanical.test_mechanical_fit import multisine, recording, stepped

RATE_HZ = 500.0


@pytest.mark.parametrize("quantity", ["position", "velocity", "acceleration"])
def test_a_known_low_pass_of_the_actuator_needs_no_mode_of_its_own(quantity):
    actuator = ActuatorLimits(bandwidth_hz=60.0)
    mass, damping, stiffness = np.eye(1) * 0.3, np.eye(1) * 2.0, np.eye(1) * 0.3 * (2 * np.pi * 20.0) ** 2
    plant = MechanicalModel("plant", quantity, mass, damping, stiffness, np.eye(1), np.eye(1), actuator=actuator)
    lines_hz = np.arange(1.0, 200.0)
    response = compute_sampled_response(plant, lines_hz, RATE_HZ, Hold.ZERO_ORDER)[:, :, 0]
    weight = 1 / np.abs(response)
    group = LineGroup(
        lines_hz, weight[:, :, None, None] + 0j, (weight * response)[:, :, None], weight, np.arange(199) % 4 == 2,
        np.ones(199), False, RATE_HZ, Hold.ZERO_ORDER,
    )  # fmt: skip
    structure = Structure(1, 1, quantity, 0.3, 125.0, (1.0,), step_s=1 / RATE_HZ, actuator=actuator)
    found = ModalSearch([group], structure, (1.0, 199.0), fit_delay=False).add_mode(None)
    assert np.exp(found.logs[0]) / (2 * np.pi) == pytest.approx(20.0, rel=1e-3)
    assert found.shapes[0, 0, 0] == pytest.approx(1 / 0.3, rel=1e-3)
    assert found.held_out_squares / found.held_out_count < 1e-6


@pytest.mark.parametrize("noncollocated", [None, True])
def test_where_no_time_is_left_the_best_structure_so_far_is_the_result(noncollocated):
    stiffness, damping = np.array([[2080.0, -2000.0], [-2000.0, 2000.0]]), np.array([[2.3, -0.3], [-0.3, 0.3]])
    along = np.array([[1.0], [0.0]])
    command = multisine(np.random.default_rng(4), 4)[:, None]
    response = stepped(np.diag([0.3, 0.05]), damping, stiffness, along, along.T, "acceleration", command)
    source = recording(command, response + 1e-3 * response.std() * np.random.default_rng(5).standard_normal((4000, 1)))
    calls = []

    def is_time_left():
        calls.append(1)
        return len(calls) <= 1

    full = fit_mechanical_model([source], MechanicalFitSettings(noncollocated_sensors=noncollocated))
    cut = fit_mechanical_model(
        [source], MechanicalFitSettings(noncollocated_sensors=noncollocated, time_left=is_time_left)
    )
    assert (full.model.coordinates, cut.model.coordinates) == (2, 1)
    assert cut.reason == OUT_OF_TIME != full.reason
    assert 0 < cut.model.mass[0, 0] < 1 and full.error < cut.error
