"""What cannot be diagnosed is refused by name: recordings that differ, nothing recorded, a model of something else."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.data.input_checks import (
    NothingToDiagnoseError,
    require_comparable,
    require_model_of,
    require_usable_data,
)
from equalizer.plant.mechanical_model import MechanicalModel, ModelEffect
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal

RATE_HZ = 500.0


def make_model(axes=1, quantity="acceleration", damping=4.0, stiffness=100.0, rotational=False) -> MechanicalModel:
    eye = np.eye(axes)
    return MechanicalModel("m", quantity, 0.25 * eye, damping * eye, stiffness * eye, eye, eye, rotational=rotational)


def make_recording(
    samples=5000, axes=1, rate_hz=RATE_HZ, units=("N", "m/s^2"), seed=0, gain=4.0, noise=0.1
) -> Recording:
    rng = np.random.default_rng(seed)
    u = rng.standard_normal((samples, axes))
    y = gain * u + noise * rng.standard_normal((samples, axes))
    quantities = {"N": "force", "N m": "torque", "m/s^2": "acceleration", "rad/s^2": "acceleration", "m": "position"}
    return Recording(
        "bench",
        Signal(u, rate_hz, quantities[units[0]], units[0], tuple("f" + name for name in "xyz"[:axes])),
        Signal(y, rate_hz, quantities[units[1]], units[1], tuple("a" + name for name in "xyz"[:axes])),
    )


def with_samples(given: Recording, side: str, samples) -> Recording:
    return replace(given, **{side: replace(getattr(given, side), samples=samples)})


def refusal_text(check, *arguments) -> str:
    with pytest.raises(NothingToDiagnoseError) as refused:
        check(*arguments)
    return str(refused.value)


def test_what_belongs_together_is_taken():
    one = make_recording()
    require_comparable([one, make_recording(seed=1)], ["a", "b"])
    require_usable_data([one], ["a"])
    require_model_of(make_model(), [one])


@pytest.mark.parametrize(
    ("other", "words"),
    [
        (make_recording(rate_hz=1000.0), "b has the sample rate 1000 Hz, a has 500 Hz"),
        (make_recording(axes=2), "b has the command fx (N), fy (N), a has fx (N)"),
        (make_recording(units=("N", "m")), "b has the response ax (m), a has ax (m/s^2)"),
    ],
    ids=["rate", "channels", "unit"],
)
def test_recordings_of_different_kinds_are_distinguished(other, words):
    assert words in refusal_text(require_comparable, [make_recording(), other], ["a", "b"])


def test_no_recording_is_nothing():
    assert "there is no recording" in refusal_text(require_comparable, [], [])


def test_a_gap_in_the_command_is_named_by_its_place():
    gap = make_recording().command.samples.copy()
    gap[70:80] = np.nan
    said = refusal_text(require_usable_data, [with_samples(make_recording(), "command", gap)], ["a.h5"])
    assert "a.h5 has no command in 10 samples (the first is 70)" in said


def test_a_command_that_never_changes_excites_nothing():
    still = with_samples(make_recording(), "command", np.ones((5000, 1)))
    assert "the command never changes" in refusal_text(require_usable_data, [still], ["a"])


def test_a_response_without_a_number_and_one_that_never_changes_are_named():
    missing = with_samples(make_recording(), "response", np.full((5000, 1), np.nan))
    assert "response ax contains only missing values" in refusal_text(require_usable_data, [missing], ["a"])
    dead = with_samples(make_recording(), "response", np.zeros((5000, 1)))
    assert "response ax never changes" in refusal_text(require_usable_data, [dead], ["a"])


def test_too_few_samples_and_too_few_cycles_are_too_short():
    assert "100 samples are too short" in refusal_text(require_usable_data, [make_recording(samples=100)], ["a"])
    t = np.arange(5000)[:, None] / 5000
    slow = with_samples(make_recording(), "command", np.sin(2 * np.pi * 1.5 * t))
    assert "cycles of the command, which is too short" in refusal_text(require_usable_data, [slow], ["a"])


def test_random_levels_that_change_their_side_once_hold_many_cycles_and_a_step_holds_none():
    levels = np.repeat(np.random.default_rng(3).uniform(0.0, 1.0, 50), 100)
    levels[2500:] *= -1
    answered = with_samples(make_recording(), "response", 4 * levels[:, None])
    require_usable_data([with_samples(answered, "command", levels[:, None])], ["a"])
    step = with_samples(make_recording(), "command", (np.arange(5000) > 2000.0)[:, None].astype(float))
    assert "cycles of the command, which is too short" in refusal_text(require_usable_data, [step], ["a"])


def test_where_only_the_test_holds_a_response_nothing_can_be_fitted():
    whole = make_recording()
    roles = (Segment(0, 4000, "noise", 1.0, 0, "fit"), Segment(4000, 5000, "noise", 1.0, 0, "test"))
    missing = whole.response.samples.copy()
    missing[:4000] = np.nan
    gaps = with_samples(replace(whole, segments=roles), "response", missing)
    assert "only 0 samples that may be fitted have a response" in refusal_text(require_usable_data, [gaps], ["a"])
    missing[:2000] = whole.response.samples[:2000]
    require_usable_data([with_samples(gaps, "response", missing)], ["a"])


def test_a_recording_counts_once():
    one = make_recording()
    said = refusal_text(require_comparable, [one, make_recording(seed=1), replace(one, device="copy")], ["a", "b", "c"])
    assert said == "c holds the same samples as a, and a recording counts once: leave it out"
    require_comparable([one, make_recording(seed=1)], ["a", "b"])


def test_a_second_is_too_short_where_it_holds_few_samples_and_enough_where_it_holds_many():
    said = refusal_text(require_usable_data, [make_recording(samples=500)], ["a"])
    words = "500 samples, 1 s, are too short to identify physics; at least 1.5 s or 2000 samples are needed"
    assert words in said
    assert require_usable_data([make_recording(samples=4000, rate_hz=4000.0)], ["a"]) == ()
    assert require_usable_data([make_recording(samples=800)], ["a"]) == ()
    (told,) = require_usable_data([make_recording(samples=500)], ["a"], allow_short=True)
    assert words in told
    assert "100 samples are too short" in refusal_text(
        lambda *given: require_usable_data(*given, allow_short=True), [make_recording(samples=100)], ["a"]
    )


def test_a_rate_too_slow_for_the_model_is_refused():
    said = refusal_text(require_model_of, make_model(stiffness=100.0), [make_recording(rate_hz=0.5)])
    assert "the model's lowest natural frequency is" in said
    assert "sample rate of 0.5 Hz; the recording must state its rate in hertz" in said
    require_model_of(make_model(stiffness=0.0), [make_recording(rate_hz=0.5)])


def test_a_recording_that_is_all_noise_is_refused():
    rng = np.random.default_rng(5)
    noise = with_samples(make_recording(), "response", rng.standard_normal((5000, 1)))
    assert "the responses are not related to the commands" in refusal_text(require_usable_data, [noise], ["a"])


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (make_model(axes=3), "the model has 3 inputs, but the recording has 1 command channel (fx)"),
        (make_model(axes=3), "the model has 3 outputs, but the recording has 1 response channel (ax)"),
        (
            make_model(quantity="velocity"),
            "the model's response is velocity, but the recording's is acceleration",
        ),
        (make_model(rotational=True), "the model is rotational (kg m^2, N m, rad), but the recording is translational"),
        (make_model(damping=-1.0), "the model is unstable: without a force its motion grows e-fold in 0.5 s"),
        (make_model(stiffness=-100.0), "the model is unstable"),
    ],
    ids=["inputs", "outputs", "quantity", "rotational", "damping", "stiffness"],
)
def test_a_model_of_something_else_is_refused(wrong, words):
    assert words in refusal_text(require_model_of, wrong, [make_recording()])


def test_a_translational_model_is_not_compared_with_turning():
    turning = make_recording(units=("N m", "rad/s^2"))
    assert "but the recording is rotational" in refusal_text(require_model_of, make_model(), [turning])


def test_a_model_that_drifts_freely_is_no_unstable_one():
    require_model_of(make_model(axes=3, damping=0.0, stiffness=0.0), [make_recording(samples=100_000, axes=3)])


def test_numbers_that_no_device_reaches_are_refused():
    one = make_recording()
    for side in ("command", "response"):
        high = with_samples(one, side, getattr(one, side).samples * 1e150)
        assert f"in {side}" in refusal_text(require_usable_data, [high], ["a"])
        assert "which no device reaches" in refusal_text(require_usable_data, [high], ["a"])


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"mass": [[1e-300]]}, "the model's lightest motion has a mass of 1e-300, which no device has"),
        ({"stiffness": [[1e300]]}, "the model's stiffness contains 1e+300, which no device has"),
        ({"input": [[0.0]]}, "in the model's input matrix no coordinate is driven by fx"),
        ({"output": [[0.0]]}, "in the model's output matrix no coordinate is measured by ax"),
    ],
    ids=["mass", "stiffness", "input", "output"],
)
def test_a_model_of_no_device_is_refused(changes, words):
    assert words in refusal_text(require_model_of, replace(make_model(), **changes), [make_recording()])


def test_two_actuators_of_one_motion_are_refused():
    eye = np.eye(2)
    both = MechanicalModel("m", "acceleration", eye, eye, eye, np.ones((2, 2)), eye)
    assert "2 inputs drive only 1 motion, so they cannot be distinguished" in refusal_text(
        require_model_of, both, [make_recording(axes=2)]
    )


@pytest.mark.parametrize(
    ("axis", "level", "words"),
    [("z", 0.2, "the axis 'z' is none of fx"), ("x", -0.2, "coulomb_friction.level is -0.2; it must not be negative")],
    ids=["axis", "level"],
)
def test_an_effect_of_the_models_own_must_be_possible(axis, level, words):
    rubbing = replace(make_model(), effects=(ModelEffect("coulomb_friction", axis, {"level": level}),))
    assert words in refusal_text(require_model_of, rubbing, [make_recording()])
