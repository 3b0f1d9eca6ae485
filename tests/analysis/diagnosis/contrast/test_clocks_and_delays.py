"""Late readings: by a clock that runs on through a file, or by a delay of any length."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from analysis.diagnosis.contrast.actuator_faults import AROUND, delays_to_try, resample, shift_samples
from analysis.diagnosis.contrast.autoregressive_base import AutoregressiveBase
from analysis.diagnosis.contrast.part import split_into_parts
from analysis.diagnosis.contrast.stream import likely_delays_s, stream_of
from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal

BEGIN = 3000
"""First sample with a reading."""


def test_a_clock_that_ran_on_before_the_first_reading_is_named_with_its_rate(rig):
    late = rig.read_as(2, lambda y: resample(y, np.arange(len(y)) * (1 + 2e-3)))
    read = late.response.samples.copy()
    read[:BEGIN] = np.nan
    found = rig.decision(replace(late, response=replace(late.response, samples=read)))
    assert found.named is not None
    assert found.named.fault.effect == "clock_drift"
    assert found.named.values["ppm"] == pytest.approx(2000, rel=0.2)


def test_each_delay_lies_within_reach_of_those_that_are_tried():
    slow = np.sin(2 * np.pi * 0.2 * np.arange(20_000) / 1000.0)
    tried = np.array(delays_to_try(slow, 1000.0))
    assert tried[-1] / tried[0] > 1000
    assert np.all(tried[1:] * AROUND[0] <= 1.0001 * tried[:-1] * AROUND[1])


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


def oscillator(seed: int, late: int = 0) -> tuple[Recording, float]:
    """A smooth response, read late beside its command, and what the command's next value does to it."""
    force = np.random.default_rng(seed).normal(size=6000)
    read = lfilter([0.0, 1.0], np.poly(POLES).real, force)
    recording = Recording(
        "rig",
        Signal(force[late:, None], 1000.0, "force", "N", ("fx",)),
        Signal(read[: len(read) - late, None] / read.std(), 1000.0, "voltage", "V", ("x",)),
    )
    return recording, float(1 / read.std())


@pytest.mark.parametrize("late", [0, 37, 400])
def test_how_late_readings_are_is_found_however_narrow_the_valley_of_their_error_is(late):
    clean, other = (split_into_parts([oscillator(seed, at)[0]]) for seed, at in ((1, 0), (2, late)))
    stream = stream_of(AutoregressiveBase(0, 24, 1), clean, other)
    assert likely_delays_s([stream]) == pytest.approx((late / 1000.0,) if late else ())


def test_a_smooth_response_is_predicted_as_well_as_its_past_allows():
    """Products of readings that are so alike left three times the error."""
    late, innovation = oscillator(1, 400)
    parts = split_into_parts([late])
    stream = stream_of(AutoregressiveBase(0, 24, 1), parts, parts)
    assert stream.clean.scale == pytest.approx(innovation, rel=0.1)
