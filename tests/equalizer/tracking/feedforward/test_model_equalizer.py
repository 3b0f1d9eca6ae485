"""Periodic stimuli and their onset, played on a device that is known."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.model_response import compute_model_response, simulate
from equalizer.signals.signal import Signal
from equalizer.tracking.feedforward.model_equalizer import ModelEqualizer
from equalizer.tracking.feedforward.periodic_inverse import (
    OutsideBandError,
    compute_periodic_command,
    compute_regularised_inverse,
)
from equalizer.tracking.feedforward.virtual_spring import NO_SPRING, VirtualSpring

RATE_HZ = 1000.0
AXIS = np.array([0.0, 1.0, 1.0]) / np.sqrt(2)
SPRING = VirtualSpring(137.0, 2.0)


@pytest.fixture(scope="module")
def plant(plants):
    return plants.omega_like()


@pytest.fixture(scope="module")
def model(plant):
    channels = ("fx", "fy", "fz"), ("ax", "ay", "az")
    return IdentifiedModel(plant.A, plant.B, plant.C, np.zeros((3, 3)), RATE_HZ, (4.0, 50.0), "N", "m/s^2", *channels)


def wanted(frequency_hz, direction=AXIS, amplitude=1.0, seconds=0.2) -> Signal:
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    samples = amplitude * np.sin(2 * np.pi * frequency_hz * t)[:, None] * direction
    return Signal(samples, RATE_HZ, "acceleration", "m/s^2", ("ax", "ay", "az"))


@pytest.mark.parametrize("frequency_hz", [5.0, 15.0, 25.0, 35.0, 45.0])
def test_a_loop_is_delivered_as_it_was_wanted(model, plant, frequency_hz):
    loop = ModelEqualizer(model).compute_loop_commands(wanted(frequency_hz)).samples
    played = plant.play(np.tile(loop, (30, 1)))[-200:]
    assert np.abs(played - wanted(frequency_hz).samples).max() < 1e-3


def test_any_periodic_signal_in_the_band_may_be_wanted(model, plant):
    chord = replace(wanted(5.0), samples=wanted(5.0).samples + wanted(25.0, np.eye(3)[0]).samples)
    loop = ModelEqualizer(model).compute_loop_commands(chord).samples
    assert np.abs(plant.play(np.tile(loop, (30, 1)))[-200:] - chord.samples).max() < 1e-3


@pytest.mark.parametrize("frequency_hz", [5.0, 15.0, 25.0, 35.0, 45.0])
def test_an_onset_leads_into_the_loop_where_a_faded_loop_leaks(model, plant, frequency_hz):
    """Off the wanted axis, in a raised cosine of half a second."""
    equalizer, ticks = ModelEqualizer(model), 500
    envelope = 0.5 - 0.5 * np.cos(np.pi * np.arange(ticks) / ticks)
    signal = wanted(frequency_hz)
    loop = np.tile(equalizer.compute_loop_commands(signal).samples, (10, 1))
    onset = np.concatenate([equalizer.compute_onset_commands(signal, envelope).samples, loop[ticks % 200 :][:1000]])
    faded = np.concatenate([envelope[:, None] * loop[:ticks], loop[ticks % 200 :][:1000]])

    def leaked(commands):
        played = plant.play(commands)
        return np.abs(played - (played @ AXIS)[:, None] * AXIS).max()

    assert leaked(onset) < 5e-3
    assert leaked(onset) < 0.5 * leaked(faded)
    rising = np.concatenate([envelope, np.ones(1000)])[:, None] * np.tile(signal.samples, (10, 1))[:1500]
    assert np.abs(plant.play(onset)[:1400] - rising[:1400]).max() < 0.02


def test_against_a_spring_the_command_leaves_to_it_what_it_does(model, plant):
    """Closed by hand: the spring's force along the motion that was wanted, added to the command, drives the device."""
    loop = ModelEqualizer(model, SPRING).compute_loop_commands(wanted(5.0)).samples
    omega = 2 * np.pi * 5.0
    t = np.arange(200) / RATE_HZ
    position = -np.sin(omega * t)[:, None] * AXIS / omega**2
    velocity = -np.cos(omega * t)[:, None] * AXIS / omega
    total = loop - SPRING.stiffness_n_per_m * position - SPRING.damping_n_s_per_m * velocity
    assert np.abs(plant.play(np.tile(total, (30, 1)))[-200:] - wanted(5.0).samples).max() < 1e-3


