"""What sensors do, against closed forms; and starting values from their own data, with noise."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.simulation.simulator import Measurement, simulate_mechanism
from equalizer.effects.starts.evidence import Evidence
from equalizer.plant.mechanical_model import SensorLimits

ALL = (0, 1, 2)
TURN = {"about_x": 3.0, "about_y": -5.0, "about_z": 8.0}
STRONG = [
    ("sensor_lag", {"bandwidth": 80.0}, ALL, 0.03),
    ("sensor_lag", {"bandwidth": 700.0}, (1,), 0.03),
    ("sensor_clipping", {"limit": 6.0}, (0,), 0.03),
    ("sensor_clipping", {"limit": 6.0}, ALL, 0.03),
    ("sensor_misalignment", TURN, ALL, 0.02),
    ("cross_axis_sensitivity", {"from_next": 0.03, "from_after_next": -0.02}, (2,), 0.05),
    ("sensor_gain", {"gain": 0.9}, (2,), 0.01),
    ("sensor_gain", {"gain": 1.07}, ALL, 0.01),
    ("sensor_nonlinearity", {"cubic": -4e-4}, (0,), 0.05),
    ("sensor_offset", {"offset": -0.2}, (1,), 0.02),
    ("sensor_drift", {"total": 0.4, "bend": 0.2}, (1,), 0.02),
    ("sensor_drift", {"total": -2.0, "bend": 0.0, "start": -0.5}, (0,), 0.02),
    ("mains_hum", {"amplitude": 0.06, "frequency": 49.987, "phase": 0.4}, (1,), 0.05),
]


@pytest.fixture(scope="module")
def command(bench) -> np.ndarray:
    return bench.commands(3)


def read(name: str, values: dict[str, float], response: np.ndarray, *channels: int) -> np.ndarray:
    return EFFECTS[name].action.change(response, 1000.0, channels, values)


@pytest.mark.parametrize(("name", "values", "channels", "within"), STRONG, ids=lambda part: str(part))
def test_a_sensors_effect_is_found_near_its_strength(bench, command, name, values, channels, within):
    model = bench.three_axes()
    seen = bench.measured(model, bench.placed(name, values, *channels), command, seed=5)
    evidence = bench.evidence(model, seen)
    start = EFFECTS[name].starts(evidence, channels[0])[0]
    main = next(iter(values))
    assert start[main] == pytest.approx(values[main], rel=within)


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("name", ["sensor_lag", "sensor_clipping", "sensor_offset", "sensor_drift", "mains_hum"])
def test_a_device_without_it_suggests_no_strength(bench, command, name, seed):
    model = bench.three_axes()
    evidence = bench.evidence(model, bench.measured(model, (), command, seed))
    assert [EFFECTS[name].starts(evidence, channel) for channel in range(3)] == [(), (), ()]


@pytest.mark.parametrize("known_hz", [0.0, 300.0])
def test_a_sensors_lag_is_the_models_own_low_pass_with_another_bandwidth(bench, command, known_hz):
    model = replace(bench.three_axes(), sensor=SensorLimits(bandwidth_hz=known_hz))
    slower = replace(model, sensor=SensorLimits(bandwidth_hz=90.0))
    lag = bench.placed("sensor_lag", {"bandwidth": 90.0}, 0, 2)
    short = command[:4000]
    found = simulate_mechanism(model, short, 1000.0, lag).response
    np.testing.assert_array_equal(found[:, [0, 2]], simulate_mechanism(slower, short, 1000.0).response[:, [0, 2]])
    np.testing.assert_array_equal(found[:, 1], simulate_mechanism(model, short, 1000.0).response[:, 1])


def test_a_turned_sensor_keeps_lengths_and_turns_by_the_right_hand():
    response = np.random.default_rng(1).standard_normal((50, 3))
    turned = read("sensor_misalignment", TURN, response, *ALL)
    np.testing.assert_allclose(np.linalg.norm(turned, axis=1), np.linalg.norm(response, axis=1))
    quarter = read("sensor_misalignment", {"about_z": 90.0}, np.array([[1.0, 0.0, 0.0]]), *ALL)
    np.testing.assert_allclose(quarter, [[0.0, 1.0, 0.0]], atol=1e-12)


def test_a_misalignment_is_reported_by_its_total_angle():
    report = EFFECTS["sensor_misalignment"].report(TURN)
    assert report["degrees"] == pytest.approx(np.sqrt(98))
    assert report.items() >= TURN.items()
    # Beyond half a turn, it is the same rotation the other way round.
    beyond = EFFECTS["sensor_misalignment"].report({"about_x": 120.0, "about_y": -120.0, "about_z": 120.0})
    assert beyond["degrees"] == pytest.approx(360.0 - 120.0 * np.sqrt(3))


def test_of_which_only_the_angle_is_known_it_turns_about_the_last_axis():
    response = np.eye(3)
    by_angle = read("sensor_misalignment", {"degrees": 30.0}, response, *ALL)
    np.testing.assert_allclose(by_angle, read("sensor_misalignment", {"about_z": 30.0}, response, *ALL))


def test_two_channels_turn_in_their_plane_and_one_cannot():
    turned = read("sensor_misalignment", {"about_z": 90.0}, np.array([[1.0, 0.0]]), 0, 1)
    np.testing.assert_allclose(turned, [[0.0, 1.0]], atol=1e-12)
    with pytest.raises(ValueError, match="turns two or three channels together, not 1"):
        read("sensor_misalignment", TURN, np.zeros((5, 1)), 0)


def test_a_channel_reads_shares_of_those_that_follow_it_round_about():
    shares = {"from_next": 0.1, "from_after_next": 0.01}
    mixed = read("cross_axis_sensitivity", shares, np.array([[1.0, 2.0, 3.0]]), 2)
    np.testing.assert_allclose(mixed, [[1.0, 2.0, 3.0 + 0.1 * 1.0 + 0.01 * 2.0]])


def test_a_drift_ends_at_its_total_and_bends_in_the_middle():
    drifted = read("sensor_drift", {"total": 2.0, "bend": 0.25}, np.zeros((101, 2)), 1)
    assert not drifted[:, 0].any()
    np.testing.assert_allclose(drifted[[0, 50, 100], 1], [0.0, 1.5, 2.0])
    shifted = read("sensor_drift", {"total": 2.0, "start": -0.5}, np.zeros((101, 1)), 0)
    np.testing.assert_allclose(shifted[[0, 100], 0], [-1.0, 1.0])


def test_a_cubic_bends_both_ways_alike():
    bent = read("sensor_nonlinearity", {"cubic": -0.1}, np.array([[-2.0], [2.0]]), 0)
    np.testing.assert_allclose(bent, [[-1.2], [1.2]])


def test_a_tone_is_found_outside_the_mains_as_well(bench, command):
    model = bench.three_axes()
    tone = {"amplitude": 0.1, "frequency": 133.31, "phase": 1.0}
    seen = bench.measured(model, bench.placed("mains_hum", tone, 0), command, seed=2)
    found = EFFECTS["mains_hum"].starts(bench.evidence(model, seen), 0)
    assert any(start["frequency"] == pytest.approx(133.31, abs=1e-3) for start in found)


@pytest.mark.slow
def test_a_tone_that_is_commanded_throughout_is_no_hum(bench, command):
    model = bench.three_axes()
    steady = 0.4 * np.sin(2 * np.pi * 50.0 * np.arange(len(command)) / 1000.0)
    tone = {"amplitude": 0.1, "frequency": 50.0, "phase": 1.0}
    for driven, hums in ((command, True), (np.tile(steady[:, None], (1, command.shape[1])), False)):
        seen = bench.measured(model, bench.placed("mains_hum", tone, 0), driven, seed=2)
        assert bool(EFFECTS["mains_hum"].starts(bench.evidence(model, seen), 0)) is hums


def test_a_commanded_tone_is_no_hum_where_samples_are_missing(bench):
    """Blocks with gaps counted the command of the gaps, so that its tone did not look steady."""
    tone = np.sin(2 * np.pi * 50.0 * np.arange(12_000) / 1000.0)[:, None]
    still = np.zeros_like(tone)
    used = np.ones(12_000)
    used[1000:].reshape(11, 1000)[::2, 100:] = 0.0
    evidence = Evidence(
        bench.one_axis(), 1000.0, tone, still, still, still, tone, 0.9 * tone, np.full(1, bench.NOISE_MPS2), used
    )
    assert EFFECTS["mains_hum"].starts(evidence, 0) == ()


def test_what_friction_adds_to_a_driven_line_is_no_tone(bench, command):
    """It comes and goes with the excitation, and with another phase."""
    model = bench.three_axes()
    seen = bench.measured(model, bench.placed("coulomb_friction", {"level": 0.1}, 0), command, seed=2)
    evidence = bench.evidence(model, seen)
    assert [EFFECTS["mains_hum"].starts(evidence, channel) for channel in ALL] == [(), (), ()]


def test_an_offset_alone_is_no_drift(bench, command):
    model = bench.three_axes()
    seen = bench.measured(model, bench.placed("sensor_offset", {"offset": 0.3}, 1), command, seed=2)
    assert EFFECTS["sensor_drift"].starts(bench.evidence(model, seen), 1) == ()


def test_a_drift_is_one_over_the_whole_recording_also_where_its_beginning_alone_is_played(bench, command):
    model, drift = (
        bench.three_axes(),
        bench.placed("sensor_drift", {"total": 1.0, "bend": 0.4, "start": 0.1}, 0),
    )
    whole = simulate_mechanism(model, command, 1000.0, drift).response
    n = len(command) // 3
    seen = Measurement(whole[:n], np.ones(3), full_length=len(command))
    assert np.allclose(
        simulate_mechanism(model, command[:n], 1000.0, drift, measurement=seen).response, whole[:n], atol=1e-9
    )
