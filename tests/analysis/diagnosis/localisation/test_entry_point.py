from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.localisation.entry_point import Entry, compare_sensors, rank_entries
from analysis.diagnosis.localisation.mismatch_cells import Prediction
from analysis.diagnosis.localisation.residual_spectra import ResidualSpectra, compute_residual_spectra
from analysis.diagnosis.noise.noise_floor import estimate_noise_floor

FREQUENCY_HZ = np.arange(2.0, 120.0, 0.5)
NOISE = np.array([1e-3, 1e-3, 1e-7, 1e-7]) ** 2


def response_directions():
    """(lines, 4, 2): accelerations and positions of two axes that hear each other through a spring."""
    omega = 2 * np.pi * FREQUENCY_HZ
    mass, damping = np.diag([0.2, 0.3]), np.diag([2.0, 3.0])
    stiffness = np.array([[4e3, -1.5e3], [-1.5e3, 9e3]])
    dynamic = stiffness + 1j * omega[:, None, None] * damping - omega[:, None, None] ** 2 * mass
    compliance = np.linalg.inv(dynamic)
    return np.concatenate([-(omega**2)[:, None, None] * compliance, compliance], axis=1)


def make_entries():
    g, unit = response_directions(), np.eye(4, dtype=complex)[None]
    return [
        Entry("force x", "mechanism", "x", g[:, :, :1]),
        Entry("force y", "mechanism", "y", g[:, :, 1:]),
        Entry("drive x", "actuator", "x", 2.0 * g[:, :, :1]),
        Entry("hand", "hand", None, g),
        Entry("sensor ax", "sensor", "x", unit[:, :, :1]),
        Entry("sensor ay", "sensor", "y", unit[:, :, 1:2]),
        Entry("position x", "sensor", "x", unit[:, :, 2:3], is_position_error=True),
    ]


def simulate_spectra(direction, seed=1, size=0.05, experiments=3):
    """direction: (lines, 4, k)"""
    random = np.random.default_rng(seed)

    def drawn(*shape):
        return (random.standard_normal(shape) + 1j * random.standard_normal(shape)) / np.sqrt(2)

    forces = size * drawn(experiments, len(FREQUENCY_HZ), direction.shape[2])
    residual = np.einsum("lck,elk->elc", direction, forces)
    noise = np.broadcast_to(NOISE, residual.shape)
    return ResidualSpectra(FREQUENCY_HZ, residual + np.sqrt(noise) * drawn(*residual.shape), noise, 2)


@pytest.mark.parametrize("number", range(7))
@pytest.mark.parametrize("seed", range(3))
def test_the_entry_that_made_the_residual_wins(number, seed):
    true = make_entries()[number]
    direction = np.broadcast_to(true.directions, (len(FREQUENCY_HZ), 4, true.directions.shape[2]))
    best = rank_entries(simulate_spectra(direction, seed), make_entries()).ranking[0]
    assert true.name in (best.name, *best.equivalents)
    assert best.p_value == 1.0
    assert best.is_position_error == (best.name == "position x")


def test_entries_with_one_direction_are_said_to_be_alike():
    ranking = rank_entries(simulate_spectra(response_directions()[:, :, :1]), make_entries()).ranking
    assert {ranking[0].name, *ranking[0].equivalents} == {"force x", "drive x"}
    assert ranking[1].p_value == 1.0
    others = [each for each in ranking if each.name in ("force y", "sensor ax", "sensor ay")]
    assert all(other.p_value < 1e-3 for other in others)
    assert others[0].score > ranking[0].score + 0.5


def test_noise_alone_has_no_entry():
    found = rank_entries(simulate_spectra(response_directions(), size=0.0), make_entries())
    assert found.lines < 0.05 * 3 * len(FREQUENCY_HZ)
    silent = ResidualSpectra(FREQUENCY_HZ, np.zeros((1, len(FREQUENCY_HZ), 4), complex), np.ones((1, 236, 4)), 2)
    assert rank_entries(silent, make_entries()).ranking == ()


def test_position_clean_but_acceleration_off_means_the_sensor():
    sensor = simulate_spectra(
        np.broadcast_to(np.eye(4, dtype=complex)[None, :, :1], (len(FREQUENCY_HZ), 4, 1)), size=0.5
    )
    moved = simulate_spectra(response_directions()[:, :, :1])
    assert compare_sensors(sensor, 2).verdict == "response sensor"
    assert compare_sensors(moved, 2).verdict == "motion"
    assert compare_sensors(simulate_spectra(response_directions(), size=1e-6), 2).verdict == "undecided"
    without = ResidualSpectra(FREQUENCY_HZ, moved.residual[:, :, :2], moved.noise[:, :, :2], 2)
    assert compare_sensors(without, 2) is None


def test_without_position_the_rule_is_silent_and_directions_still_speak():
    spectra = simulate_spectra(response_directions()[:, :, 1:])
    bare = ResidualSpectra(FREQUENCY_HZ, spectra.residual[:, :, :2], spectra.noise[:, :, :2], 2)
    forces = [Entry(e.name, e.place, e.axis, e.directions[:, :2]) for e in make_entries()[:2]]
    found = rank_entries(bare, forces)
    assert found.sensor_comparison is None
    assert found.ranking[0].name == "force y"


def test_directions_of_another_shape_are_refused():
    wrong = Entry("force x", "mechanism", "x", np.ones((7, 4, 1), complex))
    with pytest.raises(ValueError, match="the directions of 'force x' must have shape"):
        rank_entries(simulate_spectra(response_directions()), [wrong])


def test_a_recordings_residual_is_taken_over_the_driven_band(device):
    bench = device(noise=0.02)
    recording = bench.recorded()
    command, segments = bench.command(1)
    truth = Prediction(*bench.linear(command, segments))
    floor = estimate_noise_floor(recording)
    spectra = compute_residual_spectra(recording, truth, floor, model_error=0.0)
    assert spectra.residual.shape == (6, len(spectra.frequency_hz), 4)
    assert (spectra.frequency_hz[[0, -1]] == [3, 197]).all()
    assert np.mean(np.abs(spectra.residual) ** 2 / spectra.noise) == pytest.approx(1, abs=0.05)
    doubted = compute_residual_spectra(recording, truth, floor)
    assert (doubted.noise > spectra.noise).all()
    used = np.zeros(len(recording), dtype=bool)
    assert compute_residual_spectra(recording, truth, floor, used) is None
    used[: segments[0].stop] = True
    assert len(compute_residual_spectra(recording, truth, floor, used).residual) == 1


def test_what_is_not_periodic_is_taken_in_windows(device):
    bench = device(noise=0.02)
    recording = bench.recorded()
    command, segments = bench.command(1)
    swept = replace(recording, segments=tuple(replace(s, period=0, kind="sweep") for s in segments))
    spectra = compute_residual_spectra(
        swept, Prediction(*bench.linear(command, segments)), estimate_noise_floor(recording), model_error=0.0
    )
    assert len(spectra.residual) == 12
    assert np.mean(np.abs(spectra.residual) ** 2 / spectra.noise) == pytest.approx(1, abs=0.05)
