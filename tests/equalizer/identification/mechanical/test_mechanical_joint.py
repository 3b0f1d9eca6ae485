"""A device whose drives move its sensors through cables: masses and cables are found from force and acceleration."""

from types import SimpleNamespace

import numpy as np
import pytest

from equalizer.identification.mechanical.mechanical_fit import fit_mechanical_model
from equalizer.identification.mechanical.mechanical_fit_result import MechanicalFitError, MechanicalFitSettings
from equalizer.identification.mechanical.mechanical_structure import insert_joint
from equalizer.identification.mechanical.rigid_body import fit_rigid_body, remove_friction_damping
from equalizer.plant.linear_simulation import discretise_model
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal

RATE_HZ, PERIOD, LOOKS = 1000.0, 2000, 3
ONE = np.eye(1)


def one_piece(mass=0.28, damping=9.0) -> MechanicalModel:
    return MechanicalModel("piece", "acceleration", mass * ONE, damping * ONE, 0 * ONE, ONE, ONE)


def played(model, commands) -> np.ndarray:
    steps, state, out = discretise_model(model, 1 / RATE_HZ), np.zeros(2 * model.coordinates), []
    before = np.zeros(1)
    for u in commands:
        out.append(steps.response @ state + steps.response_by_command @ before)
        state, before = steps.transition @ state + steps.state_by_command @ u, u
    return np.array(out)


def test_all_the_mass_moves_as_one_below_the_joint_and_damping_stays_at_the_drive():
    joined = insert_joint(one_piece(), 1, 2e4 * ONE, 1e-4)
    assert joined.mass.sum() == pytest.approx(0.28)
    np.testing.assert_allclose(joined.stiffness.sum(axis=0), 0.0)
    assert joined.damping.sum() == pytest.approx(9.0)
    np.testing.assert_array_equal(joined.output, [[0.0, 1.0]])


@pytest.mark.parametrize(("motor", "handle"), [(0.14, 0.14), pytest.param(0.11, 0.17, marks=pytest.mark.slow)])
def test_mass_damping_and_resonance_are_recovered_across_a_joint(motor, handle):
    """However the mass is shared: half and half is taken."""
    k = 2e4
    device = MechanicalModel(
        "device", "acceleration", np.diag([motor, handle]), np.array([[11.0, -2.0], [-2.0, 2.0]]),
        k * np.array([[1.0, -1.0], [-1.0, 1.0]]), np.array([[1.0], [0.0]]), np.array([[0.0, 1.0]]),
    )  # fmt: skip
    rng = np.random.default_rng(3)
    lines = np.zeros(PERIOD // 2 + 1, complex)
    lines[6:120] = np.exp(2j * np.pi * rng.random(114))
    wave = np.tile(np.fft.irfft(lines, PERIOD), LOOKS)[:, None]
    wave /= np.abs(wave).max()
    response = played(device, wave) + 0.02 * rng.standard_normal(wave.shape)
    recording = Recording(
        "device",
        Signal(wave, RATE_HZ, "force", "N", ("fx",)),
        Signal(response, RATE_HZ, "acceleration", "m/s^2", ("ax",)),
        segments=(Segment(0, len(wave), "multisine", 1.0, PERIOD, "fit"),),
    )
    fit = fit_mechanical_model(
        [recording], MechanicalFitSettings((3.0, 60.0), joint=True, most_modes=2, fit_delay=False)
    )
    model = fit.model
    assert fit.error < 0.03
    assert model.mass.sum() == pytest.approx(motor + handle, rel=0.03)
    assert model.damping.sum() == pytest.approx(9.0, rel=0.1)
    assert model.tolerance is not None and model.tolerance.mass_kg is not None
    if motor == handle:
        assert model.coordinates == 2
        resonance = np.sqrt(model.stiffness[0, 0] * (1 / model.mass[0, 0] + 1 / model.mass[1, 1])) / 2 / np.pi
        assert resonance == pytest.approx(np.sqrt(k * (1 / motor + 1 / handle)) / 2 / np.pi, rel=0.08)


def test_what_is_frictions_is_taken_off_where_the_drive_is():
    joined = insert_joint(one_piece(), 1, 2e4 * ONE, 1e-4)
    freed = remove_friction_damping(joined, np.array([4.0]))
    np.testing.assert_allclose(joined.damping - freed.damping, [[4.0, 0.0], [0.0, 0.0]], atol=1e-9)


@pytest.mark.parametrize("segments", [(), (Segment(0, 100, "multisine"),)])
def test_a_rigid_body_is_refused_where_no_amplitude_is_stated(segments):
    wave = np.random.default_rng(1).standard_normal((100, 1))
    still = Recording(
        "device", Signal(wave, RATE_HZ, "force", "N", ("fx",)), Signal(wave, RATE_HZ, "acceleration", "m/s^2", ("ax",)),
        segments=segments,
    )  # fmt: skip
    with pytest.raises(MechanicalFitError, match="no segment of a recording states an amplitude above 0"):
        fit_rigid_body(SimpleNamespace(band_hz=(3.0, 60.0)), still, still, MechanicalFitSettings((3.0, 60.0)))


def test_a_model_of_currents_states_that_its_mass_is_not_in_kg():
    wave = np.random.default_rng(1).standard_normal((2000, 1))
    recording = Recording(
        "motor",
        Signal(wave, RATE_HZ, "current", "A", ("ix",)),
        Signal(played(one_piece(), wave), RATE_HZ, "acceleration", "m/s^2", ("ax",)),
    )
    fit = fit_mechanical_model(recording, MechanicalFitSettings(most_modes=0, fit_delay=False))
    assert fit.model.mass[0, 0] == pytest.approx(0.28, rel=0.02)
    assert fit.model.system.express("kg") == "A s^2/m"
    assert len(repr(fit).splitlines()) < 15
