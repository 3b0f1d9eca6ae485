"""The drive is that of the labelled cases."""

import json

import numpy as np
import pytest

from study.evaluation.challenge.drive_plan import PERIOD_SAMPLES, draw_multisine, draw_plan
from study.store.formats.recording_file import read_recording


def test_a_multisine_has_odd_lines_and_one_of_four_silent():
    spectrum = np.abs(np.fft.rfft(draw_multisine(np.random.default_rng(1), 1.5)))
    lines = np.flatnonzero(spectrum > 1e-9 * spectrum.max())
    assert (lines % 2 == 1).all()
    assert (lines.min() >= 3) and (lines.max() <= 479)
    assert len(lines) == 239 - 60


def test_a_multisine_peaks_at_its_level_and_falls_with_the_root_of_frequency():
    wave = draw_multisine(np.random.default_rng(2), 1.5)
    spectrum = np.abs(np.fft.rfft(wave))
    lines = np.flatnonzero(spectrum > 1e-9 * spectrum.max())
    scaled = spectrum[lines] * np.sqrt(lines)
    assert np.abs(wave).max() == pytest.approx(1.5)
    np.testing.assert_allclose(scaled, scaled[0], rtol=1e-9)


def test_segments_and_fixed_waves_are_those_of_the_labelled_cases(shared):
    plan, recorded = draw_plan(np.random.default_rng(3)), read_recording(shared / "cases" / "open-00.h5")
    assert json.dumps([(s.start, s.stop, s.kind, s.period, s.role) for s in plan.segments]) == json.dumps(
        [(s.start, s.stop, s.kind, s.period, s.role) for s in recorded.segments]
    )
    for segment in plan.segments:
        if segment.kind in ("sweep", "slow"):
            there = recorded.command.samples[segment.start : segment.stop]
            np.testing.assert_allclose(plan.command[segment.start : segment.stop], there, atol=2e-3)


def test_the_first_level_is_driven_for_four_equal_periods_and_then_rests():
    plan = draw_plan(np.random.default_rng(3))
    first = plan.command[:PERIOD_SAMPLES]
    np.testing.assert_array_equal(plan.command[: 4 * PERIOD_SAMPLES], np.tile(first, (4, 1)))
    assert not plan.command[4 * PERIOD_SAMPLES : 4 * PERIOD_SAMPLES + 500].any()
