"""Mechanical models are recovered from recordings of plants that are known, and refused where there is nothing."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from equalizer.identification.mechanical.mechanical_fit import fit_mechanical_model
from equalizer.identification.mechanical.mechanical_fit_result import MechanicalFitError, MechanicalFitSettings
from equalizer.identification.mechanical.mechanical_response import (
    compute_free_response,
    compute_pole_form,
    compute_sampled_response,
)
from equalizer.plant.mechanical_model import ActuatorLimits, MechanicalModel, SensorLimits
from equalizer.signals.recording import Hold, Recording, Segment
from equalizer.signals.signal import Signal

RATE_HZ = 500.0
ORDER = {"position": 0, "velocity": 1, "acceleration": 2}
UNIT = {"position": "m", "velocity": "m/s", "acceleration": "m/s^2"}


def stepped(M, D, K, B, C, quantity, commands):
    """Exact between held commands, sample by sample: shares no code with the fit."""
    n, m = len(M), B.shape[1]
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]])
    G = np.concatenate([np.zeros((n, m)), np.linalg.solve(M, B)])
    held = expm(np.block([[A, G], [np.zeros((m, 2 * n + m))]]) / RATE_HZ)
    x, before, out = np.zeros(2 * n), np.zeros(m), []
    for u in commands:
        seen = {0: x[:n], 1: x[n:], 2: (A @ x + G @ before)[n:]}[ORDER[quantity]]
        out.append(C @ seen)
        x, before = held[: 2 * n, : 2 * n] @ x + held[: 2 * n, 2 * n :] @ u, u
    return np.array(out)


def multisine(rng, periods, length=1000, low=2, high=300):
    """(periods length,), peak about 1; lines k rate / length."""
    spectrum = np.zeros(length // 2 + 1, complex)
    spectrum[low:high] = np.exp(2j * np.pi * rng.random(high - low))
    one = np.fft.irfft(spectrum, length)
    return np.tile(one / np.abs(one).max(), periods)


def recording(commands, response, quantity="acceleration", segments=(), **other):
    m, p = commands.shape[1], response.shape[1]
    return Recording(
        "plant",
        Signal(commands, RATE_HZ, "force", "N", tuple("xyz"[:m])),
        Signal(response, RATE_HZ, quantity, UNIT[quantity], tuple(f"r{i}" for i in range(p))),
        segments=tuple(segments),
        **other,
    )


def single(seed=1, quantity="acceleration", noise=0.01, kind="noise", K=90.0, samples=5000):
    rng = np.random.default_rng(seed)
    commands = rng.standard_normal((samples, 1))
    one = np.eye(1)
    response = stepped(0.3 * one, 2.0 * one, K * one, one, one, quantity, commands)
    response += noise * response.std() * rng.standard_normal(response.shape)
    parts = (Segment(0, 3000, kind, 1.0, 0, "fit"), Segment(3000, samples, kind, 1.0, 0, "test"))
    return recording(commands, response, quantity, parts)


@pytest.fixture(scope="module")
def two_axes():
    """Two driven axes with an oscillator of 0.05 kg at 30 Hz along (0.8, 0.6)."""
    along = np.array([0.8, 0.6])
    mass, k = 0.05, 0.05 * (2 * np.pi * 30) ** 2
    c = 2 * 0.03 * np.sqrt(k * mass)
    M = np.diag([0.3, 0.25, mass])
    M[0, 1] = M[1, 0] = 0.02
    D, K = np.zeros((3, 3)), np.zeros((3, 3))
    D[:2, :2], K[:2, :2] = np.diag([3.0, 4.0]), np.diag([120.0, 200.0])
    grip = np.append(along, -1.0)
    D, K = D + c * np.outer(grip, grip), K + k * np.outer(grip, grip)
    B, C = np.eye(3)[:, :2], np.eye(3)[:2]
    rng = np.random.default_rng(4)
    blocks, segments = [], []
    for number in range(6):
        commands = np.zeros((3000, 2))
        commands[:, number % 2] = multisine(rng, 3)
        role = "test" if number >= 4 else "fit"
        segments.append(Segment(3000 * number, 3000 * (number + 1), "multisine", 1.0, 1000, role))
        blocks.append(commands)
    commands = np.concatenate(blocks)
    response = stepped(M, D, K, B, C, "acceleration", commands)
    response += 0.01 * rng.standard_normal(response.shape)
    return fit_mechanical_model([recording(commands, response, segments=segments)]), M, D, K


@pytest.mark.parametrize("quantity", ["position", "velocity", "acceleration"])
def test_mass_damping_and_stiffness_are_recovered_from_any_quantity(quantity):
    model = fit_mechanical_model([single(quantity=quantity)]).model
    assert model.coordinates == 1
    found = [model.mass[0, 0], model.damping[0, 0], model.stiffness[0, 0]]
    np.testing.assert_allclose(found, [0.3, 2.0, 90.0], rtol=0.02)


@pytest.fixture(scope="module")
def one_axis():
    return fit_mechanical_model([single()])


def test_the_error_on_what_was_kept_for_a_test_is_the_noise(one_axis):
    assert one_axis.held_out == pytest.approx(0.01, rel=0.15)
    assert one_axis.errors[0].held_out == one_axis.held_out


def test_a_plant_without_a_spring_is_said_to_drift():
    fit = fit_mechanical_model([single(quantity="velocity", K=0.0)])
    assert fit.model.stiffness[0, 0] == 0.0
    assert any("the device drifts under a constant command" in remark for remark in fit.remarks)
    np.testing.assert_allclose([fit.model.mass[0, 0], fit.model.damping[0, 0]], [0.3, 2.0], rtol=0.02)


@pytest.mark.slow
def test_an_oscillator_on_two_coupled_axes_is_found_and_no_other(two_axes):
    fit, M, _, _ = two_axes
    model = fit.model
    assert model.coordinates == 3
    np.testing.assert_allclose(model.mass[:2, :2], M[:2, :2], atol=0.004)
    assert model.mass[2, 2] == pytest.approx(0.05, rel=0.05)
    assert np.sqrt(model.stiffness[2, 2] / model.mass[2, 2]) / (2 * np.pi) == pytest.approx(30, rel=0.005)
    along = model.stiffness[2, :2] / model.stiffness[2, 2]
    np.testing.assert_allclose(np.abs(along), [0.8, 0.6], atol=0.02)
    np.testing.assert_array_equal(model.input, np.eye(3)[:, :2])


@pytest.mark.slow
def test_the_tolerances_cover_the_truth(two_axes):
    fit, M, _, _ = two_axes
    assert fit.model.tolerance is not None and fit.model.tolerance.mass_kg is not None
    assert np.abs(np.diag(fit.model.mass - M)[:2]).max() < 3 * fit.model.tolerance.mass_kg
    assert fit.model.tolerance.mass_kg >= 0.01 * 0.25


def test_what_was_tried_ends_with_the_reason_for_stopping(two_axes):
    fit = two_axes[0]
    assert fit.candidates[0].description == "the driven axes alone"
    assert [each for each in fit.candidates if each.accepted][-1].error < 1.1
    assert "noise" in fit.reason


@pytest.mark.slow
def test_another_seed_gives_the_same_plant(one_axis):
    masses = [one_axis.model.mass[0, 0], fit_mechanical_model([single(2)]).model.mass[0, 0]]
    assert masses[0] != masses[1]
    np.testing.assert_allclose(masses, 0.3, rtol=0.02)


def test_the_same_recording_gives_the_same_numbers_again(one_axis):
    np.testing.assert_array_equal(fit_mechanical_model([single()]).model.mass, one_axis.model.mass)


def test_a_sensor_that_counts_the_other_way_is_reported():
    source = single()
    turned = replace(source, response=replace(source.response, samples=-source.response.samples))
    fit = fit_mechanical_model([turned])
    assert fit.model.output[0, 0] == -1.0
    assert fit.model.mass[0, 0] == pytest.approx(0.3, rel=0.02)
    assert any("opposite to the command" in remark for remark in fit.remarks)


@pytest.mark.slow
def test_a_delay_is_found_where_there_is_one():
    source = single(noise=0.003)
    late = np.concatenate([np.zeros((4, 1)), source.response.samples[:-4]])
    fit = fit_mechanical_model([replace(source, response=replace(source.response, samples=late))])
    assert fit.model.actuator.delay_s * RATE_HZ == pytest.approx(4, abs=0.1)


def test_sampled_responses_agree_with_stepping(two_axes):
    _, M, D, K = two_axes
    rng = np.random.default_rng(8)
    for quantity in ORDER:
        model = MechanicalModel("oracle", quantity, M, D, K, np.eye(3)[:, :2], np.eye(3)[:2])
        commands = np.outer(multisine(rng, 8), [1.0, 0.0])
        settled = stepped(M, D, K, model.input, model.output, quantity, commands)[-1000:]
        lines = np.arange(2, 300)
        measured = np.fft.rfft(settled, axis=0)[lines] / np.fft.rfft(commands[-1000:, 0])[lines, None]
        found = compute_sampled_response(model, lines * RATE_HZ / 1000, RATE_HZ, Hold.ZERO_ORDER)[:, :, 0]
        np.testing.assert_allclose(found, measured, atol=2e-3 * np.abs(measured).max())


def test_the_sensor_pole_is_the_recursion_of_the_format():
    model = MechanicalModel("one", "acceleration", *(np.eye(1),) * 3, np.eye(1), np.eye(1))
    lagging = replace(model, sensor=SensorLimits(bandwidth_hz=40.0))
    lines = np.array([3.0, 60.0])
    step = 1 - np.exp(-2 * np.pi * 40 / RATE_HZ)
    ratio = compute_sampled_response(lagging, lines, RATE_HZ, Hold.ZERO_ORDER) / compute_sampled_response(
        model, lines, RATE_HZ, Hold.ZERO_ORDER
    )
    expected = step / (1 - (1 - step) * np.exp(-2j * np.pi * lines / RATE_HZ))
    np.testing.assert_allclose(ratio[:, 0, 0], expected)


def test_a_whole_sample_of_delay_is_one_turn_of_z():
    model = MechanicalModel("one", "position", *(np.eye(1),) * 3, np.eye(1), np.eye(1))
    lines = np.array([1.0, 70.0])
    late = replace(model, actuator=ActuatorLimits(delay_s=1 / RATE_HZ))
    for hold in Hold:
        delayed, prompt = (compute_sampled_response(each, lines, RATE_HZ, hold) for each in (late, model))
        np.testing.assert_allclose((delayed / prompt)[:, 0, 0], np.exp(-2j * np.pi * lines / RATE_HZ))


def test_fits_have_no_pole_that_grows(two_axes):
    assert compute_pole_form(two_axes[0].model).poles.real.max() <= 1e-6


def test_modes_that_the_sensor_sees_otherwise_are_fitted_by_shapes_of_their_own():
    rng = np.random.default_rng(5)
    commands = np.concatenate([np.tile(multisine(rng, 3), 1) for _ in range(4)])[:, None]
    M, k = np.diag([0.15, 0.15]), 0.075 * (2 * np.pi * 40) ** 2
    K = k * np.array([[1, -1], [-1, 1]])
    D = 12 * M + 3e-4 * K
    B, C = np.array([[1.0], [0.0]]), np.array([[0.0, 1.0]])  # pushed here, seen beyond the spring
    response = stepped(M, D, K, B, C, "acceleration", commands)
    response += 0.003 * response.std() * rng.standard_normal(response.shape)
    parts = [Segment(3000 * i, 3000 * (i + 1), "multisine", 1.0, 1000, "test" if i == 3 else "fit") for i in range(4)]
    source = recording(commands, response, segments=parts)
    fit = fit_mechanical_model([source], MechanicalFitSettings(noncollocated_sensors=True))
    assert fit.held_out is not None and fit.held_out < 0.06
    np.testing.assert_allclose(fit.model.input[:, 0], np.eye(fit.model.coordinates)[0])


@pytest.mark.parametrize("seed", [2, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 3))])
def test_pure_noise_is_refused(seed):
    rng = np.random.default_rng(seed)
    source = recording(rng.standard_normal((4000, 1)), rng.standard_normal((4000, 1)))
    with pytest.raises(MechanicalFitError, match="do not predict r0"):
        fit_mechanical_model([source])


def test_what_cannot_be_fitted_is_refused_by_name():
    source = single()
    commands, response = source.command.samples, source.response.samples
    refusals = {
        "too short": recording(commands[:40], response[:40]),
        "command x is constant": recording(np.ones_like(commands), response),
        "response r0 contains only missing values": recording(commands, np.full_like(response, np.nan)),
        "2 commands and 1 responses": recording(np.tile(commands, 2), response),
    }
    for words, bad in refusals.items():
        with pytest.raises(MechanicalFitError, match=words):
            fit_mechanical_model([bad])
    with pytest.raises(MechanicalFitError, match="no recording"):
        fit_mechanical_model([])
    with pytest.raises(MechanicalFitError, match="has the hold linear"):
        fit_mechanical_model([source, replace(source, hold=Hold.LINEAR)])
    for quantity, unit in (("force", ("N",)), (("position", "angle"), ("m", "rad"))):
        other = replace(source, response=Signal(np.tile(response, len(unit)), RATE_HZ, quantity, unit, tuple(unit)))
        with pytest.raises(MechanicalFitError, match="keep the responses of one quantity"):
            fit_mechanical_model([other])


def test_a_part_with_missing_samples_is_left_out():
    source = single()
    samples = source.response.samples.copy()
    samples[1000:1010] = np.nan
    fit = fit_mechanical_model([replace(source, response=replace(source.response, samples=samples))])
    assert fit.model.mass[0, 0] == pytest.approx(0.3, rel=0.02)


@pytest.mark.parametrize(
    ("numbers", "words"),
    [({"band_hz": (5.0, 2.0)}, "band_hz"), ({"most_modes": -1}, "most_modes"), ({"floor": 0.0}, "floor")],
)
def test_settings_that_cannot_be_are_refused(numbers, words):
    with pytest.raises(ValueError, match=words):
        MechanicalFitSettings(**numbers)


def test_a_motor_axis_with_friction_is_within_a_fifth_of_its_known_mass(shared):
    """EMPS: about 95 kg are published; dry friction is no part of a linear model."""
    folder = shared / "recordings" / "emps"
    found = []
    for name, role in (("estimation", "fit"), ("validation", "test")):
        data = np.load(folder / f"{name}.npz")
        force, position = data["u_V"] * data["gain_N_per_V"], data["y_m"]
        found.append(
            Recording(
                "emps",
                Signal(force.reshape(-1, 1), 1000.0, "force", "N", ("u",)),
                Signal(position.reshape(-1, 1), 1000.0, "position", "m", ("y",)),
                segments=(Segment(0, position.size, "noise", 1.0, 0, role),),
            )
        )
    fit = fit_mechanical_model(found, MechanicalFitSettings(most_modes=0))
    assert fit.model.mass[0, 0] == pytest.approx(95, rel=0.2)
    assert fit.held_out is not None and fit.held_out < 0.2


def test_a_model_that_runs_away_within_a_sample_answers_with_numbers():
    model = MechanicalModel("thrown", "position", 1e-9 * np.eye(1), np.eye(1), np.eye(1), np.eye(1), np.eye(1))
    thrown = replace(model, damping=-np.eye(1))
    assert np.isfinite(compute_free_response(thrown, np.array([1.0, 70.0]), RATE_HZ)).all()
