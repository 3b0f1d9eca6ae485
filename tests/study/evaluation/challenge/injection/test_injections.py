"""Faults put into recordings: each does what it says, by the truth that is kept of it."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal
from study.evaluation.challenge.injection.axis_motion import compute_axis_motion
from study.evaluation.challenge.injection.force_injections import FORCE_INJECTIONS
from study.evaluation.challenge.injection.injections import (
    INJECTIONS,
    inject,
    list_applicable_injections,
    measure_response,
)

RATE_HZ = 1000.0


def recording(channels: int = 3) -> Recording:
    random = np.random.default_rng(1)
    time_s = np.arange(4000) / RATE_HZ
    y = np.column_stack([np.sin(2 * np.pi * (7 + k) * time_s) for k in range(channels)])
    y += 0.01 * random.normal(size=y.shape)
    return Recording(
        "rig",
        Signal(random.normal(size=(4000, 1)), RATE_HZ, "force", "N", ("fx",)),
        Signal(y, RATE_HZ, "acceleration", "m/s^2", tuple(f"a{axis}" for axis in "xyz"[:channels])),
    )


def injected(effect: str, strength: float = 0.7, channels: int = 3):
    return inject(recording(channels), effect, strength, np.random.default_rng(2))


@pytest.mark.parametrize("effect", [injection.effect for injection in INJECTIONS])
def test_a_stronger_fault_changes_more(effect):
    weak, strong = injected(effect, 0.2), injected(effect, 0.9)
    assert 0 < weak.change.max() < strong.change.max()
    assert np.isfinite(strong.recording.response.samples).all()


@pytest.mark.parametrize("effect", [injection.effect for injection in INJECTIONS])
def test_the_command_stays_as_it_is(effect):
    assert np.array_equal(injected(effect).recording.command.samples, recording().command.samples)


def test_the_same_draw_gives_the_same_fault():
    one, other = injected("lost_samples"), injected("lost_samples")
    assert np.array_equal(one.recording.response.samples, other.recording.response.samples)


def test_nothing_injected_changes_nothing():
    found = inject(recording(), "", 0.5, np.random.default_rng(3))
    assert found.effect == "" and not found.change.any()


def test_the_numbers_are_those_of_the_samples():
    clipped = injected("sensor_clipping")
    assert np.abs(clipped.recording.response.samples).max() == pytest.approx(clipped.values["limit"])
    stepped = injected("quantization").recording.response.samples / injected("quantization").values["step"]
    assert np.allclose(stepped, np.round(stepped))
    drift = injected("sensor_drift")
    assert drift.recording.response.samples[-1, 0] - recording().response.samples[-1, 0] == pytest.approx(
        drift.values["total"]
    )
    turned = injected("sensor_misalignment").recording.response.samples
    assert np.allclose(np.linalg.norm(turned, axis=1), np.linalg.norm(recording().response.samples, axis=1))


def swinging() -> Recording:
    """One axis, of which the position was measured."""
    random, time_s = np.random.default_rng(4), np.arange(6000) / RATE_HZ
    q = 0.02 * np.sin(2 * np.pi * 1.3 * time_s) + 0.01 * np.sin(2 * np.pi * 3.1 * time_s + 1.0)
    force = 200.0 * q + 0.3 * np.sign(np.gradient(q)) + 0.05 * random.normal(size=len(q))
    return Recording(
        "rig",
        Signal(force[:, None], RATE_HZ, "force", "N", ("fx",)),
        Signal((q + 1e-7 * random.normal(size=len(q)))[:, None], RATE_HZ, "position", "m", ("x",)),
    )


@pytest.mark.parametrize("effect", [force_injection.effect for force_injection in FORCE_INJECTIONS])
def test_a_fault_of_mechanism_or_actuator_changes_the_command_alone_and_more_the_stronger(effect):
    weak, strong = (inject(swinging(), effect, strength, np.random.default_rng(2)) for strength in (0.2, 0.9))
    assert 0 < weak.change.max() < strong.change.max()
    assert np.array_equal(strong.recording.response.samples, swinging().response.samples)
    assert np.isfinite(strong.recording.command.samples).all()


@pytest.mark.parametrize("effect", [force_injection.effect for force_injection in FORCE_INJECTIONS])
@pytest.mark.parametrize("force_n", [None, 0.0, 2.5])
def test_faults_of_an_axis_at_rest_are_finite_and_leave_a_command_of_zero(effect, force_n):
    plain = swinging()
    resting = replace(plain, response=replace(plain.response, samples=np.full((6000, 1), 0.5)))
    if force_n is not None:
        resting = replace(resting, command=replace(plain.command, samples=np.full((6000, 1), force_n)))
    found = inject(resting, effect, 0.9, np.random.default_rng(2))
    assert np.isfinite(found.recording.command.samples).all() and np.isfinite([*found.values.values()]).all()
    if force_n == 0.0:
        assert not found.change.any()


def test_an_added_mass_asks_for_its_force_and_a_weaker_drive_for_a_larger_command():
    plain = swinging()
    heavy = inject(plain, "added_mass", 0.8, np.random.default_rng(2))
    time_s, inside = np.arange(6000) / RATE_HZ, slice(500, -500)
    turn = 2 * np.pi * np.array([1.3, 3.1])
    a = -0.02 * turn[0] ** 2 * np.sin(turn[0] * time_s) - 0.01 * turn[1] ** 2 * np.sin(turn[1] * time_s + 1.0)
    added = (heavy.recording.command.samples - plain.command.samples)[inside, 0]
    assert np.std(added - heavy.values["size"] * a[inside]) < 0.05 * np.std(added)
    weak = inject(plain, "force_gain", 0.8, np.random.default_rng(2))
    assert weak.values["gain"] * weak.recording.command.samples == pytest.approx(plain.command.samples)


def test_a_delayed_drive_was_commanded_earlier():
    plain, moved = swinging(), compute_axis_motion(swinging(), 0)
    assert moved is not None
    late = inject(plain, "transport_delay", 0.9, np.random.default_rng(2))
    shift = late.values["delay"] * RATE_HZ
    expected = np.interp(np.arange(6000) + shift, np.arange(6000), plain.command.samples[:, 0])
    assert late.recording.command.samples[:, 0] == pytest.approx(expected)


def test_a_clock_that_is_fast_reads_what_comes_later():
    found = injected("clock_drift", 0.9)
    late = found.values["ppm"] * 1e-6 * 3000
    expected = np.interp(3000 + late, np.arange(4000), recording().response.samples[:, 0])
    assert found.recording.response.samples[3000, 0] == pytest.approx(expected)


def test_a_lag_delays_a_slow_tone_by_its_time_constant():
    found = injected("sensor_lag", 0.3)
    y, x = found.recording.response.samples[1000:, 0], recording().response.samples[1000:, 0]
    tone = np.exp(-2j * np.pi * 7 * np.arange(3000) / RATE_HZ)
    delay_s = -np.angle((y @ tone) / (x @ tone)) / (2 * np.pi * 7)
    assert delay_s == pytest.approx(1 / (2 * np.pi * found.values["bandwidth"]), rel=0.25)


def test_only_faults_that_a_recording_can_carry_are_drawn():
    assert "sensor_misalignment" in list_applicable_injections(recording(3))
    assert "sensor_misalignment" not in list_applicable_injections(recording(1))
    places = replace(recording(3).response, channels=("shaker", "wing tip", "payload"))
    assert "sensor_misalignment" not in list_applicable_injections(replace(recording(3), response=places))
    three = recording(3)
    samples, names = np.hstack([three.response.samples] * 2), ("ax", "ay", "az", "bx", "by", "bz")
    doubled = replace(three, response=replace(three.response, samples=samples, channels=names))
    assert "sensor_misalignment" not in list_applicable_injections(doubled)
    imposed = replace(swinging(), meta={"imposed": "position"})
    assert {"added_mass", "force_gain"} <= set(list_applicable_injections(swinging()))
    assert "added_mass" in list_applicable_injections(imposed) and "force_gain" not in list_applicable_injections(
        imposed
    )
    assert measure_response(recording(1)).median_hz == pytest.approx(7, abs=0.5)


def test_what_cannot_be_injected_is_refused():
    with pytest.raises(ValueError, match="there is no way to inject 'gremlins'"):
        injected("gremlins")
    with pytest.raises(ValueError, match="strength is 1.5"):
        injected("quantization", 1.5)
    with pytest.raises(ValueError, match="needs 3 response channels"):
        injected("sensor_misalignment", channels=1)
    still = replace(recording(), response=replace(recording().response, samples=np.zeros((4000, 3))))
    for effect in ("quantization", "sensor_nonlinearity", "sensor_asymmetry"):
        with pytest.raises(ValueError, match="the response is constant"):
            inject(still, effect, 0.5, np.random.default_rng(2))


def two_takes() -> Recording:
    """The recording twice, moved by 50 in the second take, with its parts named."""
    first = recording()
    samples = np.vstack([first.response.samples, first.response.samples + 50.0])
    return replace(
        first,
        command=replace(first.command, samples=np.vstack([first.command.samples] * 2)),
        response=replace(first.response, samples=samples),
        meta={"parts": [{"start": 0, "stop": 4000}, {"start": 4000, "stop": 8000}]},
    )


@pytest.mark.parametrize("effect", [injection.effect for injection in INJECTIONS if injection.memory])
def test_what_a_sensor_remembers_ends_with_the_take(effect):
    both = inject(two_takes(), effect, 0.9, np.random.default_rng(2))
    change = (both.recording.response.samples - two_takes().response.samples)[4000:]
    assert 0 < np.abs(change).max() < 5.0


def test_a_motion_is_differentiated_within_each_take():
    whole = compute_axis_motion(two_takes(), 0)
    assert np.abs(whole.v).max() == pytest.approx(np.abs(compute_axis_motion(recording(), 0).v).max())
