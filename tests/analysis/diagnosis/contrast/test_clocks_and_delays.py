"""Late readings: by a clock that runs on through a file, or by a delay of any length."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.signal import lfilter

from analysis.diagnosis.contrast.actuator_faults import SIZE_RANGE, choose_trial_delays_s
from analysis.diagnosis.contrast.autoregressive_base import AutoregressiveBase
from analysis.diagnosis.contrast.bases import build_bases, compute_unexplained_share
from analysis.diagnosis.contrast.choose_fault import choose_fault
from analysis.diagnosis.contrast.compared_base import (
    LEAST_ROWS,
    REACH,
    ComparedBase,
    compare_base,
    undo_fault_in_rows,
)
from analysis.diagnosis.contrast.fault import Lags
from analysis.diagnosis.contrast.interpolation import compute_noise_gain, resample, shift_samples
from analysis.diagnosis.contrast.likely_delays import suggest_clock_rates, suggest_delays_s
from analysis.diagnosis.contrast.rank_faults import rank_faults
from analysis.diagnosis.contrast.recording_part import split_into_parts
from analysis.diagnosis.contrast.sensor_faults import make_sensor_faults
from analysis.diagnosis.limits import LEAST_FAULT_GAIN
from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal

BEGIN = 3000
"""First sample with a reading."""


@pytest.mark.slow
def test_a_clock_that_ran_on_before_the_first_reading_is_named_with_its_rate(rig):
    late = rig.change_reading(2, lambda y: resample(y, np.arange(len(y)) * (1 + 2e-3)))
    read = late.response.samples.copy()
    read[:BEGIN] = np.nan
    found = rig.decide_fault(replace(late, response=replace(late.response, samples=read)))
    assert found.named is not None
    assert found.named.fault.effect == "clock_drift"
    assert found.named.values["ppm"] == pytest.approx(2000, rel=0.2)


def test_each_delay_lies_within_reach_of_those_that_are_tried():
    slow = np.sin(2 * np.pi * 0.2 * np.arange(20_000) / 1000.0)
    tried = np.array(choose_trial_delays_s(slow, 1000.0))
    assert tried[-1] / tried[0] > 1000
    assert np.all(tried[1:] * SIZE_RANGE[0] <= 1.0001 * tried[:-1] * SIZE_RANGE[1])


@pytest.mark.parametrize("by", [-20.5, 7.3])
def test_a_shift_by_parts_of_a_sample_does_not_ring_at_the_ends(by):
    at = np.arange(600.0)

    def course(t):
        return 3 + 0.01 * t + np.sin(t / 15)

    found = shift_samples(course(at)[:, None], by)[:, 0]
    inside = (at - by >= 0) & (at - by <= at[-1])
    assert np.abs(found - course(at - by))[inside].max() < 1e-3
    assert np.abs(np.diff(found, 3)[inside[3:]]).max() < 2 * np.abs(np.diff(course(at), 3)).max()


POLES = np.exp([-0.01 + 0.02j, -0.01 - 0.02j, -0.02 + 0.05j, -0.02 - 0.05j])
"""Of a response 60 times slower than the samples: each changes it by 1e-5 of its size."""


def record_oscillator(seed: int, late: int = 0, period: int = 6000) -> tuple[Recording, float]:
    """A smooth response, read late beside its command, and what the command's next value does to it."""
    force = np.resize(np.random.default_rng(seed).normal(size=period), 6000)
    noise = 1e-3 * np.random.default_rng(seed + 100).normal(size=6000)
    read = lfilter([0.0, 1.0], np.poly(POLES).real, force + noise)
    recording = Recording(
        "rig",
        Signal(force[late:, None], 1000.0, "force", "N", ("fx",)),
        Signal(read[: len(read) - late, None] / read.std(), 1000.0, "voltage", "V", ("x",)),
    )
    return recording, float(1 / read.std())


def cut_recording(recording: Recording, *lengths: int) -> list[Recording]:
    """Pieces of a recording, from its begin."""
    ends = np.cumsum((0, *lengths))
    return [
        replace(
            recording,
            command=replace(recording.command, samples=recording.command.samples[begin:end]),
            response=replace(recording.response, samples=recording.response.samples[begin:end]),
        )
        for begin, end in pairwise(ends.tolist())
    ]


def median_suggested_delay_s(faulty: list[Recording], step: int = 1, period: int = 6000) -> float:
    """The middle of the delays that are suggested for these recordings; 0 if none is."""
    clean = split_into_parts([record_oscillator(1, 0, period)[0]])
    found = suggest_delays_s([compare_base(AutoregressiveBase(0, 24, step, 1), clean, split_into_parts(faulty))])
    return float(np.median(found)) if found else 0.0


@pytest.mark.parametrize("step", [1, 4])
@pytest.mark.parametrize("late", [0, 37, 402])
def test_a_delay_is_suggested_to_a_part_of_a_row_however_narrow_its_valley_is(late, step):
    assert median_suggested_delay_s([record_oscillator(2, late)[0]], step) == pytest.approx(
        late / 1000.0, abs=1e-4 * step
    )


