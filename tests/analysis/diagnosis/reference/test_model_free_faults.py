"""What a converter or a line does to readings is seen in them, where a reference device's lack it."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.reference.model_free_faults import find_sensor_faults
from equalizer.effects.catalogue import CATALOGUE
from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal

RATE_HZ, STEP = 1000.0, 0.001


def make_recording(seed: int, step: float = STEP, channels: int = 1) -> Recording:
    """Read by a converter with fine steps."""
    random = np.random.default_rng(seed)
    samples = np.cumsum(random.normal(size=(6000, channels)), axis=0)
    samples = samples - samples.mean(axis=0)
    samples = step * np.round(samples / samples.std(axis=0) / step) if step else samples / samples.std(axis=0)
    return Recording(
        "rig",
        Signal(random.normal(size=(6000, 1)), RATE_HZ, "force", "N", ("fx",)),
        Signal(samples, RATE_HZ, "acceleration", "m/s^2", tuple("abc"[:channels])),
    )


def change_response(given: Recording, change) -> Recording:
    return replace(given, response=replace(given.response, samples=change(given.response.samples)))


def find_faults(new: Recording, clean: Recording, known=CATALOGUE):
    found = find_sensor_faults([new], [clean], known)
    return [(each.key[0][0], each.key[0][1], each.list_placed_effects()[0].values) for each in found]


@pytest.mark.parametrize("step", [STEP, 0.05, 0.0])
def test_another_recording_of_the_same_device_shows_nothing(step):
    assert find_faults(make_recording(2, step), make_recording(1, step)) == []


def test_steps_of_half_the_range_are_seen():
    new = change_response(make_recording(2), lambda y: np.ptp(y) / 2 * np.round(y / (np.ptp(y) / 2)))
    assert len(np.unique(new.response.samples)) == 3
    ((name, _, values),) = find_faults(new, make_recording(1))
    assert name == "quantization"
    assert values["step"] == pytest.approx(np.ptp(new.response.samples) / 2)


@pytest.mark.parametrize("channels", [1, 3])
def test_wider_steps_are_seen_with_their_size(channels):
    new = change_response(make_recording(2, channels=channels), lambda y: 0.07 * np.round(y / 0.07))
    ((name, spread, values),) = find_faults(new, make_recording(1, channels=channels))
    assert (name, spread) == ("quantization", "one" if channels == 1 else "all")
    assert values["step"] == pytest.approx(0.07)


def test_readings_that_stay_at_a_limit_are_seen_with_it():
    new = change_response(make_recording(2), lambda y: np.clip(y, -0.9, 0.9))
    ((name, _, values),) = find_faults(new, make_recording(1))
    assert name == "sensor_clipping"
    assert values["limit"] == pytest.approx(0.9)


def test_samples_that_are_there_twice_are_seen_with_their_share():
    def lose(y):
        lost = np.random.default_rng(5).random(len(y)) < 0.02
        lost[0] = False
        return y[np.maximum.accumulate(np.where(lost, 0, np.arange(len(y))))]

    ((name, _, values),) = find_faults(change_response(make_recording(2, 0.0), lose), make_recording(1, 0.0))
    assert name == "lost_samples"
    assert values["fraction"] == pytest.approx(0.02, rel=0.2)


def test_a_sensor_that_stands_still_has_not_lost_samples():
    new = change_response(make_recording(2, 0.0), lambda y: np.where(np.arange(len(y))[:, None] < 5900, y, y[5900]))
    assert find_faults(new, make_recording(1, 0.0)) == []


def test_what_the_sound_device_does_too_is_not_seen():
    clipped = change_response(make_recording(1), lambda y: np.clip(y, -0.9, 0.9))
    assert find_faults(change_response(make_recording(2), lambda y: np.clip(y, -0.9, 0.9)), clipped) == []


def test_what_may_not_be_named_is_not_seen():
    new = change_response(make_recording(2), lambda y: np.clip(y, -0.9, 0.9))
    assert find_faults(new, make_recording(1), [each for each in CATALOGUE if each.name != "sensor_clipping"]) == []


def test_what_is_not_known_does_not_count():
    new = change_response(make_recording(2), lambda y: np.where(np.arange(len(y))[:, None] < 500, np.nan, y))
    assert find_faults(new, make_recording(1)) == []


def test_play_before_the_sensor_is_neither_a_limit_nor_lost_samples():
    """It stays where it is after each turn, at any level."""

    def play(y):
        found, read = np.empty_like(y), y[0]
        for k, here in enumerate(y):
            read = np.clip(read, here - 0.2, here + 0.2)
            found[k] = read
        return found

    assert find_faults(change_response(make_recording(2, 0.0), play), make_recording(1, 0.0)) == []


def test_an_intact_moving_device_shows_the_same_lattice_as_at_rest():
    """An encoder of fine steps takes nearly as many values as there are samples while it moves, and five at rest."""
    at = np.arange(6000)
    moving, resting = 1e-5 * np.round(3e4 * np.sin(at / 900)), 1e-5 * np.round(2.2 * np.sin(at / 300))
    clean, new = (change_response(make_recording(1), lambda y, c=course: c[:, None]) for course in (moving, resting))
    assert find_faults(new, clean) == []
    coarse = change_response(make_recording(1), lambda y: 1e-3 * np.round(300 * np.sin(at / 900))[:, None])
    assert find_faults(coarse, clean)[0][0] == "quantization"


def test_play_that_is_crossed_in_a_few_samples_has_lost_none():
    """It begins to move slowly, where a reading that was lost is caught up with."""
    smooth = np.sin(np.arange(6000) / 5.0) + np.sin(np.arange(6000) / 7.3)
    held, read = np.empty(6000), smooth[0]
    for k, here in enumerate(smooth):
        read = np.clip(read, here - 0.005, here + 0.005)
        held[k] = read
    clean = change_response(make_recording(1), lambda y: smooth[::-1, None].copy())
    assert find_faults(change_response(make_recording(2), lambda y: held[:, None]), clean) == []
    lost = smooth.copy()
    lost[2::3] = smooth[1::3]
    assert find_faults(change_response(make_recording(2), lambda y: lost[:, None]), clean)[0][0] == "lost_samples"
