from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.diagnose import DiagnosisSettings, diagnose
from analysis.diagnosis.result.assemble_findings import _collect_remarks, _describe_rest
from analysis.diagnosis.result.black_box import _normalise_error
from analysis.diagnosis.result.error_table import _compute_errors, find_resting_channels, is_held_out_still
from equalizer.effects.catalogue import CATALOGUE
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal
from tests.diagnosed import TRIED, device, recorded

ASKED = DiagnosisSettings(without=tuple(effect.name for effect in CATALOGUE if effect.name not in TRIED))
N, MOVING = 4000, 2400
NOISE = np.array([0.05])
LAST_QUARTER = (Segment(0, 3000, "noise", role="fit"), Segment(3000, N, "noise", role="test"))


def record_wheel(speed):
    read = speed.reshape(N, -1)
    push = Signal(np.zeros(read.shape), 100.0, "torque", "N m", tuple(f"drive{k}" for k in range(read.shape[1])))
    names = tuple(f"speed{k}" for k in range(read.shape[1]))
    return Recording("wheel", push, Signal(read, 100.0, "velocity", "rad/s", names))


def stopping_speed(sample, seed=3):
    speed = 3 * np.abs(np.sin(np.arange(N) / 50)) + 0.05 * np.random.default_rng(seed).standard_normal(N)
    speed[sample:] = 0.0
    return speed


@pytest.mark.parametrize(("stop", "still"), [(MOVING, True), (N, False)])
def test_held_out_samples_at_rest_hold_no_motion(stop, still):
    marked = replace(record_wheel(stopping_speed(stop)), segments=LAST_QUARTER)
    assert is_held_out_still(observe_parts([marked], 1), NOISE) == still


def test_without_segments_what_is_held_out_moves():
    assert not is_held_out_still(observe_parts([record_wheel(stopping_speed(MOVING))], 1), NOISE)


def test_a_steady_speed_is_a_motion_though_its_reading_does_not_change():
    speed = np.where(np.arange(N) < MOVING, stopping_speed(N), 2.0)
    assert not is_held_out_still(observe_parts([record_wheel(speed)], 1), NOISE)


@pytest.mark.parametrize(
    ("stop", "size", "still"), [(MOVING, 0.0, True), (N, 0.0, False), (MOVING, 0.2, False)],
    ids=["idle beside one at rest", "idle beside one that moves", "moves a little beside one at rest"],
)  # fmt: skip
def test_an_idle_axis_that_only_holds_noise_does_not_move(stop, size, still):
    small = size * np.sin(np.arange(N) / 50) + NOISE * np.random.default_rng(8).standard_normal(N)
    shot = record_wheel(np.stack([stopping_speed(stop), small], axis=1))
    assert is_held_out_still(observe_parts([shot], 1), np.repeat(NOISE, 2)) == still


def test_a_channel_that_rests_where_another_moves_does_not_count_in_the_held_out_error():
    """Relative to a reading that rests, any prediction is wrong by many times the signal."""
    shot = record_wheel(np.stack([stopping_speed(MOVING), stopping_speed(N)], axis=1))
    records = observe_parts([replace(shot, segments=LAST_QUARTER)], 2)
    measure = SimpleNamespace(records=records, noise=np.repeat(NOISE, 2), unit=np.repeat(NOISE, 2))
    assert find_resting_channels(records, measure.noise).tolist() == [True, False]
    found = SimpleNamespace(fitted=SimpleNamespace(residuals=tuple(np.full((N, 2), 2.0) for _ in records)))
    errors = _compute_errors(measure, SimpleNamespace(before=found, retuned=found, after=found), ("test",))
    assert errors.retuned == pytest.approx(0.1 / records[0].measured[records[0].test, 1].std(), rel=1e-6)
    assert _normalise_error(measure, np.full((int(records[0].test.sum()), 2), 2.0)) == pytest.approx(errors.retuned)
    assert _describe_rest(measure, ("speed0", "speed1")).startswith(
        "The held-out data contain no motion of speed0, so the error on them is that of the other channels."
    )


def test_where_nothing_moves_at_all_nothing_stands_still():
    noise = NOISE * np.random.default_rng(8).standard_normal(N)
    assert not is_held_out_still(observe_parts([record_wheel(noise)], 1), NOISE)


@pytest.mark.slow
def test_a_stretch_at_rest_that_is_marked_as_test_stays_and_gives_no_error():
    moving = recorded(1)
    still = len(moving) - 3000, len(moving)
    quiet = np.random.default_rng(5).standard_normal((3000, 1)) * (0.05, 4e-6)
    silent = [signal.samples.copy() for signal in (moving.command, moving.response, moving.position)]
    silent[0][still[0] :], silent[1][still[0] :], silent[2][still[0] :] = 0.0, quiet[:, :1], quiet[:, 1:]
    recording = replace(
        moving,
        command=replace(moving.command, samples=silent[0]),
        response=replace(moving.response, samples=silent[1]),
        position=replace(moving.position, samples=silent[2]),
        segments=(*(s for s in moving.segments if s.role == "fit"), Segment(*still, "noise", role="test")),
    )
    said = diagnose([recording], device(1), ASKED, map, lambda said, share: None)
    assert said.diagnosis.fit.test.retuned is None
    assert any("contain no motion" in remark for remark in said.remarks)
    assert said.diagnosis.fit.fit.retuned is not None
    moved = diagnose([moving], device(1), ASKED, map, lambda said, share: None)
    assert moved.diagnosis.fit.test.retuned is not None


def test_remarks_on_the_noise_do_not_contradict_each_other():
    """Parts whose noise is measured in other ways, or not at all."""
    rest, unknown = "its noise was measured at rest.", "its noise is not known."
    tuning = SimpleNamespace(model=SimpleNamespace(system=SimpleNamespace(has_force_unit=True)))

    def collect(*remarks):
        return _collect_remarks((("first",), ("",)), tuning, [SimpleNamespace(remarks=(said,)) for said in remarks])

    assert collect(rest, rest) == ("first", rest)
    assert collect(rest, unknown, rest) == (
        "first", f"In 2 of 3 recordings or parts: {rest}", f"In 1 of 3 recordings or parts: {unknown}",
    )  # fmt: skip