@pytest.mark.parametrize("short", [100, 200])
def test_a_short_part_hides_no_delay(short):
    """Before, the shortest part said how far to look."""
    assert median_suggested_delay_s(cut_recording(record_oscillator(2, 400)[0], 5000, short)) == pytest.approx(
        0.4, abs=1e-3
    )


@pytest.mark.parametrize("seed", range(2, 6))
def test_a_periodic_command_gives_no_delay_of_whole_periods_more(seed):
    late = record_oscillator(seed, 20, 500)[0]
    assert median_suggested_delay_s([late], period=500) == pytest.approx(0.02, abs=1e-3)


def resample_clock(recording: Recording, rate: float, begins: tuple[int, ...] = (0,)) -> Recording:
    """Readings at t (1 + rate); t counts anew at each begin."""
    read = recording.response.samples[:, 0]
    at = np.arange(len(read), dtype=np.float64)
    for begin in begins:
        at[begin:] = begin + (np.arange(len(read) - begin)) * (1 + rate)
    return replace(recording, response=replace(recording.response, samples=resample(read, at)[:, None]))


def compare_streams(faulty: list[Recording], period: int = 6000) -> list[ComparedBase]:
    clean = split_into_parts([record_oscillator(1, 0, period)[0]])
    return [compare_base(AutoregressiveBase(0, 24, 1, 1), clean, split_into_parts(faulty))]


@pytest.mark.parametrize("rate", [-0.03, -0.004, 0.02])
def test_a_clock_rate_is_suggested_although_many_oscillations_pass(rate):
    found = suggest_clock_rates(compare_streams([resample_clock(record_oscillator(2)[0], rate)]))
    assert min(abs(each.rate - rate) for each in found) < found[0].step == pytest.approx(0.25 / 6000, rel=0.05)


def test_a_clock_that_begins_anew_with_each_part_is_told_from_one_that_runs_on():
    whole = resample_clock(record_oscillator(2)[0], -0.02, (0, 2500))
    parts = [{"start": 0, "stop": 2500}, {"start": 2500, "stop": 6000}]
    found = suggest_clock_rates(compare_streams([replace(whole, meta={"parts": parts})]))
    anew = [each for each in found if not each.from_file_start]
    assert min(abs(each.rate + 0.02) for each in anew) < anew[0].step == pytest.approx(0.25 / 3500, rel=0.05)


@pytest.mark.parametrize("period", [500, 6000])
def test_no_clock_rate_is_suggested_for_a_clock_in_order(period):
    assert suggest_clock_rates(compare_streams([record_oscillator(2, 0, period)[0]], period)) == ()


@pytest.mark.parametrize("rows", [20, 2 * REACH + 3])
def test_parts_that_are_hardly_longer_than_the_filter_suggest_nothing(rows):
    """Their blocks were empty, and their times no numbers."""
    (compared,) = compare_streams([record_oscillator(2, 40)[0]])
    short = replace(compared, faulty=replace(compared.faulty, rows=tuple(part[:rows] for part in compared.faulty.rows)))
    assert suggest_clock_rates([short]) == () and suggest_delays_s([short]) == ()


@pytest.mark.slow
def test_a_fast_clock_is_named_with_its_rate():
    faulty = resample_clock(record_oscillator(2)[0], -0.02)
    found = rank_faults([faulty], [record_oscillator(1)[0]], frozenset(), lambda: True)
    assert found is not None
    named = choose_fault(found, 1).named
    assert named is not None and named.fault.effect == "clock_drift"
    assert named.values["ppm"] == pytest.approx(-20_000, abs=3 * named.standard_errors["ppm"])
    assert named.standard_errors["ppm"] < 200


