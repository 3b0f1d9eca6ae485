"""What controls give to a diagnosis is changed as their names say, and in nothing else."""

import numpy as np
import pytest

from study.evaluation.challenge.case_settings import CaseSettings
from study.evaluation.challenge.controls import CONTROLS, WRONG_EFFECT

SHORT = CaseSettings((0,), 1000, 3, steps=4)


@pytest.fixture(scope="module")
def asked():
    """Draws each control where it is asked for."""

    class Asked(dict):
        def __missing__(self, name):
            self[name] = {control.name: control for control in CONTROLS}[name].draw(50_031, SHORT)
            return self[name]

    return Asked()


@pytest.mark.slow
def test_shuffling_keeps_the_command_and_each_sample(asked):
    (shuffled,), whole = asked["a recording shuffled in time"], asked["irrelevant hypotheses added"][1]
    assert np.array_equal(shuffled.recording.command.samples, whole.recording.command.samples)
    assert not np.array_equal(shuffled.recording.response.samples, whole.recording.response.samples)
    one, other = (np.sort(each.recording.response.samples, axis=0) for each in (shuffled, whole))
    assert np.array_equal(one, other)


@pytest.mark.slow
def test_a_silent_recording_holds_noise_alone(asked):
    (silent,) = asked["a silent recording"]
    assert not silent.recording.command.samples.any()
    assert silent.recording.response.samples.std() == pytest.approx(0.042, rel=0.05)


def test_axes_are_turned_in_recording_and_model_alike(asked):
    first, turned = asked["axes in another order"]
    assert turned.recording.response.channels == first.recording.response.channels[::-1]
    assert np.array_equal(turned.recording.command.samples[:, 0], first.recording.command.samples[:, 1])
    assert np.array_equal(turned.model.output[0], first.model.output[1])


def test_axes_are_exchanged_where_one_bears_the_others_name(asked):
    first, turned = asked["axes exchanged"]
    for name in ("command", "response", "position"):
        one, other = getattr(first.recording, name), getattr(turned.recording, name)
        assert one.channels == other.channels
        assert np.array_equal(one.samples, other.samples[:, ::-1])
    assert np.array_equal(turned.model.output[0], first.model.output[1])


def test_mirrored_means_every_signal(asked):
    first, turned = asked["everything mirrored"]
    for name in ("command", "response", "position"):
        one, other = (getattr(each.recording, name).samples for each in (first, turned))
        assert np.array_equal(one, -other)


def test_another_device_has_another_model(asked):
    (other,) = asked["the model of another device"]
    own = asked["irrelevant hypotheses added"][1]
    assert other.model.mass[0, 0] != own.model.mass[0, 0]


def test_a_catalogue_of_one_leaves_one(asked):
    (one,) = asked["a catalogue of one wrong hypothesis"]
    assert WRONG_EFFECT not in one.excluded_effects and len(one.excluded_effects) > 30


def test_other_names_change_nothing_but_names(asked):
    first, other = asked["other names of device and channels"]
    assert first.recording.response.channels != other.recording.response.channels
    assert np.array_equal(first.recording.response.samples, other.recording.response.samples)
