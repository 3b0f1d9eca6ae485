import numpy as np
import pytest

from analysis.look.channels import list_channels
from analysis.look.completeness import check_constant_channels, check_copied_channels, check_missing_samples

N = 1000


@pytest.fixture
def draw_noise():
    return lambda seed: np.random.default_rng(seed).standard_normal(N)


def test_missing_samples_are_counted(make_recording, draw_noise):
    response = draw_noise(1)
    response[[100, 101, 102, 400]] = np.nan
    (check,) = check_missing_samples(list_channels(make_recording(draw_noise(2), response)), 1000.0)
    assert check.level == "notice"
    assert check.finding == ("response 'a1' lacks 4 of 1000 samples, the first at 0.1 s; the longest gap is 3 samples.")


def test_many_missing_samples_are_wrong_and_none_are_fine(make_recording, draw_noise):
    response = draw_noise(1)
    assert check_missing_samples(list_channels(make_recording(draw_noise(2), response)), 1000.0)[0].level == "fine"
    response[:300] = np.nan
    assert check_missing_samples(list_channels(make_recording(draw_noise(2), response)), 1000.0)[0].level == "wrong"


def test_a_constant_response_is_wrong_and_a_constant_command_is_reported(make_recording, draw_noise):
    found = check_constant_channels(
        list_channels(make_recording(np.column_stack([draw_noise(1), np.zeros(N)]), np.full(N, 2.5)))
    )
    assert [(check.level, check.finding) for check in found] == [
        ("notice", "command 'f2' is 0 N throughout."), ("wrong", "response 'a1' is 2.5 m/s^2 throughout."),
    ]  # fmt: skip
    assert "leave it out" in found[0].advice
    assert check_constant_channels(list_channels(make_recording(draw_noise(1), draw_noise(2))))[0].level == "fine"


def test_the_zero_command_of_a_free_motion_is_to_be_kept(make_recording, draw_noise):
    (check,) = check_constant_channels(list_channels(make_recording(np.zeros(N), draw_noise(1))))
    assert check.advice.startswith("In a free motion, such as a decay, keep it")
    commands = np.column_stack([np.zeros(N), np.full(N, np.nan)])  # a command that was never read drives nothing
    (check,) = check_constant_channels(list_channels(make_recording(commands, draw_noise(1))))
    assert check.advice.startswith("In a free motion, such as a decay, keep it")


@pytest.mark.parametrize(
    ("factor", "words"), [(1.0, "is response 'a1', up to an offset"), (-2.5, "times -2.5, up to an offset")]
)
def test_a_copy_of_a_channel_is_found(make_recording, draw_noise, factor, words):
    response = np.column_stack([draw_noise(1), factor * draw_noise(1) + 3.0 * (factor != 1.0)])
    (check,) = check_copied_channels(list_channels(make_recording(draw_noise(2), response)))
    assert check.level == "wrong"
    assert words in check.finding


def test_a_copy_in_single_precision_is_found_and_a_noisy_sensor_is_not(make_recording, draw_noise):
    single = draw_noise(1).astype(np.float32).astype(float)
    assert (
        check_copied_channels(list_channels(make_recording(draw_noise(2), np.column_stack([draw_noise(1), single]))))[
            0
        ].level
        == "wrong"
    )
    noisy = draw_noise(1) + 1e-4 * draw_noise(3)
    assert (
        check_copied_channels(list_channels(make_recording(draw_noise(2), np.column_stack([draw_noise(1), noisy]))))[
            0
        ].level
        == "fine"
    )


def test_an_excitation_that_is_the_command_is_in_order(make_recording, draw_noise):
    assert (
        check_copied_channels(list_channels(make_recording(draw_noise(1), draw_noise(2), excitation=draw_noise(1))))[
            0
        ].level
        == "fine"
    )
