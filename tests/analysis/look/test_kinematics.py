import numpy as np
import pytest

from analysis.look.channels import list_channels
from analysis.look.cross_spectra import estimate_cross_spectra
from analysis.look.gain_and_lag import GainAndLag
from analysis.look.kinematics import KinematicPair, check_kinematics, check_lags, find_kinematic_pairs
from equalizer.signals.recording import Recording

RATE_HZ = 1000.0


@pytest.fixture(scope="module")
def motion(make_noise, simulate_motion):
    force = make_noise()
    return (force, *simulate_motion(force))


def find_pairs(found: Recording):
    return find_kinematic_pairs(list_channels(found), [(0, len(found))], RATE_HZ)


def delay(samples, lag):
    spectrum = np.fft.rfft(samples)
    return np.fft.irfft(spectrum * np.exp(-2j * np.pi * np.fft.rfftfreq(len(samples)) * lag), len(samples))


@pytest.mark.parametrize("factor", [1.0, 0.001, -1.0, 57.29578, 1.1, -9.80665])
@pytest.mark.parametrize("lag", [0.0, 3.4, -1.5])
def test_factor_sign_and_lag_of_an_acceleration_are_found(make_recording, motion, factor, lag):
    force, place, _, acceleration = motion
    noise = 0.02 * acceleration.std() * np.random.default_rng(2).standard_normal(len(force))
    (pair,) = find_pairs(make_recording(force, factor * (delay(acceleration, lag) + noise), position=place))
    assert (pair.place, pair.derivative, pair.order) == ("position 'x1'", "response 'a1'", 2)
    assert pair.agreement.gain == pytest.approx(factor, rel=0.03)
    assert pair.agreement.lag_samples == pytest.approx(lag, abs=0.1)


@pytest.mark.parametrize(("factor", "level"), [(1.0, "fine"), (1.1, "notice"), (1000.0, "wrong"), (-1.0, "wrong")])
def test_a_speed_is_compared_with_the_derivative_of_its_position(make_recording, motion, factor, level):
    force, place, speed, _ = motion
    (pair,) = find_pairs(make_recording(force, (factor * speed, "velocity", "m/s"), position=place))
    (check,) = check_kinematics([pair], RATE_HZ)
    assert (pair.order, check.level) == (1, level)
    assert pair.agreement.gain == pytest.approx(factor, rel=0.01)


@pytest.mark.parametrize(
    ("factor", "words"), [(1000.0, "mm taken for m"), (1 / 9.80665, "g for m/s^2"), (1.3, "both.")]
)
def test_a_factor_of_two_units_is_named(make_recording, motion, factor, words):
    force, place, _, acceleration = motion
    (check,) = check_kinematics(find_pairs(make_recording(force, factor * acceleration, position=place)), RATE_HZ)
    assert words in check.advice


def test_a_late_speed_is_reported_in_milliseconds(make_recording, motion):
    force, place, speed, _ = motion
    late = (delay(speed, 2.0), "velocity", "m/s")
    (check,) = check_kinematics(find_pairs(make_recording(force, late, position=place)), RATE_HZ)
    assert check.level == "notice"
    assert "2 ms (2 samples) later" in check.finding


@pytest.mark.slow
def test_each_of_three_axes_finds_its_own_position(make_recording, simulate_motion, make_noise):
    forces = np.column_stack([make_noise(seed=k) for k in (1, 2, 3)])
    motions = [simulate_motion(forces[:, k]) for k in range(3)]
    places = np.column_stack([motions[k][0] for k in (2, 0, 1)])
    found = find_pairs(make_recording(forces, np.column_stack([m[2] for m in motions]), position=places))
    assert [(pair.derivative, pair.place) for pair in found] == [
        ("response 'a1'", "position 'x2'"), ("response 'a2'", "position 'x3'"), ("response 'a3'", "position 'x1'"),
    ]  # fmt: skip


def test_an_acceleration_of_another_motion_is_compared_with_nothing(make_recording, motion, make_noise):
    assert find_pairs(make_recording(motion[0], make_noise(seed=8), position=motion[1])) == ()


def test_of_a_rounded_position_the_factor_is_still_found(make_recording, motion):
    force, place, speed, _ = motion
    step = place.std() / 50
    (pair,) = find_pairs(make_recording(force, (speed, "velocity", "m/s"), position=np.round(place / step) * step))
    assert pair.agreement.gain == pytest.approx(1.0, rel=0.05)


def find_lags(found: Recording):
    channels = list_channels(found)
    spectra = estimate_cross_spectra(channels, [(0, len(found))], RATE_HZ)
    assert spectra is not None
    return check_lags(channels, spectra, RATE_HZ)


def test_a_measured_force_that_is_late_is_found(make_recording, motion):
    force, *_ = motion
    (check,) = find_lags(make_recording(force, (0.8 * delay(force, 4.0), "force", "N")))
    assert check.level == "notice"
    assert check.finding == "response 'a1' is 0.8 times command 'f1', 4 ms (4 samples) later."


def test_a_force_behind_a_resonance_is_no_second_view_of_the_command(make_recording, motion):
    force, place, *_ = motion
    (check,) = find_lags(make_recording(force, (800 * place, "force", "N")))
    assert (check.level, "No two channels measure the same quantity" in check.finding) == ("fine", True)


@pytest.mark.parametrize(
    ("factor", "lag", "level", "words"),
    [
        (0.65, 5.5, "notice", "filter or a flexible part"),
        (0.65, 0.2, "wrong", "units and factors"),
        (1.6, 5.5, "wrong", "units and factors"),
        (1 / 9.80665, 5.5, "wrong", "g for m/s"),
        (-0.65, 5.5, "wrong", "sign"),
    ],
)
def test_what_is_later_and_smaller_is_no_wrong_unit(factor, lag, level, words):
    pair = KinematicPair("position x", "acceleration ax", 2, GainAndLag(factor, 0.1, lag, 0.9))
    (check,) = check_kinematics([pair], 1000.0)
    assert check.level == level
    assert words in check.advice
