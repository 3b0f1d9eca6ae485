"""Recovery of a known truth from sweeps, multisines and noise, in open and closed loop."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from equalizer.identification.frequency_response.experiments import Experiment
from equalizer.identification.frequency_response.noise_floor import estimate_rest_density
from equalizer.identification.frequency_response.transfer_estimate import (
    EstimateSettings,
    TransferEstimateError,
    _group_by_lines,
    estimate_transfer,
)
from equalizer.signals.multisine import list_lines_between, make_multisines
from equalizer.signals.recording import Hold, Recording, Segment
from equalizer.signals.signal import Signal


def with_gap(recording, sample):
    samples = recording.response.samples.copy()
    samples[sample] = np.nan
    return replace(recording, response=replace(recording.response, samples=samples))


def random_multisines(plants, odd=False):
    """Three realisations with phases of their own, all axes at once."""
    waves = []
    for seed in range(3):
        wave = plants.multisine(4.5, 37.0, 5.0, seed=seed)
        if odd:
            spectrum = np.fft.rfft(wave, axis=0)
            spectrum[::2] = 0.0
            wave = np.fft.irfft(spectrum, len(wave), axis=0)
        waves.append(wave)
    return waves


def test_without_noise_the_truth_comes_out(plants, synthetic):
    estimate = estimate_transfer((synthetic.sweeps(plants, 4.5, 37.0, 5.0, noise=0.0),))
    assert synthetic.errors(estimate, plants.omega_like()).max() < 1e-6
    assert (estimate.input_channels, estimate.output_channels) == (synthetic.FORCES, synthetic.ACCELERATIONS)
    assert (estimate.input_unit, estimate.output_unit) == ("N", "m/s^2")


@pytest.mark.slow
def test_the_sweeps_of_the_notes_reach_about_one_percent(plants, synthetic):
    estimate = estimate_transfer((synthetic.sweeps(plants, 4.5, 37.0, 30.0),))
    assert 0.008 < synthetic.rms_error(estimate, plants.omega_like()) < 0.012
    assert synthetic.errors(estimate, plants.omega_like()).max() < 0.032


@pytest.mark.slow
@pytest.mark.parametrize(("periods", "lowest", "highest"), [(2, 0.6, 1.3), (5, 0.8, 1.25)])
def test_the_stated_variance_is_the_variance_of_the_errors(plants, synthetic, periods, lowest, highest):
    """From one counted period by the scatter between lines, from four by what differs between them."""
    truth, ratios = plants.omega_like(), []
    for seed in range(5):
        recording = synthetic.sweeps(plants, 4.5, 37.0, 5.0, seed=seed, periods=periods)
        band = estimate_transfer((recording,), EstimateSettings()).select_band(5.0, 35.0)
        ratios.append(np.abs(band.response - truth.response(band.frequency_hz)) ** 2 / band.noise_variance)
    assert lowest < np.mean(ratios) < highest


def test_noise_that_is_ten_times_smaller_is_said_to_be(plants, synthetic):
    loud, quiet = (
        estimate_transfer((synthetic.sweeps(plants, 4.5, 37.0, 5.0, periods=3, noise=noise),)).select_band(5.0, 35.0)
        for noise in (1.0, 0.1)
    )
    assert np.median(loud.noise_variance / quiet.noise_variance) == pytest.approx(100.0, rel=0.05)


def test_a_smooth_estimate_of_one_period_is_at_least_as_noisy_as_the_rest_before_it(plants, synthetic):
    """Sensor noise that a single period does not show, because it happens to vanish there, is in the rest."""
    recording = synthetic.sweeps(plants, 4.5, 37.0, 5.0, noise=0.0)
    samples = recording.response.samples.copy()
    samples[: synthetic.REST] = np.random.default_rng(3).standard_normal((synthetic.REST, 3)) * plants.SENSOR_RMS
    noisy = replace(recording, response=replace(recording.response, samples=samples))
    without, with_rest = (estimate_transfer((each,)).select_band(5.0, 35.0) for each in (recording, noisy))
    assert np.median(with_rest.noise_variance) > 20 * np.median(without.noise_variance)


@pytest.mark.slow
def test_a_spring_drops_out_of_the_estimate(plants, synthetic):
    recording = synthetic.under_a_spring(plants, synthetic.axes(plants.sweep(4.5, 37.0, 5.0)), 300.0, noise=0.0)
    estimate = estimate_transfer((recording,))
    assert synthetic.errors(estimate, plants.omega_like()).max() < 1e-6
    naive = replace(recording, command=recording.excitation)
    assert synthetic.errors(estimate_transfer((naive,)), plants.omega_like()).max() > 0.1


def test_below_the_spring_lines_are_not_reliable_and_a_remark_says_so(plants, synthetic):
    recording = replace(synthetic.sweeps(plants, 1.0, 37.0, 5.0), meta={"feedback": {"natural_frequency_hz": 3.5}})
    estimate = estimate_transfer((replace(recording, excitation=recording.command),))
    assert not estimate.reliable[estimate.frequency_hz < 3.85].any()
    assert estimate.reliable[(estimate.frequency_hz > 3.9) & (estimate.frequency_hz < 35.0)].all()
    assert any("virtual spring (3.5 Hz)" in remark for remark in estimate.remarks)


def test_a_spring_whose_share_was_not_recorded_is_remarked(plants, synthetic):
    recording = synthetic.sweeps(plants, 4.5, 37.0, 5.0)
    sprung = replace(recording, meta={"feedback": {"natural_frequency_hz": 3.5}})
    assert any("was not recorded" in remark for remark in estimate_transfer((sprung,)).remarks)


def test_lines_outside_the_sweep_are_not_reliable(plants, synthetic):
    estimate = estimate_transfer((synthetic.sweeps(plants, 4.5, 37.0, 5.0),))
    inside = estimate.frequency_hz[estimate.reliable]
    assert 3.8 < inside.min() < 4.6
    assert 36.5 < inside.max() < 39.0
    assert any(
        remark.startswith("Not reliable, because not every direction was excited") for remark in estimate.remarks
    )


def test_whether_all_directions_were_excited_does_not_depend_on_units(plants, synthetic):
    """The third command is a torque at a lever of 5 mm: 0.005 N m count as much as 1 N."""
    recording = synthetic.played(plants, random_multisines(plants), kind="multisine")
    levers = recording.command.samples * [1.0, 1.0, 0.005]
    torque = Signal(
        levers, recording.sample_rate_hz, ("force", "force", "torque"), ("N", "N", "N m"), recording.command.channels
    )
    estimate, with_torque = (estimate_transfer((each,)) for each in (recording, replace(recording, command=torque)))
    assert estimate.reliable.sum() > 100
    np.testing.assert_array_equal(with_torque.reliable, estimate.reliable)


def test_lines_that_drown_in_noise_are_not_reliable(plants, synthetic):
    estimate = estimate_transfer((synthetic.sweeps(plants, 1.0, 400.0, 5.0, periods=3, noise=20.0),))
    assert not estimate.reliable[estimate.frequency_hz < 2.0].any()
    assert (estimate.coherence[estimate.reliable] >= 0.5).all()
    assert any("noise is more than 50 %" in remark for remark in estimate.remarks)


def test_coherence_is_high_where_the_noise_is_low(plants, synthetic):
    band = estimate_transfer((synthetic.sweeps(plants, 4.5, 37.0, 5.0, periods=3),)).select_band(5.0, 35.0)
    assert band.coherence.min() > 0.98


def test_multisines_with_phases_of_their_own_tell_all_axes(plants, synthetic):
    recording = synthetic.played(plants, random_multisines(plants), kind="multisine", noise=0.0)
    assert synthetic.errors(estimate_transfer((recording,)), plants.omega_like()).max() < 1e-6


def test_lines_that_an_odd_multisine_leaves_silent_are_left_out(plants, synthetic):
    recording = synthetic.played(plants, random_multisines(plants, odd=True), kind="multisine")
    band = estimate_transfer((recording,)).select_band(5.0, 35.0)
    assert np.allclose(np.round(band.frequency_hz * 5.0) % 2, 1)
    # Phases drawn at random are nearly the same in two experiments at some lines.
    assert 0.5 < band.reliable.mean() < 1.0
    assert synthetic.errors(band.select_lines(band.reliable), plants.omega_like()).max() < 0.2


def test_recordings_of_different_periods_meet_at_the_lines_that_they_share(plants, synthetic):
    long, short = (synthetic.sweeps(plants, 4.5, 37.0, seconds, seed=int(seconds)) for seconds in (6.0, 4.0))
    alone, together = estimate_transfer((long,)), estimate_transfer((long, short))
    # Every sixth of a hertz, every fourth, and once where both meet: at the halves.
    assert len(together.select_band(5.0, 34.9)) == 180 + 120 - 60
    shared = np.isclose(together.frequency_hz * 2 % 1, 0) & together.reliable
    halves = np.isclose(alone.frequency_hz * 2 % 1, 0) & alone.reliable
    assert np.median(together.noise_variance[shared]) < 0.8 * np.median(alone.noise_variance[halves])
    assert synthetic.errors(together, plants.omega_like()).max() < 0.1


def test_axes_recorded_apart_are_joined(plants, synthetic):
    waves = synthetic.axes(plants.sweep(4.5, 37.0, 5.0))
    parts = tuple(synthetic.played(plants, [wave], noise=0.0) for wave in waves)
    assert synthetic.errors(estimate_transfer(parts), plants.omega_like()).max() < 1e-6


def test_a_period_with_a_gap_is_left_out(plants, synthetic):
    recording = synthetic.sweeps(plants, 4.5, 37.0, 5.0, periods=3, noise=0.0)
    estimate = estimate_transfer((with_gap(recording, synthetic.REST + 5500),))
    assert synthetic.errors(estimate, plants.omega_like()).max() < 1e-6
    assert "One period was left out because of missing samples." in estimate.remarks


def test_a_single_period_is_kept_with_a_remark(plants, synthetic):
    estimate = estimate_transfer((synthetic.sweeps(plants, 4.5, 37.0, 5.0, periods=1, noise=0.0),))
    assert 1e-4 < synthetic.rms_error(estimate, plants.omega_like()) < 0.05
    assert any("3 segments had one usable period only" in remark for remark in estimate.remarks)


def test_what_is_kept_for_testing_is_not_used(plants, synthetic):
    recording = synthetic.sweeps(plants, 4.5, 37.0, 5.0)
    kept = tuple(replace(segment, role="test") for segment in recording.segments[:1])
    with pytest.raises(TransferEstimateError, match="3 inputs need 3 independent experiments"):
        estimate_transfer((replace(recording, segments=kept + recording.segments[1:]),))


def test_noise_of_others_is_averaged_over_windows(plants, synthetic):
    command = np.random.default_rng(5).standard_normal((60_000, 3))
    sensor = np.random.default_rng(6).standard_normal(command.shape) * plants.SENSOR_RMS
    recording = synthetic.recording_of(command, plants.omega_like().play(command) + sensor)
    band = estimate_transfer((recording,)).select_band(5.0, 35.0)
    true = plants.omega_like().response(band.frequency_hz)
    assert synthetic.rms_error(band, plants.omega_like()) < 0.12
    assert 0.5 < np.mean(np.abs(band.response - true) ** 2 / band.noise_variance) < 2.0
    assert band.reliable.all()
    assert "Hann windows of 4 s (H1)" in band.remarks[0]


def test_a_single_axis_device_needs_one_experiment(plants, synthetic):
    whole = synthetic.sweeps(plants, 4.5, 37.0, 5.0, noise=0.0)
    one = replace(
        synthetic.recording_of(whole.command.samples[:, :1], whole.response.samples[:, :2]), segments=whole.segments[:1]
    )
    band = estimate_transfer((one,)).select_band(5.0, 35.0)
    true = plants.omega_like().response(band.frequency_hz)[:, :2, :1]
    assert np.abs(band.response / true - 1).max() < 1e-4


def test_nothing_that_tells_is_refused_with_what_would_do(plants, synthetic):
    quiet = synthetic.recording_of(np.zeros((2000, 3)), np.zeros((2000, 3)), (Segment(0, 2000, "rest"),))
    with pytest.raises(TransferEstimateError, match="record a sweep or a multisine along every axis"):
        estimate_transfer((quiet,))
    with pytest.raises(TransferEstimateError, match="there is no recording"):
        estimate_transfer(())


def test_one_axis_driven_three_times_is_refused(plants, synthetic):
    wave = plants.sweep(4.5, 37.0, 3.0)[:, None] * np.eye(3)[0]
    with pytest.raises(TransferEstimateError, match="Record every axis separately"):
        estimate_transfer((synthetic.played(plants, [wave] * 3),))


def test_recordings_that_do_not_belong_together_are_refused(plants, synthetic):
    first = synthetic.sweeps(plants, 4.5, 37.0, 3.0)
    faster = synthetic.recording_of(np.zeros((10, 3)), np.zeros((10, 3)))
    volts = Signal(faster.command.samples, 1000.0, "voltage", "V", ("a", "b", "c"))
    with pytest.raises(TransferEstimateError, match="recording 2 has the command channels a, b, c in V"):
        estimate_transfer((first, replace(faster, command=volts)))


def test_sample_rates_that_differ_in_the_seventh_digit_are_refused_by_all_their_digits(plants, synthetic):
    first = synthetic.recording_of(np.ones((10, 3)), np.ones((10, 3)))
    signals = (replace(signal, sample_rate_hz=1000.0001) for signal in (first.command, first.response))
    second = replace(first, **dict(zip(("command", "response"), signals, strict=True)))
    with pytest.raises(TransferEstimateError, match=r"sample rate 1000\.0001 Hz, but the first has 1000 Hz"):
        estimate_transfer((first, second))


def test_orthogonal_multisines_leave_no_line_without_all_directions(plants, synthetic):
    lines = list_lines_between(4.5, 37.0, 5000, synthetic.RATE, odd_only=True)
    waves = make_multisines(lines, 5000, 1.5, 3, 3, seed=4)
    band = estimate_transfer((synthetic.played(plants, waves, kind="multisine"),)).select_band(5.0, 35.0)
    assert band.reliable.all()
    assert synthetic.errors(band, plants.omega_like()).max() < 0.06


def test_lines_that_many_periods_share_are_found_exactly():
    """The least common multiple of these lengths exceeds 64 bits."""
    lengths = [2000, 1000, 1664, 1513, 1223, 1269, 949, 990, 919, 1110]
    experiments = [Experiment(length, *[np.zeros((1, (length + 1) // 2 - 1, 1), complex)] * 3) for length in lengths]
    groups = list(_group_by_lines(experiments, 1000.0))
    found_hz = np.concatenate([frequency_hz for frequency_hz, _ in groups])
    exact = {Fraction(1000 * line, length) for length in lengths for line in range(1, (length + 1) // 2)}
    assert len(found_hz) == len(exact)
    assert np.allclose(sorted(found_hz), sorted(float(line) for line in exact), rtol=1e-12, atol=0)
    assert all(part.command.shape[1] == len(frequency_hz) for frequency_hz, parts in groups for part in parts)


@pytest.mark.parametrize("rate_hz", [1.0, 5.0, 14.0])
def test_a_slow_device_has_a_noise_at_rest_too(rate_hz):
    generator = np.random.default_rng(1)
    period = np.concatenate(
        [np.zeros((60, 1)), np.tile(generator.standard_normal((200, 1)), (3, 1)), np.zeros((60, 1))]
    )
    noise = 0.1 * generator.standard_normal(period.shape)
    force = Signal(period, rate_hz, "force", "N", ("fx",))
    response = Signal(np.roll(period, 1, axis=0) + noise, rate_hz, "acceleration", "m/s^2", ("ax",))
    recording = Recording("slow", force, response, segments=(Segment(60, 660, "noise", 3.0, 200),))
    estimate = estimate_transfer((recording,))
    assert np.abs(np.abs(estimate.response) - 1).mean() < 0.1
    density = estimate_rest_density((recording,), estimate.frequency_hz)
    assert density.mean() == pytest.approx(0.01, rel=0.3)


def test_a_stuck_output_with_missing_samples_is_refused(plants, synthetic):
    recording = synthetic.sweeps(plants, 4.5, 37.0, 3.0)
    samples = recording.response.samples.copy()
    samples[:, 2] = 9.81
    samples[0, 2] = np.nan
    with pytest.raises(TransferEstimateError, match="there is no signal from az"):
        estimate_transfer((replace(recording, response=replace(recording.response, samples=samples)),))


def test_a_command_that_is_not_held_is_remarked_and_not_mixed(plants, synthetic):
    held = synthetic.sweeps(plants, 4.5, 37.0, 3.0)
    continuous = replace(held, hold=Hold.BAND_LIMITED)
    assert any("acts half a sample later" in remark for remark in estimate_transfer((continuous,)).remarks)
    assert not any("half a sample" in remark for remark in estimate_transfer((held,)).remarks)
    with pytest.raises(TransferEstimateError, match="recording 2 has the hold band-limited, but the first has zero-or"):
        estimate_transfer((held, continuous))
