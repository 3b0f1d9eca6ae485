"""Whether responses have anything to do with commands: told from noise of any colour, and not judged where short."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from analysis.diagnosis.data.driven_response import compute_response_significance
from analysis.diagnosis.limits import DRIVEN_DEVIATIONS
from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal
from tests.slow_instances import slow_after

RATE_HZ = 500.0


def make_recording(command, response) -> Recording:
    names = "xyz"[: command.shape[1]]
    return Recording(
        "bench",
        Signal(command, RATE_HZ, "force", "N", tuple("f" + name for name in names)),
        Signal(response, RATE_HZ, "acceleration", "m/s^2", tuple("a" + name for name in names)),
    )


@pytest.mark.parametrize("seed", slow_after(2, range(6)))
@pytest.mark.parametrize("colour", ["white", "walk", "narrow"])
def test_noise_of_any_colour_answers_nothing(colour, seed):
    rng = np.random.default_rng(seed)
    white = rng.standard_normal((12_000, 3))
    noise = {
        "white": white,
        "walk": np.cumsum(white, axis=0),
        "narrow": lfilter([1.0], [1.0, -1.8, 0.98], white, axis=0),
    }[colour]
    sure = compute_response_significance([make_recording(rng.standard_normal((12_000, 3)), noise)])
    assert sure is not None and sure < DRIVEN_DEVIATIONS


def test_one_channel_that_answers_weakly_is_enough():
    rng = np.random.default_rng(1)
    command, response = rng.standard_normal((12_000, 3)), rng.standard_normal((12_000, 3))
    response[:, 1] += 0.3 * command[:, 2]
    sure = compute_response_significance([make_recording(command, response)])
    assert sure is not None and sure > 2 * DRIVEN_DEVIATIONS


def test_a_recording_too_short_for_it_is_not_judged():
    rng = np.random.default_rng(1)
    assert (
        compute_response_significance([make_recording(rng.standard_normal((100, 1)), rng.standard_normal((100, 1)))])
        is None
    )


def test_gaps_in_the_response_are_left_out():
    rng = np.random.default_rng(1)
    command = rng.standard_normal((12_000, 1))
    response = 2 * command
    response[3000:5000] = np.nan
    sure = compute_response_significance([make_recording(command, response)])
    assert sure is not None and sure > DRIVEN_DEVIATIONS


@pytest.mark.parametrize("missing", [slice(0, 6000), slice(6000, 12_000)])
def test_noise_in_one_half_without_a_response_in_the_other_is_judged_as_noise(missing):
    rng = np.random.default_rng(1)
    response = rng.standard_normal((12_000, 1))
    response[missing] = np.nan
    sure = compute_response_significance([make_recording(rng.standard_normal((12_000, 1)), response)])
    assert sure is not None and sure < DRIVEN_DEVIATIONS


@pytest.mark.parametrize("seed", range(4))
def test_a_slow_force_beside_friction_below_the_commands_noise_is_no_noise(seed):
    """A shaft that goes to and fro under control: the current holds up dry friction, and a lot of noise."""
    rng = np.random.default_rng(seed)
    seconds = np.arange(5000) / RATE_HZ - 1
    speed = 150 * np.clip(3 * np.sin(2 * np.pi * seconds / 6.3), -1, 1) * (seconds > 0)
    current = 9 * np.sign(speed) + 8 * rng.standard_normal(5000)
    position = np.cumsum(speed)[:, None] / RATE_HZ
    sure = compute_response_significance([make_recording(current[:, None], position)])
    assert sure is None or sure >= DRIVEN_DEVIATIONS


def join_in_parts(commands, responses) -> Recording:
    """A recording of parts after one another, between which its signals jump."""
    stops = np.cumsum([len(command) for command in commands]).tolist()
    parts = [{"start": start, "stop": stop} for start, stop in zip([0, *stops], stops, strict=False)]
    return replace(make_recording(np.vstack(commands), np.vstack(responses)), meta={"parts": parts})


def step_under_control(gain: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Command and position of a mass of 0.1 kg with 1 N s/m at a target that steps to 1 m after a fifth of the time."""
    position = speed = 0.0
    rows = []
    for sample in range(count):
        force = gain * ((sample >= count // 5) - position)
        rows.append((force, position))
        speed += (force - speed) / 0.1 / RATE_HZ
        position += speed / RATE_HZ
    command, response = np.array(rows).T
    return command[:, None], response[:, None]


def test_single_steps_of_a_body_that_no_spring_returns_are_answers():
    steps = [step_under_control(gain, count) for gain, count in ((1.0, 2000), (2.0, 1990), (4.0, 4500), (8.0, 1980))]
    sure = compute_response_significance([join_in_parts(*zip(*steps, strict=True))])
    assert sure is not None and sure > 2 * DRIVEN_DEVIATIONS


@pytest.mark.parametrize("lengths", [(2000, 1990, 4500, 1980), (400,) * 30])
def test_noise_in_parts_answers_nothing(lengths):
    rng = np.random.default_rng(2)
    commands, responses = ([rng.standard_normal((length, 1)) for length in lengths] for _ in range(2))
    sure = compute_response_significance([join_in_parts(commands, responses)])
    assert sure is not None and sure < DRIVEN_DEVIATIONS


def test_every_labelled_case_answers_its_commands(shared):
    from study.store.formats.recording_file import read_recording

    sure = compute_response_significance([read_recording(shared / "cases" / "open-05.h5")])
    assert sure is not None and sure > 10 * DRIVEN_DEVIATIONS