@pytest.mark.parametrize(("frequency_hz", "allowed"), [(5.0, 0.065), (15.0, 0.01), (25.0, 0.005)])
def test_against_a_spring_an_onset_rises_as_wanted_too(model, plants, frequency_hz, allowed):
    """The spring in the loop, tick by tick, on the handle's true position. At 5 Hz a swing takes almost half of the
    rise, and the spring's share of it is no longer that of the loop."""
    modes, stiffness = plants.modes_of(), 137.0
    at_handle = np.zeros((3, model.order))
    for number, (_, _, shape) in enumerate(modes):
        at_handle[:, 2 * number] = shape
    equalizer, ticks = ModelEqualizer(model, VirtualSpring(stiffness)), 500
    envelope = 0.5 - 0.5 * np.cos(np.pi * np.arange(ticks) / ticks)
    commands = equalizer.compute_onset_commands(wanted(frequency_hz), envelope).samples
    x, played = np.zeros(model.order), np.empty((ticks, 3))
    for k, force in enumerate(commands):
        played[k] = model.C @ x
        x = model.A @ x + model.B @ (force - stiffness * (at_handle @ x))
    rising = envelope[:, None] * np.tile(wanted(frequency_hz).samples, (3, 1))[:ticks]
    assert np.linalg.norm(played - rising) < allowed * np.linalg.norm(rising)


def test_a_spring_makes_no_difference_far_above_it(model):
    f = np.array([5.0, 45.0])
    share = np.abs(compute_regularised_inverse(model, f, spring=SPRING) - compute_regularised_inverse(model, f)).max(
        axis=(1, 2)
    )
    assert share[1] < 0.06 * share[0]


def test_what_lies_outside_the_band_is_refused_with_what_would_do(model):
    with pytest.raises(OutsideBandError, match=r"made for 4 to 50 Hz, but the signal has content at 55 Hz; .*--band"):
        compute_periodic_command(model, wanted(55.0))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"sample_rate_hz": 500.0}, "runs at 1000 Hz, not at 500 Hz"),
        ({"unit": "N", "quantity": "force"}, "answers in m/s\\^2, but the reference is in N"),
    ],
)
def test_a_signal_of_another_kind_is_refused(model, changes, said):
    with pytest.raises(ValueError, match=said):
        compute_periodic_command(model, replace(wanted(5.0), **changes))


def test_silence_is_played_by_silence(model):
    assert not compute_periodic_command(model, wanted(5.0, amplitude=0.0)).samples.any()


def test_an_unstable_model_plays_nothing(model):
    with pytest.raises(ValueError, match="not stable"):
        ModelEqualizer(replace(model, A=1.02 * model.A))


@pytest.mark.parametrize("stiffness", [-1.0, float("nan")])
def test_a_spring_that_is_none_is_refused(stiffness):
    with pytest.raises(ValueError, match="stiffness_n_per_m"):
        VirtualSpring(stiffness)
    assert VirtualSpring() == NO_SPRING


def test_response_and_simulation_of_a_model_agree(model):
    """The steady state of a simulated sinusoid is the response at its frequency."""
    n = 4000
    commands = np.zeros((n, 3))
    commands[:, 1] = np.sin(2 * np.pi * 20.0 / RATE_HZ * np.arange(n))
    spectrum = np.fft.rfft(simulate(model, commands)[-1000:], axis=0)[20] / np.fft.rfft(commands[-1000:, 1])[20]
    assert np.allclose(spectrum, compute_model_response(model, np.array([20.0]))[0, :, 1], rtol=1e-6)