@pytest.mark.parametrize("by", [0.2, 0.5])
def test_interpolation_makes_prediction_errors_of_noise_smaller_by_what_is_said(by):
    noise = np.random.default_rng(1).normal(size=(40_000, 1))

    def one_step_error(samples):
        past = np.column_stack([samples[24 - lag : -lag] for lag in range(1, 25)])
        left = samples[24:] - past @ np.linalg.lstsq(past, samples[24:], rcond=None)[0]
        return left.std()

    smaller = one_step_error(shift_samples(noise, by)[:, 0]) / one_step_error(noise[:, 0])
    assert smaller == pytest.approx(compute_noise_gain(by), rel=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_noise_of_a_reading_is_neither_late_nor_bent(seed):
    """The mean of two readings has less noise than either, and so has a reading on the flat part of a curve: late
    readings and curves gained 0.3 by that."""

    def noisy(number: int, rms: float) -> Recording:
        plain = record_oscillator(number)[0]
        more = rms * np.random.default_rng(number + 7).normal(size=plain.response.samples.shape)
        return replace(plain, response=replace(plain.response, samples=plain.response.samples + more))

    found = rank_faults([noisy(seed, 0.3)], [noisy(1, 0.1)], frozenset(), lambda: True)
    assert found is not None
    gains = {each.fault.effect: each.gain for each in found.faults}
    for effect in ("logger_offset", "clock_drift", "sensor_nonlinearity", "sensor_asymmetry", "sensor_lag"):
        assert gains[effect] < LEAST_FAULT_GAIN


def delay_recording(recording: Recording, command_rows: int, response_rows: int) -> Recording:
    def by(samples, rows):
        return np.concatenate([np.repeat(samples[:1], rows, axis=0), samples[: len(samples) - rows]])

    return replace(
        recording,
        command=replace(recording.command, samples=by(recording.command.samples, command_rows)),
        response=replace(recording.response, samples=by(recording.response.samples, response_rows)),
    )


@pytest.mark.slow
def test_a_late_reading_that_hides_an_error_of_the_clean_set_explains_the_difference(rig):
    """The drive of this device is late as well: late readings make the faulty set's errors smaller than the clean
    one's, and undoing them makes them larger. That counted against it: it explained 42 %."""
    clean, faulty = delay_recording(rig.record_rig(1), 1, 0), delay_recording(rig.record_rig(2), 1, 1)
    found = rank_faults([faulty], [clean], frozenset(), lambda: True)
    assert found is not None
    (late,) = [each for each in found.faults if each.fault.effect == "logger_offset"]
    assert late.values["offset"] == pytest.approx(1 / rig.RATE_HZ, rel=0.5)
    assert late.share > 0.5


@pytest.mark.slow
@pytest.mark.parametrize("late", [37, 393])
def test_a_long_delay_is_named_with_an_interval_that_holds_it(late):
    """Half of a delay of many oscillations, undone, was taken for a delay of half its length."""
    found = rank_faults([record_oscillator(2, late)[0]], [record_oscillator(1)[0]], frozenset(), lambda: True)
    assert found is not None
    named = choose_fault(found, 1).named
    assert named is not None and named.fault.effect in ("transport_delay", "logger_offset")
    (seconds,), (error,) = named.values.values(), named.standard_errors.values()
    assert abs(seconds - late / 1000.0) < 2 * error < 0.01


def test_a_smooth_response_is_predicted_as_well_as_its_past_allows():
    """Products of readings that are so alike left three times the error."""
    late, innovation = record_oscillator(1, 400)
    parts = split_into_parts([late])
    compared = compare_base(AutoregressiveBase(0, 24, 1, 1), parts, parts)
    assert compared.clean.scale * compared.column_rms[0] == pytest.approx(innovation, rel=0.1)
    assert compute_unexplained_share(compared.base, parts) == pytest.approx(innovation, rel=0.1)


def test_sensor_faults_of_a_response_with_hardly_any_noise_can_be_undone():
    """Errors of 1e-8 of its size are beyond products of values in double precision, and not of second differences."""
    parts = split_into_parts([record_oscillator(2)[0]])
    compared = compare_base(AutoregressiveBase(0, 24, 1, 1), split_into_parts([record_oscillator(1)[0]]), parts)
    gains = [
        fault for fault in make_sensor_faults(0, "x", parts, Lags(1, (), 0.0, ())) if fault.effect == "sensor_gain"
    ]
    for variant in gains[0].variants:
        undone = undo_fault_in_rows(compared, compared.faulty, gains[0], variant)
        assert compared.compute_grams(compared.faulty, undone).is_well_conditioned(variant)


@pytest.mark.slow
def test_a_slow_response_is_compared_by_as_many_rows_as_it_takes():
    """Decimated as its band allows, it had too few."""
    slow = np.sin(2 * np.pi * 0.9 * np.arange(6000) / 1000.0)
    random = np.random.default_rng(1)
    parts = [
        split_into_parts([replace(each, response=replace(each.response, samples=(slow + noise)[:, None]))])
        for each in (record_oscillator(1)[0], record_oscillator(2)[0])
        for noise in [1e-4 * random.normal(size=6000)]
    ]
    (base,), _ = next(build_bases(parts[0], parts[1]))
    assert isinstance(base, AutoregressiveBase) and base.step > 1
    assert compare_base(base, parts[0], parts[1]).faulty.valid_row_count >= LEAST_ROWS


def test_the_shares_of_three_axes_are_those_of_the_catalogue():
    recording, _ = record_oscillator(1)
    samples = np.tile(recording.response.samples, (1, 3))
    three = replace(recording.response, samples=samples, channels=("x", "y", "z"))
    parts = split_into_parts([replace(recording, response=three)])
    shares = [
        [*fault.variants[0].parameters_of(np.array([0.1])).items()]
        for fault in make_sensor_faults(2, "z", parts, Lags(1, (), 0.0, ()))
        if fault.effect == "cross_axis_sensitivity"
    ]
    # The catalogue requires both shares; the one that is compared is the main number, the first.
    assert shares == [
        [("from_next", 0.1), ("from_after_next", 0.0)],
        [("from_after_next", 0.1), ("from_next", 0.0)],
    ]
