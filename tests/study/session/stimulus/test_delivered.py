from dataclasses import replace

import numpy as np
import pytest

from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal
from study.session.stimulus.delivered import measure_delivered

RATE_HZ = 1000.0
DIRECTION = np.array([0.0, -1.0, 1.0]) / np.sqrt(2)
ACROSS = np.array([0.0, 1.0, 1.0]) / np.sqrt(2)


def recording(n: int, along: float, off: float, phase: float = 0.0) -> Recording:
    w = 2 * np.pi * 25.0 * np.arange(n) / RATE_HZ
    a = along * np.sin(w)[:, None] * DIRECTION + off * np.sin(w + phase)[:, None] * ACROSS
    force = Signal(np.zeros((n, 3)), RATE_HZ, "force", "N", ("fx", "fy", "fz"))
    position = Signal(-a / (2 * np.pi * 25.0) ** 2, RATE_HZ, "position", "m", ("x", "y", "z"))
    return Recording("d", force, Signal(a + 0.3, RATE_HZ, "acceleration", "m/s^2", ("ax", "ay", "az")), position)


@pytest.mark.parametrize("phase", [0.0, 1.0, np.pi / 2])
def test_along_and_off_the_direction_come_apart_at_any_phase(phase):
    values = measure_delivered(recording(1000, 4.0, 1.5, phase), DIRECTION, 25.0)
    assert values.along_mps2 == pytest.approx(4.0)
    assert values.off_axis_mps2 == pytest.approx(1.5)
    assert values.displacement_mm == pytest.approx(1000 * 4.0 / (2 * np.pi * 25.0) ** 2)


def test_missed_ticks_are_left_out():
    whole = recording(1000, 4.0, 1.5)
    gaps = whole.response.samples.copy()
    gaps[[3, 40, 41, 500]] = np.nan
    values = measure_delivered(replace(whole, response=replace(whole.response, samples=gaps)), DIRECTION, 25.0)
    assert values.along_mps2 == pytest.approx(4.0)
    assert values.off_axis_mps2 == pytest.approx(1.5)


def test_a_recording_of_nothing_but_gaps_is_no_measurement():
    whole = recording(1000, 4.0, 1.5)
    nothing = replace(whole.response, samples=np.full((1000, 3), np.nan))
    assert measure_delivered(replace(whole, response=nothing), DIRECTION, 25.0) is None


def test_less_than_a_period_is_no_measurement():
    assert measure_delivered(recording(30, 4.0, 0.0), DIRECTION, 25.0) is None


@pytest.mark.parametrize("amplitude", [1e7, 1e300])
def test_an_acceleration_that_no_handle_has_is_no_measurement(amplitude):
    """The log refused it, and each answer ended the program."""
    with np.errstate(over="ignore", invalid="ignore"):
        assert measure_delivered(recording(1000, amplitude, 0.0), DIRECTION, 25.0) is None
        assert measure_delivered(recording(1000, 0.0, amplitude), DIRECTION, 25.0) is None


def test_harmonics_are_measured_over_all_axes_and_not_where_there_are_none():
    whole = recording(1000, 4.0, 1.5)
    w = 2 * np.pi * 25.0 * np.arange(1000) / RATE_HZ
    more = 0.3 * np.sin(2 * w)[:, None] * ACROSS + 0.4 * np.sin(5 * w + 1.0)[:, None] * DIRECTION
    bent = replace(whole, response=replace(whole.response, samples=whole.response.samples + more))
    values = measure_delivered(bent, DIRECTION, 25.0)
    assert values.harmonics_mps2 == pytest.approx(0.5)
    assert values.along_mps2 == pytest.approx(4.0, rel=1e-4)
    assert measure_delivered(whole, DIRECTION, 25.0).harmonics_mps2 == pytest.approx(0.0, abs=1e-9)


def test_harmonics_beyond_half_the_rate_are_left_out():
    slow = recording(1000, 4.0, 0.0)
    assert measure_delivered(slow, DIRECTION, 249.0).harmonics_mps2 is not None
    assert measure_delivered(slow, DIRECTION, 250.0).harmonics_mps2 is None
