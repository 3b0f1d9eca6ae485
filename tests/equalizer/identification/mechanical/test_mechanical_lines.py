"""Spectra of segments: which of them contain a transient."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.identification.frequency_response.experiments import collect_window_experiments
from equalizer.identification.mechanical.mechanical_fit import fit_mechanical_model
from equalizer.identification.mechanical.mechanical_fit_result import MechanicalFitSettings
from equalizer.identification.mechanical.mechanical_lines import (
    compute_all_lines,
    compute_segment_lines,
    have_same_lines,
    select_band,
    split_fit_and_test,
    thin_lines,
)
from equalizer.identification.mechanical.mechanical_misfit import add_scatter_noise
from equalizer.signals.recording import Segment
from tests.equalizer.identification.mechanical.test_mechanical_fit import RATE_HZ, multisine, recording, stepped


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


def test_gaps_divide_a_segment_without_whole_periods_into_runs():
    command = np.random.default_rng(4).standard_normal((3000, 1))
    response = command.copy()
    response[[1000, 1001, 1800, 2500]] = np.nan
    gappy = recording(command, response)

    def count_lines(segment):
        return [len(lines.frequency_hz) for lines in compute_all_lines([(gappy, segment)])]

    assert count_lines(Segment(0, 3000, "noise")) == [499, 398, 349]  # the run of 499 samples is too short
    assert count_lines(Segment(0, 3000, "multisine", 1.0, 600)) == [299]  # two periods are complete: their mean
    assert count_lines(Segment(1100, 1700, "noise")) == [299]


def test_a_device_that_lost_samples_now_and_then_is_fitted_to_all_of_its_tones():
    """A few samples are missing after each tone: a single run would hold one tone, which many models explain."""
    tones_hz = (3.0, 11.0, 1.5, 6.0, 18.0)
    command = np.concatenate([np.sin(2 * np.pi * f * np.arange(2000) / RATE_HZ) for f in tones_hz])[:, None]
    eye = np.eye(1)
    response = stepped(0.3 * eye, 4.0 * eye, 900.0 * eye, eye, eye, "velocity", command)
    response += 1e-3 * response.std() * np.random.default_rng(5).standard_normal(response.shape)
    for start in range(2000, len(response), 2000):
        response[start : start + 4] = np.nan
    fit = fit_mechanical_model(recording(command, response, "velocity"))
    values = [float(matrix[0, 0]) for matrix in (fit.model.mass, fit.model.damping, fit.model.stiffness)]
    assert values == pytest.approx([0.3, 4.0, 900.0], rel=0.02)
    assert fit.held_out is not None and fit.held_out < 0.02


def test_where_all_segments_are_marked_as_test_the_marks_are_ignored():
    command = multisine(np.random.default_rng(4), 6)[:, None]
    for roles, count in ((("test",) * 3, (2, 1)), (("",) * 3, (2, 1)), (("fit", "test", "test"), (1, 2))):
        segments = tuple(
            Segment(2000 * k, 2000 * (k + 1), "multisine", 1.0, 1000, role) for k, role in enumerate(roles)
        )
        fit, test = split_fit_and_test([recording(command, command, segments=segments)])
        assert (len(fit), len(test)) == count


def test_without_segments_each_part_of_a_recording_is_one():
    """Files that are joined: no spectrum reaches across the jumps between them."""
    parts = [{"start": 0, "stop": 900}, {"start": 900, "stop": 920}, {"start": 920, "stop": 2000}]
    command = np.random.default_rng(4).standard_normal((2000, 1))
    joined = replace(recording(command, command), meta={"parts": parts})
    fit, test = ([segment for _, segment in pairs] for pairs in split_fit_and_test([joined]))
    # Of the middle part, 20 samples are too short; the last third of the longest part is for the test.
    assert fit == [Segment(0, 900, "noise"), Segment(920, 1640, "noise", role="fit")]
    assert test == [Segment(1640, 2000, "noise", role="test")]
    whole, short = replace(joined, meta={}), recording(command[:900], command[:900])
    assert [len(pairs) for pairs in split_fit_and_test([whole, short])] == [2, 0]
    windows = collect_window_experiments([joined], 0.2).experiments  # of 100 samples, each 50 after the last
    assert len(windows) == 17 + 20


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


@pytest.mark.parametrize("first", [0, 1, 2, 3, 15])
def test_thinned_lines_contain_those_of_a_comb(first):
    power = np.full(1387, 1e-4)
    power[first::16] = 1.0
    chosen = thin_lines(power, 400)
    assert len(chosen) == 347 and set(range(first, 1387, 16)) <= set(chosen.tolist())
    np.testing.assert_array_equal(thin_lines(np.ones(1387), 400), np.arange(0, 1387, 4))
    np.testing.assert_array_equal(thin_lines(power, 1387), np.arange(1387))


@pytest.mark.parametrize("at_rest", [0.0, 9.81])
def test_axes_recorded_one_at_a_time_are_uncoupled_where_the_other_sensor_does_not_move(at_rest):
    """As encoders of an x-y stage do: the channel of the axis that is not driven is exactly constant."""
    rng, recordings, mass = np.random.default_rng(5), [], np.diag([0.3, 0.25])
    damping, stiffness = np.diag([2.0, 3.0]), np.diag([120.0, 90.0])
    for axis in (0, 1):
        command = np.zeros((4000, 2))
        command[:, axis] = multisine(rng, 4)
        response = stepped(mass, damping, stiffness, np.eye(2), np.eye(2), "acceleration", command)
        response[:, axis] += 0.01 * response[:, axis].std() * rng.standard_normal(4000)
        response[:, 1 - axis] = at_rest
        recordings.append(recording(command, response))
    fit = fit_mechanical_model(recordings, MechanicalFitSettings(most_modes=1))
    np.testing.assert_allclose(fit.model.mass, mass, atol=0.003)
    np.testing.assert_allclose(fit.model.damping, damping, atol=0.1)
    assert fit.error < 0.02


@pytest.mark.parametrize("offset", [0.0, 20.0])
def test_lines_to_which_the_command_only_leaks_are_not_excited(offset):
    samples, random = 6000, np.random.default_rng(3)
    spectrum, lines_hz = np.fft.rfft(random.standard_normal(samples)), np.fft.rfftfreq(samples, 1 / 500)
    command = np.fft.irfft(np.where((lines_hz > 5) & (lines_hz < 40), spectrum, 0.0), samples)[:, None] + offset
    part = Segment(0, 4001, "noise")
    lines = compute_segment_lines(recording(command, command, segments=(part,)), part)
    excited_hz = lines.frequency_hz[lines.excited]
    assert 4.0 < excited_hz[0] < 5.5
    assert 39.5 < excited_hz[-1] < 42.0


@pytest.mark.parametrize("is_logarithmic", [False, True])
def test_both_ends_of_a_sweep_are_excited(is_logarithmic):
    share, low_hz, high_hz, duration_s = np.arange(10000) / 10000, 0.5, 100.0, 20.0
    ratio = np.log(high_hz / low_hz)
    cycles = (
        low_hz
        * duration_s
        * (np.expm1(ratio * share) / ratio if is_logarithmic else share + (high_hz / low_hz - 1) * share**2 / 2)
    )
    command, part = np.sin(2 * np.pi * cycles)[:, None], Segment(0, 10000, "sweep")
    lines = compute_segment_lines(recording(command, command, segments=(part,)), part)
    excited_hz = lines.frequency_hz[lines.excited]
    assert excited_hz[0] < 1.2 * low_hz
    assert excited_hz[-1] > 0.88 * high_hz


def test_a_pulse_at_the_beginning_excites_all_lines():
    command = np.zeros((3000, 1))
    command[1] = 1.0
    part = Segment(0, 3000, "tap")
    assert compute_segment_lines(recording(command, command, segments=(part,)), part).excited.all()
