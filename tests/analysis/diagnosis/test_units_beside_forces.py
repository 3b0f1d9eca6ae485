"""Parameters carry the units of the recording: where forces are compared, and where a fitted model has modes."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
from analysis.diagnosis.first_model.fit_without_model import fit_first_linear_model
from analysis.diagnosis.first_model.model_structures import fit_modal_structure
from analysis.diagnosis.search_by_simulation import make_search_context
from equalizer.effects.simulation.simulator import simulate_response
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Hold, Recording, Segment
from equalizer.signals.signal import Signal
from equalizer.signals.unit_system import UnitSystem


def test_units_are_those_of_the_recording_as_it_was_given(diagnosed):
    recording = diagnosed.recorded(1)
    forces = replace(recording, response=replace(recording.response, quantity="force", unit="N"))
    measure = SimpleNamespace(records=(SimpleNamespace(recording=forces),), shorten=lambda: None)
    look = SimpleNamespace(model=diagnosed.device(1), chosen=SimpleNamespace(measure=measure))
    context = make_search_context(recording, look, DiagnosisSettings(), map)
    assert context.tuning.model.units is None
    wrongly = make_search_context(forces, look, DiagnosisSettings(), map)
    assert wrongly.tuning.model.units is not None


@pytest.fixture(scope="module")
def far_sensor():
    """A current that drives a body, and a sensor on a second body, so that the fitted output matrix is not 0 or 1."""
    rate_hz, samples = 500.0, 6000
    device = MechanicalModel(
        "two bodies", "position", np.diag([0.2, 0.1]), np.array([[3.0, -0.5], [-0.5, 0.5]]),
        np.array([[2600.0, -2000.0], [-2000.0, 2000.0]]), np.array([[1.0], [0.0]]), np.array([[0.0, 1.0]]),
    )  # fmt: skip
    rng = np.random.default_rng(1)
    command = rng.choice([-1.0, 1.0], (samples, 1))
    response = simulate_response(device, command, rate_hz, (), Hold.ZERO_ORDER).response
    response = response + 1e-3 * response.std() * rng.standard_normal(response.shape)
    return Recording(
        "rig", Signal(command, rate_hz, "current", "A", ("i",)), Signal(response, rate_hz, "position", "m", ("x",)),
        segments=(Segment(0, samples, "binary", 1.0, 0, ""),),
    )  # fmt: skip


def test_a_fitted_model_with_modes_has_the_units_of_its_recording(far_sensor):
    model, _ = fit_first_linear_model([far_sensor], lambda share: None)
    assert not np.isin(np.abs(model.output), (0.0, 1.0)).all()
    assert model.system == UnitSystem("A", "m")
    structure = fit_modal_structure([far_sensor], "two-mode", lambda share: None)
    assert structure.model.system == UnitSystem("A", "m")
    assert {estimate.unit for estimate in structure.parameters} == {"A s^2/m", "A s/m", "A/m", "Hz"}
