"""Late readings: by a clock that runs on through a file, or by a delay of any length."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.contrast.actuator_faults import AROUND, delays_to_try, resample, shift_samples

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
