"""Spectra of segments: which of them contain a transient."""

import numpy as np

from equalizer.identification.mechanical.mechanical_lines import (
    compute_segment_lines,
    have_same_lines,
    select_band,
    split_fit_and_test,
)
from equalizer.identification.mechanical.mechanical_misfit import add_scatter_noise
from equalizer.signals.recording import Segment
from tests.equalizer.identification.mechanical.test_mechanical_fit import multisine, recording


def test_only_complete_periods_after_the_first_are_without_a_transient():
    rng = np.random.default_rng(4)
    command = multisine(rng, 3)[:, None]
    segment = Segment(0, 3000, "multisine", 1.0, 1000, "fit")

    def has_transient(missing):
        response = command.copy()
        response[missing] = np.nan
        return compute_segment_lines(recording(command, response, segments=(segment,)), segment).transient

    assert not has_transient([])
    assert not has_transient([100, 1100])  # the last period is complete
    assert has_transient([1100, 2100])  # only the first is
    assert has_transient([100, 1900, 2950])  # none is: the longest run begins within the first


def test_where_all_segments_are_marked_as_test_the_marks_are_ignored():
    command = multisine(np.random.default_rng(4), 6)[:, None]
    for roles, count in ((("test",) * 3, (2, 1)), (("",) * 3, (2, 1)), (("fit", "test", "test"), (1, 2))):
        segments = tuple(
            Segment(2000 * k, 2000 * (k + 1), "multisine", 1.0, 1000, role) for k, role in enumerate(roles)
        )
        fit, test = split_fit_and_test([recording(command, command, segments=segments)])
        assert (len(fit), len(test)) == count


def test_as_many_lines_are_not_the_same_lines():
    """Two periods that excite a hundred lines each: one below 20 Hz, the other above it."""
    rng, segments = np.random.default_rng(4), []
    for length, first in ((5000, 1), (1000, 20)):
        spectrum = np.zeros(length // 2 + 1, dtype=complex)
        spectrum[first : first + 100] = np.exp(2j * np.pi * rng.random(100))
        command = np.tile(np.fft.irfft(spectrum, length), 3)[:, None]
        noise = 1e-6 * rng.standard_normal(command.shape)
        segment = Segment(0, 3 * length, "multisine", 1.0, length, "fit")
        segments.append(compute_segment_lines(recording(command, command + noise, segments=(segment,)), segment))
    lines = select_band(segments, None)
    assert len(lines[0].frequency_hz) == len(lines[1].frequency_hz) == 100
    assert not have_same_lines(*lines)
    for before, after in zip(lines, add_scatter_noise(lines), strict=True):
        np.testing.assert_array_equal(after.noise, before.noise)
